"""What is wrong with control points: errors where a camera cannot be estimated, findings where it can."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import fdtrc

from airborne.calibration.intrinsics.model_selection import Solution, leave_one_out
from airborne.calibration.intrinsics.physical import fit_pinhole
from airborne.calibration.sources.control_points import ControlPoints
from airborne.cameras.clicks import refuse_same_clicks
from airborne.cameras.dlt import FEWEST_DLT_POINTS, Decomposition, decompose, fit_dlt
from airborne.cameras.finding import Finding, join_names
from airborne.errors import CalibrationError, count
from airborne.geometry.triangulation import px_from_points
from airborne.types import Array

_FLAT_ERROR, _FLAT_WARNING = 0.01, 0.1  # thickness over extent of the points that one camera sees
# of the control points: beyond it an error, a warning: the unit is wrong
_LARGEST_EXTENT_M, _LARGE_EXTENT_M = 500.0, 100.0
_ROUGH_FIT_PX = 3.0  # careful clicks give about one pixel
_BENT = 3.0  # times a model's residuals: what the direct linear transformation may leave of a straight lens
_OFF_CENTRE = 0.15  # of the image's diagonal
_NOT_SQUARE = 0.03  # relative difference of the focal lengths that is reported
_MOST_STRETCH = 2.0  # chosen: of an axis of the points, either way, that is tried
_FAR = 50.0  # chosen: times the others' distance from their median; in millimetres a point is 1000 times as far
_MOST_ROLL = np.radians(60)  # about the optical axis: cameras stand roughly upright
_SIGNIFICANCE = 1e-4  # of rejecting a point of a good set
_MOST_OUTLIERS = 3  # named for each camera


def check_points(points: ControlPoints, sizes: Mapping[str, tuple[int, int]]) -> None:
    """Raise CalibrationError where a camera cannot be estimated: size, number, unit, image borders, flatness."""
    missing = [camera for camera in points.cameras if camera not in sizes]
    if missing:
        raise CalibrationError(f"no image size for camera '{missing[0]}'; sizes are given for: {', '.join(sizes)}")
    refuse_same_clicks("the control points", points.cameras, points.px)
    extent = np.linalg.norm(np.ptp(points.world, axis=0))
    if extent > _LARGEST_EXTENT_M:
        _refuse_far_points(points)
        raise CalibrationError(
            f"the control points span {extent:.0f} m, expected a scene in metres: divide by 1000 if they are in mm"
        )
    for camera in points.cameras:
        is_seen = points.is_seen_by(camera)
        if is_seen.sum() < FEWEST_DLT_POINTS:
            raise CalibrationError(
                f"camera '{camera}' sees {is_seen.sum()} control points, at least {FEWEST_DLT_POINTS} are needed: "
                "click more"
            )
        _check_inside(points, camera, sizes[camera])
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
            "by 1000 what is in mm"
        )


def _check_inside(points: ControlPoints, camera: str, size: tuple[int, int]) -> None:
    px = points.px[:, points.cameras.index(camera)]
    upper = np.array(size) - 0.5
    outside = (px < -0.5) | (px > upper)  # NaN compares as inside
    if not outside.any():
        return
    first = int(np.flatnonzero(outside.any(axis=1))[0])
    n = int(outside.any(axis=1).sum())
    what = (
        f"camera '{camera}': {count(n, 'control point')} outside its {size[0]}×{size[1]} image "
        f"(first '{points.names[first]}' at u={px[first, 0]:g}, v={px[first, 1]:g})"
    )
    if not ((px < -0.5) | (px > upper[::-1])).any():
        raise CalibrationError(
            f"{what}; with width and height exchanged they would fit: exchange those, or the columns u and v"
        )
    raise CalibrationError(f"{what}: correct them, or the image size")


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
    sizes: Mapping[str, tuple[int, int]],
    decompositions: Mapping[str, Decomposition],
    solutions: Mapping[str, Solution],
) -> tuple[Finding, ...]:
    """Return what casts doubt on the calibration, each with its camera or point."""
    findings = []
    extent = np.linalg.norm(np.ptp(points.world, axis=0))
    if extent > _LARGE_EXTENT_M:
        what = f"the control points span {extent:.0f} m"
        findings.append(Finding(kind="units", what=what, advice="are they in metres?"))
    stretched = list(_check_stretch([decompositions[name] for name in points.cameras]))
    findings += stretched
    outliers = {camera: find_outliers(solutions[camera]) for camera in points.cameras}
    findings += _check_outliers(points, outliers)
    for camera in points.cameras:
        if _is_straight(solutions[camera]):  # else the decomposition says little
            found = _check_image(camera, sizes[camera], decompositions[camera])
            findings += [each for each in found if each.kind != "squeezed" or not stretched]
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


def _check_stretch(cameras: Sequence[Decomposition]) -> Iterator[Finding]:
    """Yield a finding where one axis of the points, stretched, explains pixels of several cameras that are not square.

    Where a table's axis is divided by s, a camera's K R has the column of that axis multiplied by s.
    """

    def log_ratios(log_stretch: float, axis: int) -> Array:
        columns = np.where(np.arange(3) == axis, np.exp(log_stretch), 1.0)
        K = [decompose(np.column_stack([each.K @ each.R * columns, np.zeros(3)])).K for each in cameras]
        return np.log([k[0, 0] / k[1, 1] for k in K])

    def misfit(log_stretch: float, axis: int) -> float:
        return float(np.sum(log_ratios(log_stretch, axis) ** 2))

    if np.count_nonzero(np.abs(log_ratios(0.0, 0)) > _NOT_SQUARE) < 2:
        return
    bounds = np.log(_MOST_STRETCH) * np.array([-1.0, 1.0])
    fits = [minimize_scalar(misfit, bounds=bounds, method="bounded", args=(axis,)) for axis in range(3)]
    axis = int(np.argmin([fit.fun for fit in fits]))
    found = float(fits[axis].x)
    if np.abs(log_ratios(found, axis)).max() < _NOT_SQUARE < abs(found):
        name = f"{'xyz'[axis]}_m"
        what = f"with {name} multiplied by {np.exp(-found):.2f}, the pixels of all cameras would be square"
        yield Finding(kind="stretched", what=what, advice=f"check the points' {name}")


def _is_straight(solution: Solution) -> bool:
    """Say whether the direct linear transformation, which knows no lens, fits about as well as the chosen model."""
    P = fit_dlt(solution.world, solution.px)
    rms_px = np.sqrt(np.mean(np.sum((px_from_points(P[None], solution.world)[:, 0] - solution.px) ** 2, axis=1)))
    return bool(rms_px < _BENT * np.sqrt(np.mean(np.sum(solution.residual_px**2, axis=1))))


def _check_image(camera: str, size: tuple[int, int], decomposition: Decomposition) -> Iterator[Finding]:
    K, R = decomposition.K, decomposition.R
    middle = (np.array(size) - 1) / 2
    if np.linalg.norm(K[:2, 2] - middle) > _OFF_CENTRE * np.hypot(*size):
        yield Finding(
            kind="off centre",
            what=f"camera '{camera}' looks through pixel ({K[0, 2]:.0f}, {K[1, 2]:.0f}), expected near the middle "
            f"({middle[0]:.0f}, {middle[1]:.0f})",
            advice=f"is {size[0]}×{size[1]} its size, or is the image cropped?",
            cameras=(camera,),
        )
    if abs(K[0, 0] / K[1, 1] - 1) > _NOT_SQUARE:
        yield Finding(
            kind="squeezed",
            what=f"camera '{camera}' seems to have pixels that are not square (focal lengths {K[0, 0]:.0f} and "
            f"{K[1, 1]:.0f} px)",
            advice="resample its image to square pixels",
            cameras=(camera,),
        )
    level = np.hypot(R[2, 0], R[2, 1])
    if level > 0.5 and -R[1, 2] / level < np.cos(_MOST_ROLL):
        what = f"camera '{camera}' comes out on its side or upside down"
        yield Finding(kind="turned", what=what, advice="is world z up?", cameras=(camera,))


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
