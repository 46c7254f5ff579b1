"""Which camera disagrees: how far the edges in its pictures of a few frames lie from the outline of the body there.

The whole outline is shifted over the pictures, and the shift at which it lies on the strongest edges is taken: clutter
beside the body has edges too, but none of its shape. The standard deviation is the jackknife's, over stretches of the
outline. A camera that was moved, or whose clock is off, stands out among the others; what all show alike is the body's
own error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from airborne.body import BodyModel, Pose
from airborne.cameras import Camera
from airborne.studio.outlines import outline_items
from airborne.studio.pictures import Pictures, ShownTrial
from airborne.studio.runs import run_body, run_rig, run_rows
from airborne.types import Array, Image

_REACH_PX = 12  # how far an edge is looked for, in a picture 1000 px wide; more in larger ones
_SMALLER = 4  # times: images in which larger shifts are looked for, four times the reach and the reach again
_WIDE_PX = 1000  # of the pictures for which the numbers here are
_AROUND = 3  # frames on either side, which show the same
_MOST_POINTS = 400  # of an outline
_FEWEST_POINTS = 40  # that tell a shift
_STRETCHES = 8  # of the outline, each of which is left out once
_STANDS_OUT = 3.0  # standard deviations: one time in a thousand by chance
_TIMES_OTHERS = 2.0  # as far as the median of the other cameras, which show the body's own error
_LEAST_PX = 1.5  # [px] in a picture 1000 px wide: no outline fits better


@dataclass(frozen=True, slots=True, eq=False)
class EdgeShift:
    """Where a picture's edges lie, from the outline drawn over it."""

    camera: str
    px: Array  # (2,) right and down [px]
    sd_px: float
    stands_out: bool  # beside its deviation

    @property
    def far_px(self) -> float:
        """How far they lie off."""
        return float(np.linalg.norm(self.px))


def look_for_disagreement(run: Path, frame: int, shown: ShownTrial, pictures: Pictures) -> str:
    """Say which camera disagrees with a run of one body about a frame and those around it. Raises AirborneError."""
    rows, model = run_rows(run), run_body(run)
    row = int(np.searchsorted(rows.index, frame))
    frames = [int(each) for each in rows.index[max(0, row - _AROUND) : row + _AROUND + 1]]
    poses = {each: rows.pose(each) for each in frames if each < len(shown.clock)}
    return describe_shifts(
        edge_shifts(model, poses, run_rig(run).select(shown.names).cameras, shown=shown, pictures=pictures)
    )


def edge_shifts(
    model: BodyModel,
    poses: Mapping[int, Pose | None],
    cameras: Sequence[Camera],
    *,
    shown: ShownTrial,
    pictures: Pictures,
) -> list[EdgeShift]:
    """Measure a body's poses, by frame, in the pictures of cameras; those that show too little of it are left out."""
    shifts = []
    for pane, camera in enumerate(cameras):
        seen = []
        for each, pose in poses.items():
            number = int(shown.clock.images[each, pane])
            image = None if number < 0 or pose is None else pictures.image(shown.sources[pane], number)
            if image is not None and pose is not None:
                items = outline_items(model.with_pose(pose), (camera,), "")
                seen.append((image, [np.array(item["points"]) for item in items]))
        shifts.append(edge_shift(camera.name, seen))
    return [each for each in shifts if each is not None]


def edge_shift(camera: str, seen: Sequence[tuple[Image, Sequence[Array]]]) -> EdgeShift | None:
    """Measure the shift of a body's outlines in images (h, w, 3), in each closed lines (n, 2) [px]; None if short.

    A shift beyond the reach is found in smaller images first; what lies on the stronger edges is taken.
    """
    if not seen:
        return None
    scale = max(1.0, seen[0][0].shape[1] / _WIDE_PX)
    reach = round(_REACH_PX * scale)
    found: list[tuple[Array, _Match | None]] = [(np.zeros(2), _match(seen, reach))]
    small = _match([_shrink(image, outline) for image, outline in seen], reach)
    if small is not None:
        start = _SMALLER * small.px
        found.append((start, _match([(image, [line + start for line in outline]) for image, outline in seen], reach)))
    matches = [(start, match) for start, match in found if match is not None]
    if not matches:
        return None
    start, best = max(matches, key=lambda each: each[1].strength)
    sd = float(np.hypot(best.sd_px, 0.3 * scale))  # on a grid of whole pixels, refined to a third of one
    px = start + best.px
    far = float(np.linalg.norm(px))
    return EdgeShift(camera, px, sd, far > max(_STANDS_OUT * sd, _LEAST_PX * scale))


class _Match(NamedTuple):
    """Where outlines lie on the strongest edges."""

    px: Array  # (2,) shift [px]
    sd_px: float
    strength: float  # of the edges there, in those of the edges around


