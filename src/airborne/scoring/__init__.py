"""Scoring: in come pictures and masks as plain arrays, out come chances, light and the empty scene.

Knows no body, no camera and no search.
"""

from airborne.scoring.foreground import agreement, count_colours, posterior
from airborne.scoring.lighting import fit_light, light_planes, light_up, paint_evenly
from airborne.scoring.plate import Plate, fill, look

__all__ = [
    "Plate",
    "agreement",
    "count_colours",
    "fill",
    "fit_light",
    "light_planes",
    "light_up",
    "look",
    "paint_evenly",
    "posterior",
]
