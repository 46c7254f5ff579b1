"""A score does not depend on how many threads share the work."""

import numpy as np
import pytest

from airborne.body import surface_arrays
from airborne.rendering import RULES, pack_targets, score
from tests.support.scenes import CROSS, LIGHTS, Scene


@pytest.mark.parametrize("rule", RULES)
def test_score_is_the_same_to_the_last_bit(rule):
    scene = Scene()
    frames = scene.frames(0)
    evidence = [np.where(view.rgb[..., 2] < 80, 1.0, -1.0).astype(np.float32) for view in frames.views]
    packed = pack_targets(frames.views, LIGHTS, evidence=evidence)
    rng = np.random.default_rng(0)
    deltas = rng.normal(size=(37, 6)) * [0.05, 0.05, 0.05, 0.1, 0.1, 0.1]
    bodies = [CROSS.with_pose(scene.start()).move(delta) for delta in deltas]
    R, t = np.stack([body.R for body in bodies]), np.stack([body.t for body in bodies])
    alone = score(surface_arrays(CROSS), packed, R, t, rule=RULES[rule], threads=1)
    assert len(np.unique(alone)) > 30
    for threads in (2, 4):
        np.testing.assert_array_equal(
            score(surface_arrays(CROSS), packed, R, t, rule=RULES[rule], threads=threads), alone
        )
