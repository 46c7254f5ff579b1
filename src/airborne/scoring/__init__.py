"""Scoring: in come pictures and masks as plain arrays, out come chances, light and the empty scene.

Knows no body, no camera and no search.
"""

from airborne.scoring.foreground import agreement, count_colours, posterior
from airborne.scoring.hsv import bin_table, hsv_bins, look_up, root_shares
from airborne.scoring.lighting import fit_light, light_planes, light_up, paint_evenly
from airborne.scoring.over_views import detection, over_views, recognition, unless_hidden
from airborne.scoring.plate import Plate, fill, look
from airborne.scoring.recognition import code_table, colour_counts
from airborne.scoring.rods import count_rods, read_rods, rod_corners

__all__ = [
    "Plate",
    "agreement",
    "bin_table",
    "code_table",
    "colour_counts",
    "count_colours",
    "count_rods",
    "detection",
    "fill",
    "fit_light",
    "hsv_bins",
    "light_planes",
    "light_up",
    "look",
    "look_up",
    "over_views",
    "paint_evenly",
    "posterior",
    "read_rods",
    "recognition",
    "rod_corners",
    "root_shares",
    "unless_hidden",
]
