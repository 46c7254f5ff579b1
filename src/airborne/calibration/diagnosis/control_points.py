"""What is wrong with control points: errors where a camera cannot be estimated, findings where it can."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.special import fdtrc

from airborne.calibration.diagnosis.image_geometry import (
    NOT_SQUARE,
    check_alike,
    check_image,
    excludes_square_pixels,
    is_straight,
)
from airborne.calibration.intrinsics.model_selection import Solution, leave_one_out
from airborne.calibration.intrinsics.physical import fit_pinhole
from airborne.calibration.sources.control_points import ControlPoints
from airborne.cameras.clicks import refuse_same_clicks
from airborne.cameras.dlt import FEWEST_DLT_POINTS, Decomposition, decompose, fit_dlt
from airborne.cameras.finding import Finding, join_names
from airborne.errors import CalibrationError, count
from airborne.types import Array, Size
from airborne.video.sizes import lines_of_scale

_FLAT_ERROR, _FLAT_WARNING = 0.01, 0.1  # thickness over extent of the points that one camera sees
# of the control points: beyond it an error, a warning: the unit is wrong
_LARGEST_EXTENT_M, _LARGE_EXTENT_M = 500.0, 100.0
_SMALL_EXTENT_M = 0.2  # chosen: of a scene that may be meant
_UNITS = ((0.01, "cm (divide by 100)"), (0.001, "mm (divide by 1000)"), (0.0254, "inches (multiply by 0.0254)"))
_ROUGH_FIT_PX = 3.0  # careful clicks give about one pixel
_MOST_STRETCH = 2.0  # chosen: of an axis of the points, either way, that is tried
_FACTORS = tuple(Fraction(each) for each in ("4/3", "3/2", "2", "8/3", "3", "4"))  # by which videos are reduced
_REDUCED = 0.25  # chosen: share of a camera's points that lie outside an image that is too small by 4/3, 0.44 evenly
_FAR = 50.0  # chosen: times the others' distance from their median; in millimetres a point is 1000 times as far
_SIGNIFICANCE = 1e-4  # of rejecting a point of a good set
_MOST_OUTLIERS = 3  # named for each camera


def check_points(points: ControlPoints, sizes: Mapping[str, Size]) -> None:
    """Raise CalibrationError where a camera cannot be estimated: size, number, unit, image borders, flatness."""
    missing = [camera for camera in points.cameras if camera not in sizes]
    if missing:
        raise CalibrationError(f"no image size for camera '{missing[0]}'; sizes are given for: {', '.join(sizes)}")
    refuse_same_clicks("the control points", points.cameras, points.px)
    extent = float(np.linalg.norm(np.ptp(points.world, axis=0)))
    if extent > _LARGEST_EXTENT_M:
        _refuse_far_points(points)
        raise CalibrationError(
            f"the control points span {extent:.0f} m, expected a scene in metres: {_other_units(extent)}"
        )
    for camera in points.cameras:
        is_seen = points.is_seen_by(camera)
        if is_seen.sum() < FEWEST_DLT_POINTS:
            raise CalibrationError(
                f"camera '{camera}' sees {is_seen.sum()} control points, at least {FEWEST_DLT_POINTS} are needed: "
                "click more"
            )
        check_inside(points, camera, sizes)
        ratio = flatness(points.world[is_seen])
        if ratio < _FLAT_ERROR:
            raise CalibrationError(
                f"the control points of camera '{camera}' lie in one plane (thickness / extent {ratio:.4f}, "
                f"at least {_FLAT_ERROR} is needed): add points off that plane"
            )


def _refuse_far_points(points: ControlPoints) -> None:
    """Raise CalibrationError, naming them, where a few points lie far from all others: their unit may be another."""
    from_middle = np.linalg.norm(points.world - np.median(points.world, axis=0), axis=1)
    is_far = from_middle > _FAR * np.median(from_middle)
    if is_far.any():
        names = join_names([points.names[k] for k in np.flatnonzero(is_far)[:_MOST_OUTLIERS]])
        what = "a control point lies" if is_far.sum() == 1 else f"{is_far.sum()} control points lie"
        raise CalibrationError(
            f"{what} {from_middle[is_far].max():.0f} m from the others, which span "
            f"{np.linalg.norm(np.ptp(points.world[~is_far], axis=0)):.1f} m ({names}): correct x_m, y_m, z_m; divide "
            "by 100 what is in cm, by 1000 what is in mm"
        )


def _other_units(extent: float) -> str:
    """Say what points that span `extent` would span in units that make a plausible scene of them."""
    spans = [(share * extent, how) for share, how in _UNITS]
    plausible = [f"{m:.2g} m if in {how}" for m, how in spans if _SMALL_EXTENT_M < m < _LARGE_EXTENT_M]
    return f"they would span {', '.join(plausible)}" if plausible else "correct x_m, y_m, z_m"


def check_inside(points: ControlPoints, camera: str, sizes: Mapping[str, Size]) -> None:
    """Raise CalibrationError where points lie outside a camera's image, and say which size would hold them."""
    px, size = points.px[:, points.cameras.index(camera)], sizes[camera]
    outside = is_outside(px, size)
    if not outside.any():
        return
    first, n = int(np.flatnonzero(outside)[0]), int(outside.sum())
    what = (
        f"camera '{camera}': {count(n, 'point')} outside its {size[0]}×{size[1]} image "
        f"(first '{points.names[first]}' at u={px[first, 0]:g}, v={px[first, 1]:g})"
    )
    if is_turned(px, size):
        raise CalibrationError(
            f"{what}; with width and height exchanged they would fit: exchange those, or the columns u and v"
        )
    alike = points.px[:, [sizes[each] == size for each in points.cameras]].reshape(-1, 2)
    factor = next((each for each in _FACTORS if not is_outside(alike, _times(size, each)).any()), None)
    if factor is None or n < _REDUCED * np.isfinite(px[:, 0]).sum():  # else a few wrong clicks
        raise CalibrationError(f"{what}: correct them, or the image size")
    width, height = _times(size, factor)
    raise CalibrationError(
        f"{what}; they fit {width}×{height}, {float(factor):.4g} times the size, so they were probably clicked before "
        f"the video was reduced: calibrate with --size {width}x{height}; in a trial of reduced videos give the result "
        f"as file under [calibration], and under [[camera]] {lines_of_scale(float(factor))}"
    )


