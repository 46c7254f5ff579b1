"""Paper B's comparison (its figs 9, 10): tracked poses against poses from manually digitised points."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Box, Pose
from airborne.cameras import Rig
from airborne.errors import ResultError
from airborne.evaluation.compare import MotionComparison, compare_motion
from airborne.evaluation.table import read_table
from airborne.evaluation.truth import Truth
from airborne.io.writing import write_text
from airborne.motion import Motion
from airborne.types import Array

_EXPECTED = "a table of clicked points with the columns field, <point>_<camera>_u, <point>_<camera>_v, ..."
_COLLINEAR = 1e-6  # of the largest singular value: points closer to collinear give no orientation
# chosen: clicks of the bundled throw leave 5 mm, with two cameras or two points exchanged 135 and 180
_MOST_RESIDUAL_MM = 40.0
_NOT_RIGID = (
    "the digitised points are not those of the body: are cameras' columns or points exchanged, are clicks of another "
    "frame, or is the body of another size?"
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DigitisedPoints:
    """Manually digitised points, `<part>_minus` and `<part>_plus`: the ends of a bar."""

    index: NDArray[np.int64]  # (n,) frame or field numbers
    points: tuple[str, ...]
    px: Array  # (n, points, cameras, 2) [px], in the rig's order; NaN where not clicked


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DigitisedPoses:
    """The root's poses fitted to the digitised points; NaN where too few were clicked."""

    index: NDArray[np.int64]  # (n,)
    position: Array  # (n, 3) [m]
    R: Array  # (n, 3, 3) world from root
    residual: Array  # (n, points of the body) distance of each from the fitted body's [m]
    left_out: tuple[str, ...] = ()  # points that were clicked but are not of the body


@dataclass(frozen=True, slots=True, kw_only=True)
class DigitisedComparison:
    """Tracked minus digitised, and how well the digitised points fit a rigid body."""

    tracked_minus_digitised: MotionComparison
    rigid_fit_residual_rms_mm: float
    n_poses: int  # digitised
    left_out: tuple[str, ...] = ()  # points that were clicked but are not of the body

    def to_dict(self) -> dict:
        """Return the numbers for a JSON file; what is unknown is None."""
        return {
            "tracked_minus_digitised": self.tracked_minus_digitised.to_dict(),
            "rigid_fit_residual_rms_mm": self.rigid_fit_residual_rms_mm,
            "n_poses": self.n_poses,
            **({"points_left_out": list(self.left_out)} if self.left_out else {}),
        }

    @property
    def questions(self) -> tuple[str, ...]:
        """What is asked about the clicked points where they are far from the motion, one line each."""
        return (*self.tracked_minus_digitised.questions, *self._questions_of_fit)

    @property
    def _questions_of_fit(self) -> tuple[str, ...]:
        return (_NOT_RIGID,) if self.rigid_fit_residual_rms_mm > _MOST_RESIDUAL_MM else ()

    def describe(self) -> str:
        """Return the numbers as a short plain table."""
        fit = f"{self.n_poses} digitised poses; rigid fit residual RMS {self.rigid_fit_residual_rms_mm:.2f} mm"
        compared = self.tracked_minus_digitised.describe()
        return "\n".join([fit, *describe_left_out(self.left_out), compared, *self._questions_of_fit])


def describe_left_out(points: Sequence[str]) -> list[str]:
    """Name points that the body does not have, in a line where there are some."""
    return [f"not compared, as the body has no such points: {', '.join(points)}"] if points else []


def read_digitised(path: Path, rig: Rig) -> DigitisedPoints:
    """Read clicked points; blank cells are points not clicked. Raises ResultError in one line.

    Pixel coordinates are distorted ones of the full image, (0, 0) the centre of its top-left pixel.
    """
    return read_clicked_frames(path, rig.names)


