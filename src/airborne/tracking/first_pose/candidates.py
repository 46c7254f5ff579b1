"""Finding a thing: the moments in which it is seen best, its candidate poses there, and a decision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from airborne.body import BodyModel, Pose
from airborne.errors import TrialError
from airborne.rendering import FLAT, ScoreRule, mask_evidence, pack_targets, score
from airborne.tracking.first_pose.moments import Moment
from airborne.tracking.first_pose.places import Place, find_places
from airborne.tracking.first_pose.rigid_search import Posed, Thing, full_maps, search_orientations
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array

LEAST_PROBABILITY = 0.95  # of the best candidate, with which it is taken
# the next five: `benchmarks/accuracy/find_start.py --seeds 1000-1029`, none of which its rows are measured on
_SHARE_PER_NAT = 0.02  # share of the evidence that makes a silhouette e times likelier
_CHROMA_SD, _GREY_SD = 4.0, 12.0  # of colours, less their brightness, and with it [grey levels]
_LEAST_PRECISION, _LEAST_RECALL = 0.75, 0.6  # of a mask over what stands out
_MOST_MOMENTS, _MOST_PLACES = 3, 3  # that are searched: about a second each
_MOST_CANDIDATES = 6  # whose colours are compared: the rest covers far less
_AS_WELL = 0.7  # share of the largest picture of the body that counts as large as any
_LEAST_SHOWN = 0.01  # probability of a candidate that is listed


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A pose in which the body may be."""

    pose: Pose
    probability: float
    precision: float  # share of its mask that stands out from the empty scene
    recall: float  # share of what stands out there that its mask covers

    @property
    def is_plausible(self) -> bool:
        """Whether its silhouettes agree with what stands out."""
        return self.precision >= _LEAST_PRECISION and self.recall >= _LEAST_RECALL


@dataclass(frozen=True, slots=True, eq=False)
class Finding:
    """What was found at the moment in which the body is seen best."""

    moment: Moment
    candidates: tuple[Candidate, ...]  # the likeliest first
    n_moving: int  # places where something moves

    @property
    def is_decided(self) -> bool:
        """Whether the likeliest candidate can be taken."""
        best = self.candidates[0]
        return best.is_plausible and best.probability >= LEAST_PROBABILITY


def find_thing(model: BodyModel, moments: Sequence[Moment]) -> Finding:
    """Find a rigid body where something stands out; of several moments, the first that decides. Raises TrialError."""
    thing = Thing(RenderModel.of(model))
    seen = [(moment, find_places(moment, thing.radius_m)) for moment in moments]
    seen = [(moment, places) for moment, places in seen if places]
    if not seen:
        raise TrialError(
            "[start] is missing, and nothing is seen to move in two cameras at once; give the pose under [start]"
        )
    findings = []
    for moment, places in islice(_best_first(seen), _MOST_MOMENTS):
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


def _find_at(thing: Thing, moment: Moment, places: Sequence[Place]) -> Finding:
    found = [(place, posed) for place in places[:_MOST_PLACES] for posed in search_orientations(thing, moment, place)]
    found.sort(key=lambda each: -each[1].evidence)
    found = found[:_MOST_CANDIDATES]
    R = np.stack([posed.pose.world_from_root.rotation.as_matrix() for _, posed in found])[:, None]
    t = np.stack([posed.pose.world_from_root.translation for _, posed in found])[:, None]
    probability = _probabilities(thing, moment, [posed for _, posed in found], R, t)
    precision, recall = _agreement(thing, moment, [place for place, _ in found], R, t)
    candidates = [
        Candidate(posed.pose, float(probability[i]), float(precision[i]), float(recall[i]))
        for i, (_, posed) in enumerate(found)
        if probability[i] >= _LEAST_SHOWN
    ]
    candidates.sort(key=lambda candidate: -candidate.probability)
    return Finding(moment, tuple(candidates), len(places))


def _probabilities(thing: Thing, moment: Moment, found: Sequence[Posed], R: Array, t: Array) -> Array:
    """Return the candidates' probabilities (n,) by silhouettes and colours; R (n, 1, 3, 3), t (n, 1, 3) [m]."""
    evidence = np.array([posed.evidence for posed in found])
    nats = (evidence / max(evidence.max(), 1e-9) - 1) / _SHARE_PER_NAT
    if not thing.model.needs_colours:
        targets = pack_targets(moment.frames.views, FLAT)
        for rule, sd in ((ScoreRule(normalised=1.0), _CHROMA_SD), (ScoreRule(fits_gain=True), _GREY_SD)):
            off = score(thing.render_model.geometry, targets, R, t, rule=rule)
            nats = nats - np.minimum(off, 128.0) ** 2 / (2 * sd**2)
    likelihood = np.exp(nats - nats.max())
    return likelihood / likelihood.sum()


def _agreement(thing: Thing, moment: Moment, places: Sequence[Place], R: Array, t: Array) -> tuple[Array, Array]:
    """Return precision and recall (n,) of the candidates' masks, over all views."""
    geometry = thing.render_model.geometry
    probable = full_maps(moment, moment.probability)
    ones = full_maps(moment, [None if p is None else np.ones_like(p) for p in moment.probability])
    inside = mask_evidence(geometry, probable, R, t).sum(axis=1)
    area = mask_evidence(geometry, ones, R, t).sum(axis=1)
    total = np.array([sum(region.area_px for region in place.regions if region is not None) for place in places])
    return inside / np.maximum(area, 1), np.minimum(inside / np.maximum(total, 1), 1.0)
