"""What control points say about images: their middle, the shape of their pixels, which side is up."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy.special import fdtrc

from airborne.calibration.intrinsics.model_selection import Solution, as_good_as_best
from airborne.calibration.intrinsics.physical import PINHOLE_MODELS, parameter_covariance
from airborne.cameras.dlt import Decomposition, fit_dlt
from airborne.cameras.finding import Finding, join_names
from airborne.geometry.triangulation import px_from_points
from airborne.types import Array, Size

NOT_SQUARE = 0.03  # chosen: relative difference of the focal lengths that is reported
_BENT = 3.0  # chosen: times a model's residuals: what the direct linear transformation may leave of a straight lens
_OFF_CENTRE = 0.15  # chosen: of the image's diagonal, of one camera
# of the diagonal; chi-square of that, over the scatter's where this is above 1; and the scatter's for each degree of
# freedom: of cameras that lie off alike. Chosen on 172 sets of synthetic points, 8 to 24 for two to four cameras, 1 px
# of noise; of 174 other sets none is reported at the right size, 117 at one off by 9 % of the diagonal, 153 by 12 %
_OFF_ALIKE, _LEAST_CHI2, _MOST_SCATTER = 0.05, 30.0, 3.0
_LENS_SD = 0.01  # of the diagonal, chosen: how far a camera's axis lies off the middle
_SIGNIFICANCE = 1e-3  # chosen: of an image that is not as the user says
_TELLING = 15  # control points, with which a camera is well determined: docs/reference/calibration.md
_MOST_ROLL = np.radians(60)  # about the optical axis: cameras stand roughly upright
_N_DLT = 11  # numbers of the direct linear transformation


def is_straight(solution: Solution) -> bool:
    """Say whether the direct linear transformation, which knows no lens, fits about as well as the chosen model."""
    return bool(_dlt_cost(solution) < _BENT**2 * np.sum(solution.residual_px**2))


def excludes_square_pixels(candidates: Sequence[Solution]) -> bool:
    """Say whether a camera's points fit no camera with square pixels, wherever its axis meets the image."""
    return _excludes([each for each in candidates if each.model in PINHOLE_MODELS and not each.model.terms][-1])


def check_alike(sizes: Mapping[str, Size], candidates: Mapping[str, Sequence[Solution]]) -> list[Finding]:
    """Report cameras with one image size whose axes all lie off its middle by the same vector."""
    findings = []
    for size in dict.fromkeys(sizes[name] for name in candidates):
        names = tuple(name for name in candidates if sizes[name] == size)
        off = [each for each in (_axis_off(size, candidates[name]) for name in names) if each]
        if len(off) < 2 or len(off) < len(names):
            continue
        weights = [np.linalg.inv(covariance) for _, covariance in off]
        mean = np.linalg.solve(sum(weights), sum(W @ each for W, (each, _) in zip(weights, off, strict=True)))
        scatter = sum((each - mean) @ W @ (each - mean) for W, (each, _) in zip(weights, off, strict=True))
        scatter /= 2 * (len(off) - 1)
        is_significant = mean @ sum(weights) @ mean > _LEAST_CHI2 * max(scatter, 1.0) and scatter < _MOST_SCATTER
        if np.linalg.norm(mean) < _OFF_ALIKE * np.hypot(*size) or not is_significant:
            continue
        middle = (np.array(size) - 1) / 2
        (u, v), (width, height) = middle + mean, 10 * np.rint((np.array(size) + 2 * mean) / 10)
        who = "all cameras look" if len(names) == len(candidates) else f"cameras {join_names(names)} look"
        findings.append(
            Finding(
                kind="off centre",
                what=f"{who} through about pixel ({u:.0f}, {v:.0f}), expected near the middle ({middle[0]:.0f}, "
                f"{middle[1]:.0f}), which would be right for about {width:.0f}×{height:.0f}",
                advice=f"is {size[0]}×{size[1]} their size, or were all images cropped alike?",
                cameras=names,
            )
        )
    return findings


def check_image(
    camera: str, size: Size, decomposition: Decomposition, candidates: Sequence[Solution]
) -> Iterator[Finding]:
    """Yield what a camera's decomposition shows of its image, as far as its points exclude one as the user says."""
    K, R, n = decomposition.K, decomposition.R, len(candidates[0].world)
    middle = (np.array(size) - 1) / 2
    is_off = np.linalg.norm(K[:2, 2] - middle) > _OFF_CENTRE * np.hypot(*size)
    is_squeezed = abs(K[0, 0] / K[1, 1] - 1) > NOT_SQUARE
    tells_middle, tells_shape = _excludes(candidates[0]), excludes_square_pixels(candidates)
    if is_off and tells_middle:
        yield Finding(
            kind="off centre",
            what=f"camera '{camera}' looks through pixel ({K[0, 2]:.0f}, {K[1, 2]:.0f}), expected near the middle "
            f"({middle[0]:.0f}, {middle[1]:.0f})",
            advice=f"is {size[0]}×{size[1]} its size, or is the image cropped?",
            cameras=(camera,),
        )
    if is_squeezed and tells_shape:
        yield Finding(
            kind="squeezed",
            what=f"camera '{camera}' seems to have pixels that are not square (focal lengths {K[0, 0]:.0f} and "
            f"{K[1, 1]:.0f} px)",
            advice="resample its image to square pixels",
            cameras=(camera,),
        )
    if n < _TELLING and ((is_off and not tells_middle) or (is_squeezed and not tells_shape)):
        what = f"camera '{camera}' has {n} control points, too few to tell whether its image size is right"
        yield Finding(kind="few", what=what, advice="click more, 15 to 25 are good", cameras=(camera,))
    level = np.hypot(R[2, 0], R[2, 1])
    if level > 0.5 and -R[1, 2] / level < np.cos(_MOST_ROLL):
        what = f"camera '{camera}' comes out on its side or upside down"
        yield Finding(kind="turned", what=what, advice="is world z up?", cameras=(camera,))


def _axis_off(size: Size, candidates: Sequence[Solution]) -> tuple[Array, Array] | None:
    """Return how far a camera's axis lies off the middle (2,) [px] and the covariance (2, 2); None: it was held."""
    free = [each for each in candidates if each.model.frees_principal_point]
    if not free:
        return None
    best = next((each for each in as_good_as_best(candidates) if each.model.frees_principal_point), free[0])
    covariance = parameter_covariance(best.pinhole, best.model, best.world, best.px)[7:9, 7:9]
    own = (_LENS_SD * np.hypot(*size)) ** 2 * np.eye(2)
    return best.pinhole.principal_point - (np.array(size) - 1) / 2, covariance + own


def _excludes(square: Solution) -> bool:
    """Say whether the direct linear transformation fits significantly better than a camera: an F test."""
    more, dof = _N_DLT - square.model.n_parameters, square.px.size - _N_DLT
    cost = _dlt_cost(square)
    statistic = (np.sum(square.residual_px**2) - cost) / more / max(cost / dof, 1e-12)
    return bool(fdtrc(more, dof, max(statistic, 0.0)) < _SIGNIFICANCE)


def _dlt_cost(solution: Solution) -> float:
    """Return the sum of squares [px²] that the direct linear transformation leaves of a camera's points."""
    P = fit_dlt(solution.world, solution.px)
    return float(np.sum((px_from_points(P[None], solution.world)[:, 0] - solution.px) ** 2))
