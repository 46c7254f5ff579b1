"""What images teach of the body's appearance, given its pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import Appearance, Region
from airborne.body import Pose, PosedBody
from airborne.tracking.model_based.degrees_of_freedom import pair_of_segment
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
            if render_model.model.has_joints:
                appearance = _learn_limbs(render_model, bodies, region, appearance)
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


def _learn_limbs(
    render_model: RenderModel, bodies: Sequence[PosedBody], region: Region, appearance: Appearance
) -> Appearance:
    """Learn the colours of pairs of limbs where they were all the time."""
    pair_of_part = np.append(pair_of_segment(render_model.model)[render_model.segment_of_part], -1)
    part, *others = [render_model.draw_parts(body, region) for body in bodies]
    for other in others:
        part = np.where(pair_of_part[part] == pair_of_part[other], part, -1)
    return appearance.learn_limb_colours(region, part, pair_of_part)


def _mask(render_model: RenderModel, posed: PosedBody, region: Region) -> NDArray[np.bool_]:
    return render_model.draw_parts(posed, region) >= 0
