"""The start of a trial found in its videos: the empty scene, what stands out from it, the body's pose and frame."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from airborne.appearance.empty_scene import FEWEST_PICTURES, EmptyScene
from airborne.body import BodyModel, Pose
from airborne.body.symmetry import least_turned_pose, symmetries
from airborne.errors import TrialError, UndecidedError, count
from airborne.export import write_json
from airborne.geometry.rotations import angles_from_matrix
from airborne.io.folder_lock import refuse_links
from airborne.motion.run_folder import CANDIDATES, CANDIDATES_PICTURE, figures_of
from airborne.run.moving_mix_ups import MovingSilhouettes, compare_silhouettes, refuse_moving_mix_ups
from airborne.run.sample import look_through
from airborne.tracking import Status
from airborne.tracking.backward import turn_time
from airborne.tracking.first_pose.candidates import Candidate, StartSearch, find_thing
from airborne.tracking.first_pose.moments import SourceKey, empty_scenes, look, source_of
from airborne.tracking.first_pose.person_candidates import find_person
from airborne.tracking.first_pose.players import PlayersSearch
from airborne.tracking.methods import sample_body_colours
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.tracker import track_frames
from airborne.trial.file import Trial
from airborne.trial.start import StartTable
from airborne.types import Progress
from airborne.video import Frames, Recording, VideoFacts

AnySearch = TypeVar("AnySearch", StartSearch, PlayersSearch)

_SURE = 0.99  # a higher probability rests on assumptions that are less sure themselves
_MOST_BYTES = 4e8  # of decoded pictures that are kept to track back through


@dataclass(frozen=True, slots=True, eq=False)
class FoundStart:
    """Where a trial's body is, and what it was found by."""

    trial: Trial  # with the start that was found
    model: BodyModel
    finding: StartSearch
    scenes: Mapping[SourceKey, EmptyScene]
    facts: tuple[VideoFacts, ...]
    how: str  # it was found, one line
    silhouettes: MovingSilhouettes  # what they say of the videos

    @property
    def start(self) -> dict[str, Any]:
        """The [start] as a trial file has it."""
        angles = ["joint_angles_deg"] if self.model.has_joints else []
        return self.trial.start.model_dump(include={"frame", "position_m", "quaternion_xyzw", *angles})

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know, one line each."""
        return self.how, *self.silhouettes.doubts

    def draw(self, folder: Path) -> None:
        """Draw the empty scene, what stands out from it and the body there."""
        from airborne.export.finding import draw_empty_scene

        posed = self.model.with_pose(self.finding.candidates[0].pose)
        draw_empty_scene(figures_of(folder) / "empty_scene.png", self.finding.moment, self.scenes, posed)


def find_start(trial: Trial, folder: Path, *, take: int | None = None, progress: Progress | None = None) -> FoundStart:
    """Find the start of a trial that says nothing of it: the earliest frame from which the body can be followed.

    Where the pictures do not decide between poses, candidates.json and a picture of them are written into `folder` and
    UndecidedError is raised; `take` chooses one of them, from 1. Whoever calls it is the folder's `sole_writer`. Raises
    TrialError where nothing can be found.
    """
    model = trial.model()
    require_two_cameras(trial)
    recording, facts, sample = look_through(trial, progress)
    scenes = empty_scenes(sample)
    if not scenes:
        pictures = Counter(source_of(view) for frames in sample for view in frames.views if view is not None)
        kind = " and kind of field" if len(pictures) > len(trial.camera) else ""
        most = max(pictures.values(), default=0)
        masked = ", as [[mask]] leaves them out of others" if trial.mask and most < len(sample) else ""
        raise TrialError(
            f"{trial.name}: {count(most, 'picture')} of each camera{kind}{masked}: too few to tell the empty scene, "
            f"{FEWEST_PICTURES} at least; give the pose under [start]"
        )
    moments = look(sample, scenes)
    silhouettes = compare_silhouettes(moments)
    refuse_moving_mix_ups(silhouettes)
    finding = (find_person if model.has_joints else find_thing)(model, moments, progress)
    if take is not None:
        finding = take_candidate(trial, finding, take)
    elif not finding.is_decided:
        raise _ask_for_help(trial, model, finding, folder, silhouettes.doubts)
    first = finding.candidates[0]
    frame, pose = _track_back(trial, model, recording, finding, progress)
    pose = least_turned_pose(model, pose)
    chosen = "was found" if take is None else f"is candidate {take}, as --take says"
    how = (
        f"[start] {chosen}: the body stands out best in frame {finding.moment.frames.index} "
        f"({describe_probability(first.probability)}) and can be followed back to frame {frame}"
    )
    if len(symmetries(model)) > 1:
        how += "; turned poses of this body look alike, and of them this is turned least from the world's axes"
    return FoundStart(_with_start(trial, model, frame, pose), model, finding, scenes, facts, how, silhouettes)


def describe_probability(probability: float) -> str:
    """Say how sure a finding is; none is said to be certain."""
    return f"probability {probability:.0%}" if probability < _SURE else f"probability over {_SURE:.0%}"


def require_two_cameras(trial: Trial) -> None:
    """Raise TrialError where a start is to be found in the pictures of one camera, which do not tell how far it is."""
    if len(trial.camera) < 2:
        what, give = ("players", "[[start.player]]") if trial.has_players else ("the body", "its pose")
        raise TrialError(f"{trial.name}: [start] is missing; finding {what} needs two cameras: give {give}")


def take_candidate(trial: Trial, finding: AnySearch, number: int) -> AnySearch:
    """Put a candidate first."""
    n = len(finding.candidates)
    if not 1 <= number <= n:
        raise TrialError(f"{trial.name}: there is no candidate {number}; there are {n}, in the order of {CANDIDATES}")
    chosen = finding.candidates[number - 1]
    return replace(finding, candidates=(chosen, *(each for each in finding.candidates if each is not chosen)))


def open_candidates(folder: Path) -> None:
    """Make the folder into which candidates are written. Raises ResultError for links that lead out of it."""
    folder.mkdir(parents=True, exist_ok=True)
    refuse_links(folder)


def _ask_for_help(
    trial: Trial, model: BodyModel, finding: StartSearch, folder: Path, doubts: Sequence[str]
) -> UndecidedError:
    """Write the candidates and return the error that names them; it says what makes the videos doubtful."""
    from airborne.export.finding import draw_candidates

    frame, best = finding.moment.frames.index, finding.candidates[0]
    sides = " (left limbs are orange, right ones blue)" if model.has_joints else ""
    open_candidates(folder)
    write_json(folder / CANDIDATES, _describe(model, finding))
    draw_candidates(
        folder / CANDIDATES_PICTURE,
        finding.moment,
        [(_describe_candidate(each), model.with_pose(each.pose)) for each in finding.candidates],
    )
    if not best.is_plausible:
        reason = (
            f"no pose agrees with what moves in frame {frame} (of the likeliest, {best.precision:.0%} of the outline "
            f"stands out, and covers {best.recall:.0%} of what does)"
        )
        doubts = doubts or ["check that each camera has its own video, and [calibration] and [body]"]
    else:
        reason = f"{len(finding.candidates)} poses in frame {frame} look alike, the likeliest {best.probability:.0%}"
    advice = (
        f"look at {folder / CANDIDATES_PICTURE}{sides}; where the outlines miss the body in one camera, its video may "
        "be another's, or its clock off (`airborne sync`); then give --take 1 (or another number), or the pose under "
        "[start]"
    )
    said = "; ".join([reason, *doubts, advice]).replace("?; ", "? ")
    return UndecidedError(f"{trial.name}: the start is undecided: {said}")


def _describe_candidate(candidate: Candidate) -> str:
    """Say how likely a pose is, or that its silhouettes do not agree with what stands out."""
    if candidate.is_plausible:
        return f"{candidate.probability:.0%}"
    return f"disagrees: {candidate.precision:.0%} stands out"


def _describe(model: BodyModel, finding: StartSearch) -> dict[str, Any]:
    return {
        "frame": finding.moment.frames.index,
        "time_s": float(finding.moment.frames.time_s),
        "n_moving": finding.n_moving,
        "candidates": [
            {
                "number": number,
                "probability": round(each.probability, 4),
                "precision": round(each.precision, 3),
                "recall": round(each.recall, 3),
                "is_plausible": each.is_plausible,
                "position_m": each.pose.world_from_root.translation.tolist(),
                "quaternion_xyzw": each.pose.world_from_root.rotation.as_quat().tolist(),
                "somersault_tilt_twist_deg": np.degrees(
                    angles_from_matrix(each.pose.world_from_root.rotation.as_matrix())
                ).tolist(),
                **({"joint_angles_deg": _joint_angles_deg(model, each.pose)} if model.has_joints else {}),
            }
            for number, each in enumerate(finding.candidates, start=1)
        ],
    }


def _track_back(
    trial: Trial, model: BodyModel, recording: Recording, finding: StartSearch, progress: Progress | None
) -> tuple[int, Pose]:
    """Track from the moment of the finding back in time; return the earliest frame that is tracked, and the pose."""
    found, pose = finding.moment.frames.index, finding.candidates[0].pose
    kept = frames_up_to(trial, recording, found)
    if not kept:
        return found, pose
    backward = [turn_time(frames) for frames in reversed(kept)]
    tracker = RefinedTracker(sample_body_colours(model, pose, backward[0]), pose)
    earliest = found, pose
    for number, (_, estimate) in enumerate(track_frames(tracker, backward, lambda estimate: None), start=1):
        if progress is not None:
            progress(number, len(backward))
        if estimate.status is Status.TRACKED and estimate.pose is not None:
            earliest = -estimate.index, estimate.pose
        elif -estimate.index < found:  # a first frame may be uncertain: nothing was learned before it
            break
    return earliest


def frames_up_to(trial: Trial, recording: Recording, index: int) -> Sequence[Frames]:
    """Return the frames from the trial's first, or as many as memory holds, up to one; decoded."""
    picture_bytes = sum(1.5 * facts.size[0] * facts.size[1] for facts in recording.facts)
    most = max(2, int(_MOST_BYTES / picture_bytes))
    return deque(replace(recording, start=trial.start.frame, stop=index + 1), maxlen=most)


def _with_start(trial: Trial, model: BodyModel, frame: int, pose: Pose) -> Trial:
    root = pose.world_from_root
    start = StartTable(
        frame=frame,
        position_m=root.translation.tolist(),
        quaternion_xyzw=root.rotation.as_quat().tolist(),
        joint_angles_deg=_joint_angles_deg(model, pose),
    )
    return trial.model_copy(update={"start": start})


def _joint_angles_deg(model: BodyModel, pose: Pose) -> dict[str, list[float]]:
    """Return the joints' angles as [start] has them; none for a body without joints."""
    names = (segment.name for segment in model.segments[1:])
    return dict(zip(names, np.degrees(pose.joint_angles).tolist(), strict=True)) if model.has_joints else {}
