"""Known lights find a body better than fitted ones in images rendered in exactly that light."""

from dataclasses import dataclass

import numpy as np
import pytest

from airborne.body import surface_arrays
from airborne.rendering import render
from tests.support.people import CAMERAS, HUMAN, REACH, mean_errors_mm, swinging, tracker, wrong
from tests.support.scenes import CROSS, LIGHTS, Scene, srgb_from_light, statuses, thrown, track, worst


@dataclass(frozen=True)
class Exact(Scene):
    """Rendered as the tracker renders: one colour for each pixel's centre, shaded in sRGB."""

    def _picture(self, index, i, seen_by, pose):
        drawn = render(surface_arrays(self.model), self.model.with_pose(pose), seen_by, LIGHTS)
        picture = np.where(drawn.mask[..., None], drawn.colour, srgb_from_light(self.backgrounds[i]))
        noise = self.noise_grey * np.random.default_rng([index, i]).standard_normal(picture.shape)
        return np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)


KNOWN = {"lights": LIGHTS, "is_light_exact": True}
PERSON = Exact(HUMAN, swinging, CAMERAS[:3], reach=REACH)
THROWN = Exact(CROSS, thrown)


@pytest.mark.parametrize("seed", [0, 1])
def test_person_in_known_light_is_found_better_than_in_unknown(seed):
    start = wrong(PERSON.start(), seed=seed)
    known, fitted = (track(PERSON, range(3), tracker(PERSON, start, **each)) for each in (KNOWN, {}))
    assert statuses(known) == ["tracked"] * 3
    assert mean_errors_mm(PERSON, known).mean() < 0.75 * mean_errors_mm(PERSON, fitted).mean()


def test_thrown_cross_in_known_light_is_where_it_is_in_unknown():
    known, fitted = (
        track(THROWN, range(4), tracker(THROWN, THROWN.start(), model=CROSS, **each)) for each in (KNOWN, {})
    )
    assert statuses(known) == ["tracked"] * 4
    (known_mm, known_deg), (fitted_mm, _) = worst(THROWN, known), worst(THROWN, fitted)
    assert known_mm < 1.05 * fitted_mm
    assert known_deg < 0.8


@pytest.mark.parametrize("scene", [PERSON, THROWN], ids=["person", "cross"])
def test_lights_that_are_not_exact_are_fitted_as_if_unknown(scene):
    known, unknown = (track(scene, range(1), tracker(scene, scene.start(), lights=each)) for each in (LIGHTS, None))
    np.testing.assert_array_equal(known[0].covariance, unknown[0].covariance)