def is_outside(px: Array, size: Size) -> NDArray[np.bool_]:
    """Say which of px (n, 2) lie outside an image; NaN does not."""
    return np.any((px < -0.5) | (px > np.array(size) - 0.5), axis=1)


def is_turned(px: Array, size: Size) -> bool:
    """Say whether px (n, 2) lie outside an image, and inside it with width and height exchanged."""
    width, height = size
    return bool(is_outside(px, size).any() and not is_outside(px, (height, width)).any())


def _times(size: Size, factor: Fraction) -> Size:
    return round(size[0] * factor), round(size[1] * factor)


def flatness(world: Array) -> float:
    """Return thickness over extent of points (n, 3): the ratio of the smallest to the largest singular value."""
    spread = np.linalg.svd(world - world.mean(axis=0), compute_uv=False)
    return float(spread[2] / spread[0]) if spread[0] > 0 else 0.0


def decompose_cameras(points: ControlPoints) -> dict[str, Decomposition]:
    """Return every camera's DLT decomposition; raise CalibrationError where one is mirrored."""
    decompositions = {}
    for i, camera in enumerate(points.cameras):
        is_seen = points.is_seen_by(camera)
        decompositions[camera] = decompose(fit_dlt(points.world[is_seen], points.px[is_seen, i]))
    mirrored = [camera for camera, decomposition in decompositions.items() if decomposition.is_mirrored]
    if mirrored and len(mirrored) == len(decompositions):
        raise CalibrationError(
            "every camera comes out left-handed, so the world is mirrored: two of x_m, y_m, z_m are exchanged, one has "
            "the wrong sign, or every v counts up from the bottom instead of down from the top"
        )
    if mirrored:
        raise CalibrationError(
            f"camera '{mirrored[0]}' comes out left-handed while others do not: its u and v are exchanged, "
            "one of them counts from the wrong side, or points are mixed up"
        )
    return decompositions


def check_solutions(
    points: ControlPoints,
    sizes: Mapping[str, Size],
    decompositions: Mapping[str, Decomposition],
    candidates: Mapping[str, Sequence[Solution]],
    *,
    solutions: Mapping[str, Solution],
) -> tuple[Finding, ...]:
    """Return what casts doubt on the calibration, each with its camera or point; `candidates`: of all models tried."""
    findings = []
    extent = float(np.linalg.norm(np.ptp(points.world, axis=0)))
    if extent > _LARGE_EXTENT_M:
        what = f"the control points span {extent:.0f} m"
        findings.append(Finding(kind="units", what=what, advice=f"are they in metres? {_other_units(extent)}"))
    stretched = list(_check_stretch(decompositions, candidates))
    findings += stretched
    alike = check_alike(sizes, candidates)
    findings += alike
    known = {("off centre", name) for each in alike for name in each.cameras}
    known |= {("squeezed", name) for name in points.cameras if stretched}
    outliers = {camera: find_outliers(solutions[camera]) for camera in points.cameras}
    findings += _check_outliers(points, outliers)
    for camera in points.cameras:
        if is_straight(solutions[camera]):  # else the decomposition says little
            found = check_image(camera, sizes[camera], decompositions[camera], candidates[camera])
            findings += [each for each in found if (each.kind, camera) not in known]
        ratio = flatness(solutions[camera].world)
        if ratio < _FLAT_WARNING:
            what = f"the control points of camera '{camera}' are nearly flat (thickness / extent {ratio:.3f})"
            advice = "depth and focal length are poorly told apart; spread them more"
            findings.append(Finding(kind="flat", what=what, advice=advice, cameras=(camera,)))
        rms = np.sqrt(np.mean(np.sum(solutions[camera].residual_px ** 2, axis=1)))
        if rms > _ROUGH_FIT_PX and len(outliers[camera]) in (0, _MOST_OUTLIERS):  # else the named points explain it
            what = f"camera '{camera}' fits its control points only to {rms:.1f} px (careful clicks give about 1)"
            advice = "check its points, their coordinates and the image size"
            findings.append(Finding(kind="misfit", what=what, advice=advice, cameras=(camera,)))
    return tuple(findings)


