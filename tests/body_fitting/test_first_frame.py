"""A preset becomes the person of the first frame: nearer to their girths, in their clothes."""

from fractions import Fraction

import numpy as np
import pytest

from airborne.body import SAMPLED, human18
from airborne.body_fitting.first_frame import fit_preset
from airborne.tracking.image_regions import reduce_frames
from tests.body_fitting.test_fit import GIRTHS, MASS_KG, STATURE_M, axes, moving, person
from tests.support.scenes import CAMERAS, Scene

GIVEN, POSE = human18(STATURE_M, MASS_KG, outfit=SAMPLED), moving(Fraction(0))


@pytest.fixture(scope="module")
def frames():
    return Scene(model=person(), motion=moving, cameras=CAMERAS[:3], reach=0.3).frames(0)


def test_girths_come_nearer_and_the_mass_stays(frames):
    fitted = fit_preset(GIVEN, POSE, frames, mass_kg=MASS_KG)
    assert fitted is not None
    model, _ = fitted
    segments = [name if name in ("torso", "chest") else f"{name}_left" for name in GIRTHS]
    off, off_before = (
        np.abs(np.log([axes(each, name)[:2] / axes(person(), name)[:2] for name in segments])).mean()
        for each in (model, GIVEN)
    )
    assert off < 0.6 * off_before
    assert not model.needs_colours
    assert sum(segment.inertia.mass_kg for segment in model.segments) == pytest.approx(MASS_KG)


def test_body_too_small_to_show_its_parts_is_not_fitted(frames):
    small = reduce_frames(frames, GIVEN.with_pose(POSE), 20.0)
    assert fit_preset(GIVEN, POSE, small, mass_kg=MASS_KG) is None