def read_clicked_frames(path: Path, cameras: Sequence[str]) -> DigitisedPoints:
    """Read clicked points of the named cameras, as `read_digitised` does."""
    table = read_table(path, _EXPECTED)
    if table.names[0] not in ("field", "frame"):
        raise ResultError(f"{path} begins with column {table.names[0]}; expected {_EXPECTED}")
    columns = {name: _point_and_camera(path, name, cameras) for name in table.names[1:]}
    points = tuple(dict.fromkeys(point for point, _, _ in columns.values()))
    if not points:
        raise ResultError(f"{path} has no clicked points; expected {_EXPECTED}")
    values = table.numbers(list(columns))
    px = np.full((len(values), len(points), len(cameras), 2), np.nan)
    for k, (point, camera, axis) in enumerate(columns.values()):
        px[:, points.index(point), camera, axis] = values[:, k]
    return DigitisedPoints(index=table.whole_numbers(table.names[0]), points=points, px=px)


def write_clicked_frames(path: Path, digitised: DigitisedPoints, cameras: Sequence[str]) -> None:
    """Write clicked points as `read_clicked_frames` reads them."""
    write_text(path, format_clicked_frames(digitised, cameras))


def format_clicked_frames(digitised: DigitisedPoints, cameras: Sequence[str]) -> str:
    """Return the table that `read_clicked_frames` reads, blank where a point was not clicked."""
    header = [
        "frame",
        *(f"{point}_{camera}_{axis}" for point in digitised.points for camera in cameras for axis in "uv"),
    ]
    rows = [header]
    for frame, px in zip(digitised.index, digitised.px, strict=True):
        rows.append([str(frame), *("" if np.isnan(value) else repr(float(value)) for value in px.ravel())])
    return "".join(",".join(row) + "\n" for row in rows)


def box_ends(model: BodyModel) -> list[str]:
    """Return the names of the points that a body's boxes have: `<part>_minus` and `<part>_plus` of each."""
    boxes = [part.name for segment in model.segments for part in segment.parts if isinstance(part.shape, Box)]
    return [f"{name}_{end}" for name in boxes for end in ("minus", "plus")]


def body_points(model: BodyModel, points: Sequence[str]) -> Array:
    """Return the digitised points of the body in the root's frame, all joints at zero: (points, 3) [m].

    `<stem>_minus` and `<stem>_plus` are the ends of the longest axis of the box whose part's name begins with the
    stem. Raises ResultError unless exactly one box matches.
    """
    boxes = _boxes(model)
    return np.stack([_box_end(point, boxes) for point in points])


def _boxes(model: BodyModel) -> dict[str, tuple[Array, Array]]:
    """Return the centre and half of the longest axis of each box, in the root's frame, all joints at zero [m]."""
    posed = model.with_pose(Pose(world_from_root=RigidTransform.identity()))
    boxes = {}
    for segment, R, t in zip(model.segments, posed.R, posed.t, strict=True):
        for part in segment.parts:
            if isinstance(part.shape, Box):
                half = np.where(np.arange(3) == np.argmax(part.shape.size_m), part.shape.size_m / 2, 0.0)
                segment_from_part = part.segment_from_part
                centre = R @ segment_from_part.translation + t
                boxes[part.name] = (centre, R @ segment_from_part.rotation.apply(half))
    return boxes


def fit_digitised_poses(digitised: DigitisedPoints, rig: Rig, model: BodyModel) -> DigitisedPoses:
    """Triangulate the clicked points and fit the rigid body to them, weighted by their numbers of views.

    Points that are no ends of its boxes are left out; raises ResultError where none is.
    """
    names, boxes = digitised.points, _boxes(model)
    of_body = [k for k, name in enumerate(names) if len(_matches(name, boxes)) == 1] or list(range(len(names)))
    on_body, px = body_points(model, [names[k] for k in of_body]), digitised.px[:, of_body]
    in_world, n_views = rig.points_from_px(px), np.isfinite(px).all(axis=-1).sum(axis=-1)
    fits = [fit_rigid(on_body, points, views) for points, views in zip(in_world, n_views, strict=True)]
    R, position = np.stack([fit[0] for fit in fits]), np.stack([fit[1] for fit in fits])
    fitted = np.einsum("nij,pj->npi", R, on_body) + position[:, None]
    residual = np.linalg.norm(fitted - in_world, axis=-1)
    clicked = np.flatnonzero(np.isfinite(digitised.px).any(axis=(0, 2, 3))).tolist()
    left_out = tuple(names[k] for k in clicked if k not in of_body)
    return DigitisedPoses(index=digitised.index, position=position, R=R, residual=residual, left_out=left_out)


