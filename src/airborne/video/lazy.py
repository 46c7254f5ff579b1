"""Lazy images: stored as decoded, converted to sRGB only in the parts that are read."""

from __future__ import annotations

from dataclasses import dataclass, field

import av
import numpy as np

from airborne.types import Image
from airborne.video.crops import ColourConversion, conversion_of, rgb_from_part
from airborne.video.decoding import DecodedImage, VideoFacts, rgb_from_decoded
from airborne.video.frames import PixelBox, View
from airborne.video.undistortion import Undistortion

_FrameFormat = tuple[str, int, int]


@dataclass(slots=True, eq=False)
class _UnconvertedImage:
    """One image of one camera; it implements `airborne.video.frames.LazyImage`."""

    _image: DecodedImage | Image  # as decoded, or once it was converted whole, that
    _facts: VideoFacts
    _undistortion: Undistortion
    _conversions: ConversionCache

    @property
    def n_held_bytes(self) -> int:
        """How many bytes the planes of the decoded image take, or the converted one."""
        if isinstance(self._image, np.ndarray):
            return self._image.nbytes
        return sum(plane.buffer_size for plane in self._image.frame.planes)

    def whole(self) -> Image:
        """Return the undistorted image (h, w, 3) sRGB; converted once, the decoded one is then let go."""
        image = self._image
        if not isinstance(image, np.ndarray):
            image = self._image = self._undistortion.undistort(rgb_from_decoded(image, self._facts))
        return image

    def crop(self, box: PixelBox) -> Image:
        """Return the undistorted part in a box; fields, rotated images and rare formats go by way of the whole."""
        image = self._image
        if isinstance(image, np.ndarray) or image.parity is not None or self._facts.rotation_deg:
            return self._crop_whole(box)
        conversion = self._conversions.of(image.frame)
        if conversion is None:
            return self._crop_whole(box)
        return self._undistortion.undistort_part(box, lambda part: rgb_from_part(image.frame, conversion, part))

    def _crop_whole(self, box: PixelBox) -> Image:
        x0, y0, x1, y1 = box
        return self.whole()[y0:y1, x0:x1]


@dataclass(frozen=True, slots=True, eq=False)
class ConversionCache:
    """The conversions of one camera's frames to sRGB, found once per frame format."""

    short_side: int  # of the recording [px]
    _by_format: dict[_FrameFormat, ColourConversion | None] = field(default_factory=dict)

    def of(self, frame: av.VideoFrame) -> ColourConversion | None:
        """Return the conversion of frames of this format; None where they are converted whole."""
        key = (frame.format.name, int(frame.colorspace), int(frame.color_range))
        if key not in self._by_format:
            self._by_format[key] = conversion_of(frame, short_side=self.short_side)
        return self._by_format[key]


def lazy_view(image: DecodedImage, facts: VideoFacts, undistortion: Undistortion, conversions: ConversionCache) -> View:
    """Return the view of an image that is not converted yet."""
    return View(undistortion.camera, _UnconvertedImage(image, facts, undistortion, conversions))
