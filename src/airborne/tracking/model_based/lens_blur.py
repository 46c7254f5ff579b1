"""The blur of each camera's lens: of a few widths, that with which the body, drawn sharp, is most like its images.

A lens out of focus blurs, and so do coarse compression and reduced pictures. Of four synthetic throws those out of
focus (sd 2.5 px) were 3.3 mm off without this, and are 1.6; those compressed to a twentieth 2.3 and 1.5; as they were
0.67 and 0.62. Only of things: a person is drawn in a shape that differs from the real one, which looks like blur.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airborne.appearance.model import LENS_BLURS_PX, Appearance, Region
from airborne.body import Pose
from airborne.tracking.image_regions import narrow_regions
from airborne.tracking.model_based.exposure import Exposure, Extrapolation, bodies_in_exposure
from airborne.tracking.model_based.gauss_newton import weigh_image
from airborne.tracking.model_based.image_views import image_views, with_lens_blur
from airborne.tracking.model_based.learned_regions import MARGIN_PX
from airborne.tracking.model_based.learning import learn_missing_backgrounds
from airborne.tracking.model_based.render_model import RenderModel


def learn_blurs(
    render_model: RenderModel,
    pose: Pose,
    regions: Sequence[Region],
    appearance: Appearance,
    motion: Extrapolation | None = None,
) -> Appearance:
    """Learn how sharp the cameras' images are from regions that show a body, but not where its motion blurs them."""
    posed = render_model.with_pose(pose)
    known = learn_missing_backgrounds(render_model, posed, regions, appearance)
    for region in narrow_regions(regions, [posed], render_model.geometry, MARGIN_PX):
        exposure = Exposure(region.view.exposure_s, region.packed_view, region.camera.K)
        if motion is not None and len(bodies_in_exposure(render_model, pose, motion, exposure)) > 1:
            continue
        (image,) = image_views(render_model, [region], known)
        images = [with_lens_blur(image, region, blur_px) for blur_px in LENS_BLURS_PX]
        appearance = appearance.learn_blur(
            region, np.array([weigh_image(render_model, posed, each) for each in images])
        )
    return appearance
