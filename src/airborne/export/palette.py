"""The colours of all figures of a run, safe for colour-blind readers (Okabe and Ito's set)."""

from __future__ import annotations

from airborne.tracking import Status

# by the names of Okabe and Ito (2008)
BLUE, GREEN, ORANGE, SKY_BLUE, PURPLE, VERMILION, YELLOW = (
    "#0072b2",
    "#009e73",
    "#e69f00",
    "#56b4e9",
    "#cc79a7",
    "#d55e00",
    "#f0e442",
)
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY_BLUE)  # of lines that are told apart by colour, in order
STATUS_RGB = {Status.TRACKED: (0, 158, 115), Status.UNCERTAIN: (230, 159, 0), Status.LOST: (213, 94, 0)}
UNKNOWN_RGB = (93, 102, 111)  # of a joint that no image shows
ESTIMATE_RGB = (0, 114, 178)  # the blue of Okabe and Ito, which the colour-blind tell apart
REFERENCE_RGB = (30, 30, 30)  # nearly black
SIDE_RGB = {"left": (230, 159, 0), "right": (86, 180, 233)}  # of a person's limbs
TEXT_RGB = (51, 51, 51)  # softer than black


def hex_colour(rgb: tuple[int, int, int]) -> str:
    """Write a colour as `#rrggbb`."""
    return "#{:02x}{:02x}{:02x}".format(*rgb)
