"""Pictures kept as they were decoded, of which only the parts that somebody looks at are converted."""

from __future__ import annotations

from dataclasses import dataclass, field

import av

from airborne.video.crops import Colours, colours_of, rgb_from_part
from airborne.video.decoding import Picture, VideoFacts, rgb_from_picture
from airborne.video.frames import Box, Image, View
from airborne.video.undistortion import Lens

Kind = tuple[str, int, int]


@dataclass(slots=True, eq=False)
class KeptPicture:
    """One picture of one camera; it implements `airborne.video.frames.Pixels`."""

    _picture: Picture
    _facts: VideoFacts
    _lens: Lens
    _known: KnownColours
    _whole: Image | None = None

    def whole(self) -> Image:
        """Return the picture, straightened: (h, w, 3) sRGB. It is converted once."""
        if self._whole is None:
            self._whole = self._lens.straight(rgb_from_picture(self._picture, self._facts))
        return self._whole

    def crop(self, box: Box) -> Image:
        """Return the part in a box, straightened; of fields, turned pictures and rare formats by way of the whole."""
        is_upright = self._picture.parity is None and not self._facts.rotation_deg
        colours = self._known.of(self._picture.frame) if self._whole is None and is_upright else None
        if colours is None:
            x0, y0, x1, y1 = box
            return self.whole()[y0:y1, x0:x1]
        return self._lens.straight_part(box, lambda part: rgb_from_part(self._picture.frame, colours, part))


@dataclass(frozen=True, slots=True, eq=False)
class KnownColours:
    """How the frames of one camera turn into sRGB, found out once for each kind of frame."""

    short_side: int  # of the recording [px]
    _by_kind: dict[Kind, Colours | None] = field(default_factory=dict)

    def of(self, frame: av.VideoFrame) -> Colours | None:
        """Return the colours of frames like this one; None where they are converted whole."""
        kind = (frame.format.name, int(frame.colorspace), int(frame.color_range))
        if kind not in self._by_kind:
            self._by_kind[kind] = colours_of(frame, short_side=self.short_side)
        return self._by_kind[kind]


def kept_view(picture: Picture, facts: VideoFacts, lens: Lens, known: KnownColours) -> View:
    """Return the view of a picture, which is not converted yet."""
    return View(lens.camera, KeptPicture(picture, facts, lens, known))
