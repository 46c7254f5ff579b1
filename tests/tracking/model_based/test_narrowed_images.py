"""Images are compared in the part that holds the body: what lies beyond the blur's reach changes nothing."""

import numpy as np

from airborne.tracking.image_regions import crop_regions, narrow_regions
from airborne.tracking.model_based.blur import RADIUS_PX
from airborne.tracking.model_based.degrees_of_freedom import root_only
from airborne.tracking.model_based.gauss_newton import linearise_images
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.tracker import step
from tests.support.scenes import Scene

SAME = 5e-3  # of the largest number: the light is fitted in steps, along axes that belong to the region


def test_equations_of_narrowed_regions_are_those_of_the_whole():
    scene = Scene()
    tracker = RefinedTracker(scene.model, scene.start())
    state, _ = step(tracker, tracker.init(), scene.frames(0))
    model, dofs = tracker.render_model, root_only(scene.model)
    pose = scene.start(1).move(np.array([0.004, -0.003, 0.002]), np.array([0.02, 0.01, -0.02]))
    body = [model.with_pose(pose)]
    wide = crop_regions(body, model.geometry, scene.frames(1), 40)
    narrow = narrow_regions(wide, body, model.geometry, RADIUS_PX + 4)
    assert all(3 * less.rgb.size < 2 * more.rgb.size for less, more in zip(narrow, wide, strict=True))
    whole, part = (linearise_images(model, pose, regions, state.appearance, dofs=dofs) for regions in (wide, narrow))
    for expected, found in ((whole.A, part.A), (whole.g, part.g), (whole.noise, part.noise)):
        np.testing.assert_allclose(found, expected, rtol=0, atol=SAME * np.abs(expected).max())
