"""Video: in come files, out come `Frames`, one image per camera at one time, and written videos.

Files are read once, in order of time, by frames or by the fields of interlaced video; cameras are aligned by their
exact time stamps, and lens distortion is taken out. It knows no body and no pose.
"""

from airborne.video.decoding import VideoFacts, VideoSource, inspect
from airborne.video.fields import fill_rows, weave
from airborne.video.frames import Frames, View
from airborne.video.live import LiveRecording, connected, live_recording
from airborne.video.outages import Outages
from airborne.video.recording import Recording, open_recording
from airborne.video.writing import VideoWriter

__all__ = [
    "Frames",
    "LiveRecording",
    "Outages",
    "Recording",
    "VideoFacts",
    "VideoSource",
    "VideoWriter",
    "View",
    "connected",
    "fill_rows",
    "inspect",
    "live_recording",
    "open_recording",
    "weave",
]