def compare_digitised(motion: Motion, poses: DigitisedPoses, symmetries: Sequence[Array]) -> DigitisedComparison:
    """Compare the tracked poses with the digitised ones of the same frame or field numbers.

    `symmetries` as in `compare`. Raises ResultError if the two have no frame in common.
    """
    is_known = np.isfinite(poses.position).all(axis=-1)
    _, rows, frames = np.intersect1d(poses.index[is_known], motion.index, return_indices=True)
    if not len(rows):
        raise ResultError(
            f"no digitised pose belongs to a frame of the motion ({int(is_known.sum())} poses, {len(motion)} frames); "
            "click at least three points, not in a line, in two cameras, in frames that were tracked"
        )
    truth = Truth(
        index=motion.index[frames],
        time_s=motion.time_s[frames],
        position=poses.position[is_known][rows],
        R=poses.R[is_known][rows],
    )
    unrated = replace(
        motion, covariance=np.full_like(motion.covariance, np.nan)
    )  # clicks have errors too, so sd are not tested
    return DigitisedComparison(
        tracked_minus_digitised=compare_motion(unrated, truth, symmetries),
        rigid_fit_residual_rms_mm=float(1e3 * np.sqrt(np.nanmean(poses.residual**2))),
        n_poses=int(is_known.sum()),
        left_out=poses.left_out,
    )


def fit_rigid(source: Array, target: Array, weights: Array) -> tuple[Array, Array]:
    """Find R (3, 3), t (3,) [m] that minimise `sum w |R source + t - target|^2`, points (p, 3); NaN is ignored.

    Kabsch's algorithm (SVD). NaN for fewer than three points, or collinear ones.
    """
    is_known = np.isfinite(target).all(axis=-1) & (weights > 0)
    a, b, w = source[is_known], target[is_known], weights[is_known, None]
    if len(a) >= 3:
        mean_a, mean_b = (w * a).sum(axis=0) / w.sum(), (w * b).sum(axis=0) / w.sum()
        U, singular, Vt = np.linalg.svd((w * (b - mean_b)).T @ (a - mean_a))
        if singular[1] > _COLLINEAR * singular[0]:
            R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
            return R, mean_b - R @ mean_a
    return np.full((3, 3), np.nan), np.full(3, np.nan)


def _point_and_camera(path: Path, name: str, cameras: Sequence[str]) -> tuple[str, int, int]:
    stem, _, axis = name.rpartition("_")
    for camera in sorted(cameras, key=len, reverse=True):  # the longest first: "far_left" also ends with "_left"
        point = stem.removesuffix(f"_{camera}")
        if point and point != stem and axis in ("u", "v"):
            return point, cameras.index(camera), "uv".index(axis)
    raise ResultError(f"{path}: column {name} is no <point>_<camera>_u or _v; cameras: {', '.join(cameras)}")


def _matches(point: str, boxes: Iterable[str]) -> list[str]:
    """Return the boxes of which a point may be an end."""
    stem, _, end = point.rpartition("_")
    return [name for name in boxes if name.startswith(stem)] if stem and end in ("minus", "plus") else []


def _box_end(point: str, boxes: dict[str, tuple[Array, Array]]) -> Array:
    matches = _matches(point, boxes)
    if len(matches) != 1:
        listed = ", ".join(boxes) or "none"
        raise ResultError(
            f"point '{point}' is the end of no single box of the body; name it <part>_minus or <part>_plus, "
            f"with one of the boxes: {listed}"
        )
    centre, half = boxes[matches[0]]
    return centre + half if point.endswith("_plus") else centre - half
