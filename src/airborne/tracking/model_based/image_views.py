"""Images prepared for the comparison with a body: both are blurred, the body also as the camera's lens blurs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airborne.appearance.model import Appearance, Region
from airborne.tracking.model_based.blur import gaussian_taps
from airborne.tracking.model_based.kernel_arguments import Comparison
from airborne.tracking.model_based.render_model import RenderModel, ViewBuffers, image_buffers, shift_sds_px
from airborne.types import Array

_SIGMA_PX = 1.2  # of the comparison's blur, of a full frame
NOISE_PX = 4 * np.pi * _SIGMA_PX**2  # pixels of a full frame that share their noise
_CLIP = 0.1  # linear light, 0..1: a residual this large has a quarter of the weight
_CLIP_LIT = 0.5  # the same under known lights, where no shadow or highlight has to be left out


class ImageView(NamedTuple):
    """A view's image, prepared for the comparison with a body."""

    buffers: ViewBuffers
    comparison: Comparison  # of the image
    drawn: Comparison  # of the body: it is drawn sharp, and blurred by the lens too
    noise_px: float  # how many pixels share their noise
    shift_sds_px: Array  # (3,) of `shift_sds_px`
    exposure_s: float

    def with_own_light(self) -> ImageView:
        """Return the view with a light of its own, for a fit to change."""
        light = self.buffers.light
        own = light.copy() if isinstance(light, np.ndarray) else light
        return self._replace(buffers=self.buffers._replace(light=own))


def make_image_views(render_model: RenderModel, regions: Sequence[Region], appearance: Appearance) -> list[ImageView]:
    """Prepare the images of regions."""
    clip = _CLIP if render_model.lights is None else _CLIP_LIT
    views = []
    for region in regions:
        comparison = _comparison(region.aspect, clip)
        buffers = image_buffers(render_model, region, appearance).prepare(comparison)
        drawn = _comparison(region.aspect, clip, appearance.blur_px(region))
        noise_px = NOISE_PX * _sigmas_px(region.aspect)[1] / _SIGMA_PX
        views.append(ImageView(buffers, comparison, drawn, noise_px, shift_sds_px(region), region.view.exposure_s))
    return views


def with_lens_blur(image: ImageView, region: Region, blur_px: float) -> ImageView:
    """Return a region's view for a body drawn with another blur of the lens: its sd [px along a row]."""
    return image._replace(drawn=_comparison(region.aspect, image.comparison.clip, blur_px)).with_own_light()


def _comparison(aspect: float, clip: float, blur_px: float = 0.0) -> Comparison:
    along_row, along_column = np.hypot(_sigmas_px(aspect), (blur_px, blur_px * aspect))
    return Comparison(gaussian_taps(float(along_row)), gaussian_taps(float(along_column)), clip)


def _sigmas_px(aspect: float) -> tuple[float, float]:
    """Return the sds of the comparison's blur along rows and columns."""
    return _SIGMA_PX, max(_SIGMA_PX * aspect, 0.5)
