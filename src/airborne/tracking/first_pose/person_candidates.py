"""Candidate poses of a person, and a decision: some moments are searched a little, the best of them on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count

import numpy as np

from airborne.body import BodyModel
from airborne.errors import TrialError
from airborne.rendering import mask_evidence
from airborne.tracking.first_pose.candidates import Candidate, StartSearch
from airborne.tracking.first_pose.moments import Moment
from airborne.tracking.first_pose.person import JointedBody, PoseSet, SilhouetteEvidence, apart
from airborne.tracking.first_pose.person_search import Judge, first_poses, improve, polish
from airborne.tracking.first_pose.places import Place, find_places
from airborne.tracking.first_pose.postures import is_person
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array, Progress

_N_MOMENTS = 3  # that are searched a little: about 7 s each
_N_ROUNDS = 5  # of the best of them, and of the next where it does not decide: about 2 s each
_MOST_SEARCHED = 2  # moments, with all rounds
_N_KEPT = 8  # candidates
_APART_M = 0.1  # mean distance of landmarks by which candidates differ: the first frame's fit makes up for less
_LEAST_APART_M = 0.05  # the same of those that are polished
_JUDGED_PER_NAT = 0.01  # of the judge's measure that makes a pose e times likelier
_LEAST_PRECISION, _LEAST_RECALL = 0.7, 0.7  # of a mask over what stands out, and the other way round
_LEAST_SHOWN = 0.01  # probability of a candidate that is listed


def find_person(model: BodyModel, moments: Sequence[Moment], progress: Progress | None = None) -> StartSearch:
    """Find a person where something stands out. Raises TrialError."""
    number, most = count(1), _N_MOMENTS + _MOST_SEARCHED * (_N_ROUNDS + 1)

    def advance() -> None:
        if progress is not None:
            progress(next(number), most)

    if not is_person(model):
        raise TrialError(
            "[start] is missing; a body with joints is found if its segments are named as those of human18: give "
            "joints_m, points_px or detections under [start]"
        )
    person = JointedBody(RenderModel.of(model))
    seen = [(moment, find_places(moment, person.radius_m)) for moment in moments]
    seen = [(moment, places) for moment, places in seen if places and _n_views(person, moment, places[0]) > 1]
    if not seen:
        raise TrialError(
            "[start] is missing, and nothing is seen to move in two cameras at once; give joints_m, points_px or "
            "detections under [start]"
        )
    searches = []
    for moment, places in _spread(seen):
        searches.append(_search_a_little(person, moment, places[0]))
        advance()
    searches.sort(key=lambda search: -search[0](search[1]).max())
    n_moving = {id(moment): len(places) for moment, places in seen}
    findings = []
    for judge, poses in searches[:_MOST_SEARCHED]:
        findings.append(StartSearch(judge.moment, _search_on(judge, poses, advance), n_moving[id(judge.moment)]))
        if findings[-1].is_decided:
            return findings[-1]
    return findings[0]


def _n_views(person: JointedBody, moment: Moment, place: Place) -> int:
    """Count the views that show what lies around a place."""
    return len(SilhouetteEvidence.around(person, moment, place.position).cameras)


def _spread(seen: Sequence[tuple[Moment, list[Place]]]) -> list[tuple[Moment, list[Place]]]:
    """Return some of the moments in which the body is seen best, apart in time."""
    times = [float(moment.frames.time_s) for moment, _ in seen]
    least_s = (max(times) - min(times)) / (_N_MOMENTS + 2)
    chosen: list[tuple[Moment, list[Place]]] = []
    for moment, places in sorted(seen, key=lambda each: each[1][0].rank, reverse=True):
        if all(abs(float(moment.frames.time_s - other.frames.time_s)) > least_s for other, _ in chosen):
            chosen.append((moment, places))
    return chosen[:_N_MOMENTS]


def _search_a_little(person: JointedBody, moment: Moment, place: Place) -> tuple[Judge, PoseSet]:
    poses, judge = first_poses(person, moment, place)
    poses = improve(judge, poses, n_kept=24, n_moves=64, seed=1, is_rough=True)
    return judge, improve(judge, poses, n_kept=12, n_moves=64, seed=2)


def _search_on(judge: Judge, poses: PoseSet, advance: Callable[[], None]) -> tuple[Candidate, ...]:
    """Improve poses and polish the best, and advance after each; return the candidates, the likeliest first."""
    person = judge.person
    for number in range(_N_ROUNDS):
        poses = improve(judge, poses, n_kept=_N_KEPT, n_moves=128, seed=10 + number, narrower=0.75**number)
        advance()
    poses = poses[apart(person.landmarks(poses), judge(poses), _N_KEPT, _LEAST_APART_M)]
    poses = PoseSet.of([polish(judge, pose) for pose in poses.each()])
    advance()
    return _candidates(judge, poses[apart(person.landmarks(poses), judge(poses), _N_KEPT, _APART_M)])


def _candidates(judge: Judge, poses: PoseSet) -> tuple[Candidate, ...]:
    nats = judge(poses) / _JUDGED_PER_NAT
    likelihood = np.exp(nats - nats.max())
    probability = likelihood / likelihood.sum()
    precision, recall = _agreement(judge, poses)
    is_plausible = (precision >= _LEAST_PRECISION) & (recall >= _LEAST_RECALL)
    found = [
        Candidate(pose, float(probability[i]), float(precision[i]), float(recall[i]), bool(is_plausible[i]))
        for i, pose in enumerate(poses.each())
        if probability[i] >= _LEAST_SHOWN
    ]
    return tuple(sorted(found, key=lambda candidate: -candidate.probability))


def _agreement(judge: Judge, poses: PoseSet) -> tuple[Array, Array]:
    """Return which share of each mask stands out, and which share of what stands out it covers, over all views."""
    geometry, segments = judge.person.render_model.geometry, judge.person.segments(poses)
    standing_out, ones = judge.silhouettes.standing_out, judge.silhouettes.ones
    inside = mask_evidence(geometry, standing_out, *segments).sum(axis=1)
    area = mask_evidence(geometry, ones, *segments).sum(axis=1)
    return inside / np.maximum(area, 1), inside / max(float(standing_out.totals.sum()), 1)
