"""How far the images go on beyond a person's hands and feet: a body that is too small folds its limbs up.

Tracking does not tell it. What a body that is too small leaves uncovered is like nothing that was learned of the body,
so it is taken for scene, and the limbs bend until the body lies within what it knows. Compared with the empty scene,
whatever its colours, it stands out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel
from airborne.tracking.model_based.degrees_of_freedom import limb_of_segment, limbs_of
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.self_check.path import alarm
from airborne.tracking.self_check.registration import Silhouette, sample_box
from airborne.types import Array, Array32, Image

_STANDS_OUT = 0.5  # chosen: of what `foreground` gives, from 0 to 1
_DARKEST, _SAME = 0.3, 0.12  # chosen: to what share a shadow darkens an sRGB level, at least; how alike all channels
# chosen: of three synthetic people with joints that were set the images went on 27 mm at most, with statures 8 % too
# small 73 mm, and no joint that was called tracked was over 0.12 m off; of three recorded people 51 mm, and 0.15 m of
# one whose stature was 8 % too small, without a start, and whose ankles were 0.13 m off
_LEAST_M = 0.10
_FEWEST_MOMENTS = 3  # chosen: of which a view's median is taken


def reach_beyond(render_model: RenderModel, silhouette: Silhouette, rgb: Image, scene: Image, shown: Array32) -> Array:
    """Return how far what stands out, connected with the silhouette, reaches beyond each segment: (segments,) [m].

    rgb, scene, shown: as `foreground` takes them, and what it gives. NaN for segments that are not seen. Shadows do not
    count.
    """
    reach = np.full(len(render_model.model.segments), np.nan)
    covered = silhouette.side >= 0
    stands_out = (shown > _STANDS_OUT) & ~_in_shadow(silhouette, rgb, scene)
    _, label = cv2.connectedComponents((stands_out | covered).astype(np.uint8), connectivity=8)
    beyond = stands_out & ~covered & np.isin(label, np.unique(label[covered]))
    segment = render_model.segment_of_part[silhouette.part]  # where it is covered
    is_free = (~covered).astype(np.uint8)
    distance_px, labels = cv2.distanceTransformWithLabels(is_free, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    nearest = np.asarray(labels, np.int64)
    owner = np.zeros(int(nearest.max()) + 1, np.int64)
    owner[nearest[covered]] = segment[covered]
    reach[np.unique(segment[covered])] = 0
    np.maximum.at(reach, owner[nearest[beyond]], distance_px[beyond])
    focal_px = np.sqrt(silhouette.camera.K[0, 0] * silhouette.camera.K[1, 1])
    return reach / (focal_px * float(np.median(silhouette.inverse_depth[covered])))


def _in_shadow(silhouette: Silhouette, rgb: Image, scene: Image) -> NDArray[np.bool_]:
    """Tell which pixels (h, w) of the silhouette's image are the scene in a shadow."""
    x0, y0, x1, y1 = silhouette.box
    share = (rgb[y0:y1, x0:x1].astype(np.float32) + 1) / (scene.astype(np.float32) + 1)
    brightest, darkest = share.max(axis=2), share.min(axis=2)
    is_shadow = (brightest < 1) & (darkest > _DARKEST) & (brightest - darkest < _SAME)
    return sample_box(silhouette, is_shadow.astype(np.float32)) > 0.5


@dataclass(frozen=True, slots=True)
class FarReach:
    """Ends of a person beyond which the images go on."""

    segments: tuple[str, ...]
    value: float  # [m] of that with the most, as far as two views show
    sd: float  # of the views'
    n_views: int
    n_cameras: int

    @property
    def sentence(self) -> str:
        """Say it."""
        return (
            f"the images go on {100 * self.value:.0f} ± {100 * self.sd:.0f} cm beyond the body's "
            f"{' and '.join(self.segments)}, in {self.n_views} of {self.n_cameras} cameras: it is too small there, or "
            "something is held; check stature_m or the body's file, or fit the body with `airborne fit-body`"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return what `self_check` in summary.json holds: an alarm."""
        return alarm(" ".join(self.segments), "reach_m", value=self.value, sd=self.sd, sentence=self.sentence)


def find_far_reach(model: BodyModel, reach: Array) -> FarReach | None:
    """Find hands and feet beyond which the images go on at most moments, given `reach_beyond` (n, c, segments).

    Two cameras must show it, where there are two. Of the head nothing is said: hair may hang down.
    """
    n_cameras, ends = reach.shape[1], [int(limb[-1]) for limb in limbs_of(model)]
    if not ends:
        return None
    by_view = np.array([[_usual(reach[:, view, end]) for view in range(n_cameras)] for end in ends])
    second = np.sort(np.nan_to_num(by_view), axis=1)[:, -min(2, n_cameras)]
    most = int(np.argmax(second))
    if second[most] <= _LEAST_M:
        return None
    seen = by_view[most][np.isfinite(by_view[most])]
    names = tuple(model.segments[end].name for end, far in zip(ends, second, strict=True) if far > _LEAST_M)
    return FarReach(names, float(second[most]), float(np.std(seen)), int(np.sum(seen > _LEAST_M)), n_cameras)


def _usual(values: Array) -> float:
    """Return the median of the moments (n,); NaN where few show the segment."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) >= _FEWEST_MOMENTS else float("nan")


def doubtful_joints(model: BodyModel, far: FarReach) -> NDArray[np.bool_]:
    """Return the joints that lie elsewhere if the body is too small at those ends: of their limbs, but the first."""
    limb, ends = limb_of_segment(model), [model.index_of(name) for name in far.segments]
    return (np.isin(limb, limb[ends]) & (limb != np.arange(len(limb))))[1:]
