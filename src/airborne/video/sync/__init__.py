"""Which time each camera's pictures were taken at: from a flash, from sound, from what moves. Knows no body.

In come the cameras' files as they are, out come `Offsets`: what to add to each camera's times. The first camera's times
are right by definition.
"""

from airborne.video.sync.flash import offsets_by_flash
from airborne.video.sync.movers import offsets_by_motion
from airborne.video.sync.offsets import Offsets, counting
from airborne.video.sync.sound import offsets_by_sound

__all__ = ["Offsets", "counting", "offsets_by_flash", "offsets_by_motion", "offsets_by_sound"]
