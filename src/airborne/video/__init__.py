"""Video: in come files, out come `Frames`, one image per camera at one time, and written videos.

Files are read once, in order of time, by frames or by the fields of interlaced video; cameras are aligned by their
exact time stamps, and lens distortion is taken out. It knows no body and no pose.
"""

from airborne.video.decoding import VideoFacts, VideoSource, inspect
from airborne.video.fields import fill_rows, weave
from airborne.video.frames import Frames, View
from airborne.video.recording import Recording, open_recording
from airborne.video.writing import VideoWriter

__all__ = [
    "Frames",
    "Recording",
    "VideoFacts",
    "VideoSource",
    "VideoWriter",
    "View",
    "fill_rows",
    "inspect",
    "open_recording",
    "weave",
]
