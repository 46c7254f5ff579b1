"""What the images of one time say about a pose by themselves: no pose is predicted from other times.

A fit of a whole run joins such evidence of all its frames with its own model of the motion; a prediction would count
the same images again and again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Appearance
from airborne.body import BodyModel, Pose
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.degrees_of_freedom import PosePrior, all_joints, linearise_prior
from airborne.tracking.model_based.gauss_newton import image_evaluator
from airborne.tracking.model_based.image_views import make_image_views
from airborne.tracking.model_based.later_frames import MARGIN_PX
from airborne.tracking.model_based.learning import learn_missing_backgrounds
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.shape_error import shape_gradients
from airborne.tracking.model_based.texture import patch_colours
from airborne.types import Array, Array32
from airborne.video import Frames


@dataclass(frozen=True, slots=True, eq=False)
class ImageEvidence:
    """Minus the log-posterior of a pose moved by a delta x (d,): cost - gradient x + x information x / 2 [nat].

    It is that of the images and of what is possible for a body: its joints' ranges, its segments beside one another.
    """

    information: Array  # (d, d)
    gradient: Array  # (d,)
    cost: float  # [nat]
    misfit: float  # variance of the images' residual, by which they are weighed
    of_shape: Array  # (k, d) changes of the gradient by errors of the surface of an sd each, the same at all times
    colours: Sequence[Array32] = ()  # (patches, 3) of a surface of patches, an image each; see `texture`


def linearise_evidence(
    render_model: RenderModel,
    pose: Pose,
    frames: Frames,
    appearance: Appearance,
    *,
    model: BodyModel,
    misfit: float | None = None,
    shown: NDArray[np.bool_] | None = None,
) -> ImageEvidence:
    """Linearise the images about a pose; misfit: None where they are weighed by that which they show there.

    Of a body cut into patches, their colours on the segments that are `shown` (segments,) are returned too.
    Costs of several poses can be compared if their misfit is the same. What is possible for the body is that of the
    model, which differs from the one that is drawn in its surface at most.
    """
    posed, dofs = render_model.with_pose(pose), all_joints(model)
    regions = crop_regions([posed], render_model.geometry, frames, MARGIN_PX, appearance)
    regions = [region for region in regions if appearance.has_colours(region)]
    appearance = learn_missing_backgrounds(render_model, posed, regions, appearance)
    views = make_image_views(render_model, regions, appearance)
    images = image_evaluator(render_model, [pose], views, dofs=dofs)[0](pose, True)
    possible = linearise_prior(dofs, pose, PosePrior(pose, np.full(len(dofs.columns), np.inf)))
    misfit = max(images.misfit, 1e-9) if misfit is None else misfit
    of_shape = shape_gradients(images, posed) / misfit
    cost = images.objective(misfit, possible.cost)
    colours = () if shown is None else [patch_colours(render_model, view, shown) for view in views]
    return ImageEvidence(
        images.A / misfit + possible.H, images.g / misfit + possible.g, cost, misfit, of_shape, colours
    )
