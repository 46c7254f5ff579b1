"""What each camera alone says of a tracked body: normal equations of the root's pose, and of blended frames."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from airborne.body import Pose
from airborne.sync.mixed_frames import blend_equations
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.degrees_of_freedom import root_only
from airborne.tracking.model_based.gauss_newton import linearise_images
from airborne.tracking.model_based.later_frames import MARGIN_PX
from airborne.tracking.model_based.learning import learn_missing_backgrounds
from airborne.tracking.model_based.refined import RefinedState, RefinedTracker
from airborne.types import Array
from airborne.video import Frames, View


def root_equations(
    tracker: RefinedTracker, state: RefinedState, frames: Frames, pose: Pose
) -> dict[str, tuple[Array, Array]]:
    """Return the root's normal equations by each camera alone: camera -> curvature (6, 6), gradient (6,) [nat].

    The delta x (6,) of `airborne.body.chain` changes the log-likelihood by `gradient x - x curvature x / 2`.
    """
    render_model, root = tracker.render_model, root_only(tracker.render_model.model)
    posed = render_model.with_pose(pose)
    regions = crop_regions([posed], render_model.geometry, tracker.reduce_frames(frames), MARGIN_PX)
    regions = [region for region in regions if state.appearance.has_colours(region)]
    appearance = learn_missing_backgrounds(render_model, posed, regions, state.appearance)
    equations = {}
    for region in regions:
        each = linearise_images(render_model, pose, [region], appearance, dofs=root)
        equations[region.camera.name] = each.A / each.noise, each.g / each.noise
    return equations


def share_equations(
    tracker: RefinedTracker, state: RefinedState, view: View, poses: Sequence[Pose]
) -> tuple[Array, Array] | None:
    """Return the normal equations (m, m), (m,) for a view's shares of the body in m poses; None: not in view."""
    frames = tracker.reduce_frames(Frames(0, Fraction(0), (view,)))
    bodies = [tracker.render_model.with_pose(pose) for pose in poses]
    regions = crop_regions(bodies, tracker.render_model.geometry, frames, MARGIN_PX)
    return blend_equations(tracker.render_model, state.appearance, regions[0], bodies) if regions else None