def _match(seen: Sequence[tuple[Image, Sequence[Array]]], reach: int) -> _Match | None:
    """Shift outlines over images by `reach` at most; None where they are short."""
    samples = [(image, *_sample(outline, image.shape, reach)) for image, outline in seen]
    points, normals = (np.concatenate(each) for each in zip(*(each[1:] for each in samples), strict=True))
    if len(points) < _FEWEST_POINTS * len(seen):
        return None
    profiles = np.concatenate([_edge_profiles(*each, reach) for each in samples if len(each[1])])
    whole, strength = _best_shift(profiles, normals, reach)
    stretch = np.arange(len(points)) * _STRETCHES // len(points)
    parts = np.stack([_best_shift(profiles[stretch != k], normals[stretch != k], reach)[0] for k in range(_STRETCHES)])
    variance = (_STRETCHES - 1) / _STRETCHES * np.sum((parts - parts.mean(axis=0)) ** 2)
    return _Match(whole, float(np.sqrt(variance / 2)), strength)


def _shrink(image: Image, outline: Sequence[Array]) -> tuple[Image, list[Array]]:
    """Return a smaller image, and the outline in it."""
    small = cv2.resize(image, None, fx=1 / _SMALLER, fy=1 / _SMALLER, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8), [(line + 0.5) / _SMALLER - 0.5 for line in outline]


def describe_shifts(shifts: Sequence[EdgeShift]) -> str:
    """Say which camera disagrees, and how far the edges lie off the outline in each."""
    if not shifts:
        return "too little of the body is seen here to tell"
    ranked = sorted(shifts, key=lambda each: -each.far_px)
    others = float(np.median([each.far_px for each in ranked[1:]])) if len(ranked) > 1 else 0.0
    is_one = ranked[0].stands_out and ranked[0].far_px > _TIMES_OTHERS * others
    verdict = f"{ranked[0].camera} disagrees" if is_one else "no camera disagrees with all others"
    each = "; ".join(f"{s.camera} {_sign(s.px[0])}, {_sign(s.px[1])} px, sd {s.sd_px:.1f}" for s in ranked)
    return f"{verdict}. Edges lie off the outline, right and down: {each}"


def _sign(px: float) -> str:
    return f"{round(px, 1) + 0.0:+.1f}"  # no -0.0


def _sample(outline: Sequence[Array], shape: tuple[int, ...], reach: int) -> tuple[Array, Array]:
    """Return points evenly along closed lines, and the normals there: (n, 2) each, those well inside the picture."""
    lines = [np.vstack([line, line[:1]]) for line in outline if len(line) > 2]
    if not lines:
        return np.empty((0, 2)), np.empty((0, 2))
    starts, ends = np.concatenate([line[:-1] for line in lines]), np.concatenate([line[1:] for line in lines])
    length = np.linalg.norm(ends - starts, axis=1)
    along = np.append(0, np.cumsum(length))
    at = (np.arange(_MOST_POINTS) + 0.5) / _MOST_POINTS * along[-1]
    part = np.clip(np.searchsorted(along, at, side="right") - 1, 0, len(length) - 1)
    share = (at - along[part]) / np.maximum(length[part], 1e-9)
    points = starts[part] + share[:, None] * (ends - starts)[part]
    tangent = (ends - starts)[part] / np.maximum(length[part], 1e-9)[:, None]
    inside = np.all((points > reach + 1) & (points < np.array(shape[1::-1]) - reach - 2), axis=1)
    return points[inside], np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)[inside]


def _edge_profiles(image: Image, points: Array, normals: Array, reach: int) -> Array:
    """Return how strong the edges are along each normal, at whole pixels from -reach to reach: (n, 2 reach + 1)."""
    offsets = np.arange(-reach - 1, reach + 2)
    at = (points[:, None] + offsets[:, None] * normals[:, None]).astype(np.float32)
    smooth = cv2.GaussianBlur(image, (0, 0), 1.0)
    colours = cv2.remap(smooth, at[..., 0], at[..., 1], cv2.INTER_LINEAR).astype(float)
    edges = np.abs(colours[:, 2:] - colours[:, :-2]).sum(axis=-1)
    return edges / (edges.mean(axis=1, keepdims=True) + 10.0)  # each point has one voice; flat stretches next to none


def _best_shift(profiles: Array, normals: Array, reach: int) -> tuple[Array, float]:
    """Return the shift (2,) [px] at which the outline lies on the strongest edges, and how strong they are."""
    steps = np.arange(-reach, reach + 1)
    shifts = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    across = np.clip(shifts @ normals.T, -reach, reach - 1e-6) + reach  # (shifts, n)
    low = across.astype(int)
    rows, share = np.arange(len(normals)), across - low
    score = ((1 - share) * profiles[rows, low] + share * profiles[rows, low + 1]).sum(axis=1)
    score = cv2.GaussianBlur(score.reshape(len(steps), len(steps)), (0, 0), 1.0)
    v, u = np.unravel_index(int(score.argmax()), score.shape)
    best = np.array([steps[u] + _vertex(score[v], int(u)), steps[v] + _vertex(score[:, u], int(v))])
    return best, float(score[v, u]) / len(normals)


def _vertex(score: Array, k: int) -> float:
    """Return how far the top of a parabola through three values lies from the middle one."""
    if not 0 < k < len(score) - 1:
        return 0.0
    before, here, after = score[k - 1 : k + 2]
    return float((before - after) / (2 * (before - 2 * here + after) - 1e-9))
