"""Video: in come files, out come `Frames`, one image per camera at one time; knows no body."""

from airborne.video.frames import Frames, View

__all__ = ["Frames", "View"]
