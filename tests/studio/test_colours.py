"""Colours that must be told apart are apart for all eyes, and text is legible on its ground."""

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import airborne
from airborne.export.palette import STATUS_RGB, hex_colour
from airborne.studio.outlines import _TEAM_COLOURS, BESIDE_COLOUR
from airborne.studio.pages import control_points, correct, layout
from airborne.studio.pages.points_panel import CAMERA_COLOURS, CHOSEN_COLOUR, PREDICTED_COLOUR
from airborne.studio.starts import POSE_COLOUR

LEAST_APART = 15.0  # CIE 1976 colour difference; 2.3 is just noticeable side by side (Mahy et al. 1994)
LEAST_CONTRAST = 4.5  # of text, WCAG 2.1 AA
SEEN = {  # linear RGB as the colour-blind see it: Machado, Oliveira & Fernandes 2009, severity 1.0
    "all colours": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
XYZ_FROM_RGB = np.array(  # sRGB, IEC 61966-2-1
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
SOURCES = Path(airborne.__file__).parent
SHEET = dict(re.findall(r"--(\w+): (#\w{6})", (SOURCES / "studio/studio.css").read_text()))
CURVES_JS = (SOURCES / "export/templates/curves.js").read_text()
CURVES = re.findall(r"#\w{6}", re.search(r"COLOURS = \[(.*?)\]", CURVES_JS)[1])
STRIPS = dict(re.findall(r'(\w+): "(#\w{6})"', re.search(r"STATUS = \{(.*?)\}", CURVES_JS)[1]))
TOGETHER = {
    "text and signs": [SHEET[name] for name in ("ink", "soft", "green", "amber", "red")],
    "curves": CURVES,
    "strips": [*STRIPS.values(), SHEET["paper"]],
    "outlines": [*map(hex_colour, STATUS_RGB.values()), BESIDE_COLOUR, POSE_COLOUR, correct._JOINT_COLOUR],
    "clicks": [*CAMERA_COLOURS, CHOSEN_COLOUR],
    "clicks of points": [control_points._CLICKED, PREDICTED_COLOUR, CHOSEN_COLOUR],
    "clicks of a person": [PREDICTED_COLOUR, CHOSEN_COLOUR],
    "players": [*_TEAM_COLOURS[0], *_TEAM_COLOURS[1], CHOSEN_COLOUR],
}


def linear(colour):
    """Return a colour's linear RGB, 0 to 1."""
    rgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """Return linear RGB in CIE 1976 L*a*b*, in the light of sRGB's white."""
    share = XYZ_FROM_RGB @ np.clip(rgb, 0, 1) / XYZ_FROM_RGB.sum(axis=1)
    x, y, z = np.where(share > 216 / 24389, np.cbrt(share), (24389 / 27 * share + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def apart(one, other, eyes):
    """Return how far two colours are apart for some eyes."""
    a, b = (lab(np.asarray(SEEN[eyes]) @ linear(each)) for each in (one, other))
    return float(np.linalg.norm(a - b))


def contrast(one, other):
    """Return the contrast of two colours, as WCAG 2.1 defines it."""
    low, high = sorted(float(XYZ_FROM_RGB[1] @ linear(each)) for each in (one, other))
    return (high + 0.05) / (low + 0.05)


def test_the_differences_are_those_of_known_colours():
    assert apart("#000000", "#ffffff", "all colours") == pytest.approx(100, abs=0.01)
    grey = [apart("#808080", "#ffffff", eyes) for eyes in SEEN]
    assert grey == pytest.approx([grey[0]] * len(SEEN), abs=0.1)
    assert apart("#945400", "#b04a00", "protanopia") < 1  # brown and rust
    assert contrast("#000000", "#ffffff") == pytest.approx(21)


@pytest.mark.parametrize("eyes", SEEN)
@pytest.mark.parametrize("group", TOGETHER)
def test_colours_that_stand_together_are_apart(group, eyes):
    close = {
        (one, other): round(far, 1)
        for one, other in combinations(TOGETHER[group], 2)
        if (far := apart(one, other, eyes)) < LEAST_APART
    }
    assert close == {}


def test_text_is_legible_on_all_its_grounds():
    texts = [SHEET[name] for name in ("ink", "soft", "blue", "green", "amber", "red")]
    grounds = [SHEET["paper"], SHEET["ground"]]
    assert [(a, b) for a in texts for b in grounds if contrast(a, b) < LEAST_CONTRAST] == []
    assert contrast(layout._GREEN, "#ffffff") > LEAST_CONTRAST < contrast(layout._BLUE, "#ffffff")


def test_a_status_and_a_button_have_one_colour_everywhere():
    assert {status.value: hex_colour(rgb) for status, rgb in STATUS_RGB.items()}.items() <= STRIPS.items()
    assert (SHEET["blue"], SHEET["green"]) == (layout._BLUE, layout._GREEN)
