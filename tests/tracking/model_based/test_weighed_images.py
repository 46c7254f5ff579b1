"""Poses are weighed against each other without equations, as by these."""

import numpy as np

from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.degrees_of_freedom import root_only
from airborne.tracking.model_based.gauss_newton import image_evaluator, weigh_images
from airborne.tracking.model_based.image_views import make_image_views
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.tracker import step
from tests.support.scenes import Scene

SAME = 1e-6  # sums in another order


def test_costs_are_those_of_the_equations():
    scene = Scene()
    tracker = RefinedTracker(scene.model, scene.start())
    state, _ = step(tracker, tracker.init(), scene.frames(0))
    model = tracker.render_model
    poses = [scene.start(1).move(np.array([0.004 * k, -0.003, 0.002]), np.array([0.02, 0.01 * k, 0])) for k in (0, 4)]
    regions = crop_regions([model.with_pose(pose) for pose in poses], model.geometry, scene.frames(1), 32)
    costs, of_equations = (
        weigh(model, poses, make_image_views(model, regions, state.appearance))
        for weigh in (weigh_images, by_equations)
    )
    np.testing.assert_allclose(costs, of_equations, rtol=SAME)
    assert costs[0] < costs[1]


def by_equations(model, poses, views):
    evaluate, _ = image_evaluator(model, poses, views, dofs=root_only(model.model))
    equations = [evaluate(pose, True) for pose in poses]
    noise = min(each.noise for each in equations)
    return np.array([each.objective(noise, 0.0) for each in equations])
