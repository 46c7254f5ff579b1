"""A score does not depend on how many threads share the work."""

import numpy as np
import pytest

from airborne.body import geometry
from airborne.rendering import RULES, score, targets
from tests.support.scenes import CROSS, LIGHTS, Scene


@pytest.mark.parametrize("rule", RULES)
def test_score_is_the_same_to_the_last_bit(rule):
    scene = Scene()
    frames = scene.frames(0)
    evidence = [np.where(view.rgb[..., 2] < 80, 1.0, -1.0).astype(np.float32) for view in frames.views]
    seen = targets(frames.views, LIGHTS, evidence=evidence)
    rng = np.random.default_rng(0)
    motions = rng.normal(size=(37, 6)) * [0.05, 0.05, 0.05, 0.1, 0.1, 0.1]
    bodies = [CROSS.with_pose(scene.start()).moved(motion) for motion in motions]
    R, t = np.stack([body.R for body in bodies]), np.stack([body.t for body in bodies])
    alone = score(geometry(CROSS), seen, R, t, RULES[rule], threads=1)
    assert len(np.unique(alone)) > 30
    for threads in (2, 4):
        np.testing.assert_array_equal(score(geometry(CROSS), seen, R, t, RULES[rule], threads=threads), alone)
