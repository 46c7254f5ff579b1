"""The blur of each camera's lens: of a few widths, that with which the body, drawn sharp, is most like its images.

A lens out of focus blurs, and so do coarse compression and reduced pictures. Of four synthetic throws those out of
focus (sd 2.5 px) were 3.3 mm off without this, and are 1.6; those compressed to a twentieth 2.3 and 1.5; as they were
0.67 and 0.62. Only of things: a person is drawn in a shape that differs from the real one, which looks like blur.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.model import LENS_BLURS_PX, Appearance, Region
from airborne.body import Pose
from airborne.tracking.image_regions import narrow_regions
from airborne.tracking.model_based.exposure import Extrapolation, still_images
from airborne.tracking.model_based.gauss_newton import weigh_image
from airborne.tracking.model_based.image_views import ImageView, make_image_views, with_lens_blur
from airborne.tracking.model_based.learned_regions import MARGIN_PX
from airborne.tracking.model_based.learning import learn_missing_backgrounds
from airborne.tracking.model_based.render_model import RenderModel

_USUAL_PX = 0.8  # of sharp images: what is tried first


def learn_blurs(
    render_model: RenderModel,
    pose: Pose,
    regions: Sequence[Region],
    appearance: Appearance,
    *,
    motion: Extrapolation | None = None,
) -> Appearance:
    """Learn how sharp the cameras are from regions that show a body, as if it had stood while they were exposed."""
    posed = render_model.with_pose(pose)
    known = learn_missing_backgrounds(render_model, posed, regions, appearance)
    for region in narrow_regions(regions, [posed], render_model.geometry, MARGIN_PX):
        if region.view.exposure_s and motion is None:
            continue
        (image,) = make_image_views(render_model, [region], known)
        if motion is not None and region.view.exposure_s:
            weigh_image(render_model, posed, image)  # fits its light
            (image,) = still_images(render_model, [image], pose, motion) or [image]
        start = LENS_BLURS_PX.index(appearance.blur_px(region) or _USUAL_PX)

        def cost(at: int, image: ImageView = image, region: Region = region) -> float:
            return weigh_image(render_model, posed, with_lens_blur(image, region, LENS_BLURS_PX[at]))

        appearance = appearance.learn_blur(region, _descend(cost, start, len(LENS_BLURS_PX)))
    return appearance


def _descend(cost: Callable[[int], float], start: int, n: int) -> NDArray[np.float64]:
    """Return the costs (n,) on the way from one down to where both neighbours cost more; infinite where not tried."""
    costs: NDArray[np.float64] = np.full(n, np.inf)
    best = start
    costs[best] = cost(best)
    for step in (1, -1):
        while 0 <= best + step < n and np.isinf(costs[best + step]):
            costs[best + step] = cost(best + step)
            if costs[best + step] > costs[best]:
                break
            best += step
    return costs
