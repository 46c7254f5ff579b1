"""Appearance: in come images and masks, out come colours, light and background models.

Knows no body and no search.
"""

from airborne.appearance.background import BackgroundModel, BackgroundPixels, inpaint, update_background
from airborne.appearance.foreground import count_colours, posterior, posterior_sums
from airborne.appearance.hue_saturation import bin_table, hsv_bins, look_up, root_histograms
from airborne.appearance.lighting import fit_light, flatten_shading, light_planes, shade_body

__all__ = [
    "BackgroundModel",
    "BackgroundPixels",
    "bin_table",
    "count_colours",
    "fit_light",
    "flatten_shading",
    "hsv_bins",
    "inpaint",
    "light_planes",
    "look_up",
    "posterior",
    "posterior_sums",
    "root_histograms",
    "shade_body",
    "update_background",
]
