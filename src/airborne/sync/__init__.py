"""Which time each camera's pictures were taken at: from a flash, from sound, from what moves. Knows no body.

In come the cameras' files as they are, out come `Offsets`: what to add to each camera's times. The first camera's times
are right by definition.
"""

from airborne.sync.audio import offsets_by_sound
from airborne.sync.flash import offsets_by_flash
from airborne.sync.offsets import Offsets, counting
from airborne.sync.silhouettes import offsets_by_motion

__all__ = ["Offsets", "counting", "offsets_by_flash", "offsets_by_motion", "offsets_by_sound"]