def _check_stretch(
    decompositions: Mapping[str, Decomposition], candidates: Mapping[str, Sequence[Solution]]
) -> Iterator[Finding]:
    """Yield a finding where one axis of the points, stretched, explains pixels of several cameras that are not square.

    Where a table's axis is divided by s, a camera's K R has the column of that axis multiplied by s.
    """
    cameras = list(decompositions.values())

    def log_ratios(log_stretch: float, axis: int) -> Array:
        columns = np.where(np.arange(3) == axis, np.exp(log_stretch), 1.0)
        K = [decompose(np.column_stack([each.K @ each.R * columns, np.zeros(3)])).K for each in cameras]
        return np.log([k[0, 0] / k[1, 1] for k in K])

    def misfit(log_stretch: float, axis: int) -> float:
        return float(np.sum(log_ratios(log_stretch, axis) ** 2))

    is_squeezed = np.abs(log_ratios(0.0, 0)) > NOT_SQUARE
    if sum(excludes_square_pixels(candidates[name]) for name in np.array([*decompositions])[is_squeezed]) < 2:
        return
    bounds = np.log(_MOST_STRETCH) * np.array([-1.0, 1.0])
    fits = [minimize_scalar(misfit, bounds=bounds, method="bounded", args=(axis,)) for axis in range(3)]
    axis = int(np.argmin([fit.fun for fit in fits]))
    found = float(fits[axis].x)
    if np.abs(log_ratios(found, axis)).max() < NOT_SQUARE < abs(found):
        name = f"{'xyz'[axis]}_m"
        what = f"with {name} multiplied by {np.exp(-found):.2f}, the pixels of all cameras would be square"
        yield Finding(kind="stretched", what=what, advice=f"check the points' {name}")


def find_outliers(solution: Solution) -> dict[int, float]:
    """Return outliers: index among the camera's points -> held-out error [px], worst first.

    A point is an outlier if leaving it out lowers the sum of squares significantly: an F test with 2 and
    `2 (n - 1) - k` degrees of freedom, at `_SIGNIFICANCE` over all points; then again without it.
    """
    outliers: dict[int, float] = {}
    index = np.arange(len(solution.world))
    while len(outliers) < _MOST_OUTLIERS:
        dof = 2 * (len(index) - 1) - solution.model.n_parameters
        if dof < 2:
            return outliers
        total = np.sum(solution.residual_px**2)
        others = solution.px - np.array([pinhole.px_from_world(solution.world) for pinhole in solution.refits])
        cost_without = np.sum(others**2, axis=(1, 2)) - np.sum(solution.held_out_px**2, axis=1)
        worst = int(np.argmin(cost_without))
        statistic = (total - cost_without[worst]) / 2 / max(cost_without[worst] / dof, 1e-12)
        if fdtrc(2, dof, statistic) * len(index) > _SIGNIFICANCE:
            return outliers
        outliers[int(index[worst])] = float(np.linalg.norm(solution.held_out_px[worst]))
        keep = np.arange(len(index)) != worst
        index = index[keep]
        world, px = solution.world[keep], solution.px[keep]
        pinhole = fit_pinhole(solution.refits[worst], solution.model, world, px)
        solution = leave_one_out(pinhole, solution.model, world, px)
    return outliers


def _check_outliers(points: ControlPoints, outliers: Mapping[str, Mapping[int, float]]) -> Iterator[Finding]:
    errors: dict[str, dict[str, float]] = {}
    for camera, errors_of_camera in outliers.items():
        names = np.array(points.names)[points.is_seen_by(camera)]
        for i, error in errors_of_camera.items():
            errors.setdefault(str(names[i]), {})[camera] = error
    for name, by_camera in errors.items():
        misses = " and ".join(f"{error:.1f} px in camera '{camera}'" for camera, error in by_camera.items())
        suspect = "its x_m, y_m, z_m" if len(by_camera) > 1 else "its clicked pixels"
        what, advice = f"control point '{name}' misses by {misses} when left out", f"check {suspect}, or leave it out"
        yield Finding(kind="outlier", what=what, advice=advice, cameras=tuple(by_camera), points=(name,))
