"""Synchronisation: at what time each camera took its images, from a flash, from sound, from motion or from tracking.

The cameras' files go in, `Offsets` come out: what to add to each camera's times. The first camera is the clock.
Flash, sound and motion need no body model.
"""

from airborne.sync.audio import offsets_by_sound
from airborne.sync.flash import offsets_by_flash
from airborne.sync.offsets import Offsets, image_counter
from airborne.sync.silhouettes import offsets_by_motion

__all__ = ["Offsets", "image_counter", "offsets_by_flash", "offsets_by_motion", "offsets_by_sound"]
