"""Video files in, `Frames` out (one image per camera at one time), and videos written.

Files are decoded once, in order of time, by frames or by the fields of interlaced video; cameras are aligned by their
exact time stamps, and images are undistorted. Nothing here depends on a body or a pose.
"""

from airborne.video.decoding import VideoFacts, VideoSource, inspect
from airborne.video.fields import fill_rows, weave
from airborne.video.frames import Frames, View
from airborne.video.live import LiveRecording, connect, live_recording
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
    "connect",
    "fill_rows",
    "inspect",
    "live_recording",
    "open_recording",
    "weave",
]
