"""Where a thing may be: the moments in which it is seen best, its candidate poses there, and a decision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.errors import TrialError
from airborne.rendering import mask_evidence
from airborne.tracking.first_pose.moments import Moment
from airborne.tracking.first_pose.places import Place, find_places
from airborne.tracking.first_pose.rigid_search import (
    N_FITTED,
    Thing,
    different_poses,
    fit_image,
    full_maps,
    log_likelihoods,
    roots_of,
    search_orientations,
)
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array, Progress

LEAST_PROBABILITY = 0.95  # of the best candidate, with which it is taken
# throws 1000-1029 of `benchmarks/accuracy/find_start.py`: right bodies had 0.82 and 0.86 at least, others 0.77 at most
_LEAST_PRECISION = 0.75  # of a mask over what stands out
_LEAST_AGREEMENT = 0.8  # mean of its precision and recall
_MOST_MOMENTS, _MOST_PLACES = 3, 3  # that are searched: about a second each
_AS_WELL = 0.7  # share of the largest picture of the body that counts as large as any
_LEAST_SHOWN = 0.01  # probability of a candidate that is listed


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A pose in which the body may be."""

    pose: Pose
    probability: float
    precision: float  # share of its mask that stands out from the empty scene
    recall: float  # share of what stands out there that its mask covers
    is_plausible: bool  # its silhouettes agree with what stands out


@dataclass(frozen=True, slots=True, eq=False)
class StartSearch:
    """What was found at the moment in which the body is seen best."""

    moment: Moment
    candidates: tuple[Candidate, ...]  # the likeliest first
    n_moving: int  # places where something moves

    @property
    def is_decided(self) -> bool:
        """Whether the likeliest candidate can be taken."""
        best = self.candidates[0]
        return best.is_plausible and best.probability >= LEAST_PROBABILITY


def find_thing(model: BodyModel, moments: Sequence[Moment], progress: Progress | None = None) -> StartSearch:
    """Find a rigid body where something stands out; of several moments, the first that decides. Raises TrialError."""
    thing = Thing(RenderModel.of(model))
    seen = [(moment, find_places(moment, thing.radius_m)) for moment in moments]
    seen = [(moment, places) for moment, places in seen if places]
    if not seen:
        raise TrialError(
            "[start] is missing, and nothing is seen to move in two cameras at once; give the pose under [start]"
        )
    findings = []
    for number, (moment, places) in enumerate(islice(_best_first(seen), _MOST_MOMENTS)):
        if progress is not None:
            progress(number, _MOST_MOMENTS)
        findings.append(_find_at(thing, moment, places))
        if findings[-1].is_decided:
            return findings[-1]
    return max(findings, key=lambda finding: finding.candidates[0].precision * finding.candidates[0].recall)


def _best_first(seen: Sequence[tuple[Moment, list[Place]]]) -> list[tuple[Moment, list[Place]]]:
    """Sort moments by how well the body is seen; those in which it is seen about as well as ever by time."""
    most_views, most_px = max(places[0].rank for _, places in seen)

    def order(each: tuple[Moment, list[Place]]) -> tuple[float, float, float]:
        views, px = each[1][0].rank
        is_among_best = views == most_views and px >= _AS_WELL * most_px
        return (0, 0, each[0].frames.index) if is_among_best else (1, -views, -px)

    return sorted(seen, key=order)


def _find_at(thing: Thing, moment: Moment, places: Sequence[Place]) -> StartSearch:
    poses = [pose for place in places[:_MOST_PLACES] for pose in search_orientations(thing, moment, place)]
    poses = different_poses(thing, moment, poses, N_FITTED)
    if not thing.model.needs_colours:
        likely = _probabilities(thing, moment, poses) >= _LEAST_SHOWN
        fitted = [fit_image(thing, moment, pose) for pose, is_likely in zip(poses, likely, strict=True) if is_likely]
        poses = different_poses(thing, moment, [*fitted, *poses[len(fitted) :]], N_FITTED)
    probability = _probabilities(thing, moment, poses)
    precision, recall = _agreement(thing, moment, places, poses)
    is_plausible = (precision >= _LEAST_PRECISION) & (precision + recall >= 2 * _LEAST_AGREEMENT)
    candidates = [
        Candidate(pose, float(probability[i]), float(precision[i]), float(recall[i]), bool(is_plausible[i]))
        for i, pose in enumerate(poses)
        if probability[i] >= _LEAST_SHOWN
    ]
    candidates.sort(key=lambda candidate: -candidate.probability)
    return StartSearch(moment, tuple(candidates), len(places))


def _probabilities(thing: Thing, moment: Moment, poses: Sequence[Pose]) -> Array:
    nats = log_likelihoods(thing, moment, poses)
    likelihood = np.exp(nats - nats.max())
    return likelihood / likelihood.sum()


def _agreement(thing: Thing, moment: Moment, places: Sequence[Place], poses: Sequence[Pose]) -> tuple[Array, Array]:
    """Return precision and recall (n,) of the poses' masks, over all views; recall of the nearest place."""
    geometry, (R, t) = thing.render_model.geometry, roots_of(poses)
    probable = full_maps(moment, moment.probability)
    ones = full_maps(moment, [None if p is None else np.ones_like(p) for p in moment.probability])
    inside = mask_evidence(geometry, probable, R[:, None], t[:, None]).sum(axis=1)
    area = mask_evidence(geometry, ones, R[:, None], t[:, None]).sum(axis=1)
    middles = t + R @ thing.centre
    away = np.linalg.norm(middles[:, None] - np.stack([place.position for place in places]), axis=2)
    total = np.array([places[i].rank[1] for i in away.argmin(axis=1)])
    return inside / np.maximum(area, 1), np.minimum(inside / np.maximum(total, 1), 1.0)
