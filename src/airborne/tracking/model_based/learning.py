"""What images teach of the body's appearance, given its pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Appearance, Region
from airborne.body import Pose, PosedBody
from airborne.tracking.model_based.degrees_of_freedom import limbs_by_pair
from airborne.tracking.model_based.exposure import Exposure, Extrapolation, bodies_in_exposure
from airborne.tracking.model_based.render_model import RenderModel


def learn_appearance(
    render_model: RenderModel,
    pose: Pose,
    regions: Sequence[Region],
    appearance: Appearance,
    *,
    motion: Extrapolation,
    colours: bool = True,
    backgrounds: bool = True,
) -> Appearance:
    """Learn from regions that show a body: where it was all the time, and never.

    Colours and backgrounds are learned where asked for, and where there are none yet.
    """
    for region in regions:
        exposure = Exposure(region.view.exposure_s, region.packed_view, region.camera.K)
        bodies = bodies_in_exposure(render_model, pose, motion, exposure)
        masks = [_mask(render_model, body, region) for body in bodies]
        ever, always = np.logical_or.reduce(masks), np.logical_and.reduce(masks)
        if colours or not appearance.has_colours(region):
            appearance = appearance.learn_colours(region, ever, body=always)
            for pair, segments in limbs_by_pair(render_model.model).items():
                own = [_mask(render_model, body, region, segments) for body in bodies]
                appearance = appearance.learn_limb_colours(region, pair, np.logical_and.reduce(own))
        if backgrounds or not appearance.has_background(region):
            appearance = appearance.learn_background(region, ever)
    return appearance


def learn_missing_backgrounds(
    render_model: RenderModel, posed: PosedBody, regions: Sequence[Region], appearance: Appearance
) -> Appearance:
    """Give every region a background model: where none has been learned, its image outside the mask."""
    for region in regions:
        if not appearance.has_background(region):
            appearance = appearance.learn_background(region, _mask(render_model, posed, region), whole_view=False)
    return appearance


def _mask(
    render_model: RenderModel, posed: PosedBody, region: Region, segments: NDArray[np.integer] | None = None
) -> NDArray[np.bool_]:
    """Return where a region shows the body, or some of its segments: (h, w)."""
    part = render_model.draw_parts(posed, region)
    return part >= 0 if segments is None else render_model.shows_segments(part, segments)
