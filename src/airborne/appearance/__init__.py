"""Appearance: in come pictures and masks, out come colours, light, and the scene without the body.

Knows no body and no search.
"""

from airborne.appearance.background import Plate, fill, look
from airborne.appearance.foreground import agreement, count_colours, posterior
from airborne.appearance.hue_saturation import bin_table, hsv_bins, look_up, root_shares
from airborne.appearance.lighting import fit_light, light_planes, light_up, paint_evenly

__all__ = [
    "Plate",
    "agreement",
    "bin_table",
    "count_colours",
    "fill",
    "fit_light",
    "hsv_bins",
    "light_planes",
    "light_up",
    "look",
    "look_up",
    "paint_evenly",
    "posterior",
    "root_shares",
]
