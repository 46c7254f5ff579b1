"""The start of a trial of players found in its videos: who stands at the net, followed back to the first frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from airborne.errors import UndecidedError, count
from airborne.export import write_json
from airborne.export.finding import draw_player_candidates
from airborne.motion.run_folder import CANDIDATES, CANDIDATES_PICTURE
from airborne.run.find import (
    describe_probability,
    frames_up_to,
    open_candidates,
    require_two_cameras,
    take_candidate,
)
from airborne.run.players_tracker import doubt_starts, list_doubts
from airborne.run.sample import look_through
from airborne.tracking import Status
from airborne.tracking.backward import turn_time
from airborne.tracking.capsules import Blocker
from airborne.tracking.first_pose.players import PlayersSearch, find_players
from airborne.tracking.players import PlayerStart
from airborne.trial.file import Trial
from airborne.trial.players import PlayerTable
from airborne.trial.start import StartTable
from airborne.types import Progress
from airborne.video import Frames, Recording, VideoFacts


@dataclass(frozen=True, slots=True, eq=False)
class FoundPlayers:
    """Where a trial's players are, and what they were found by."""

    trial: Trial  # with the start that was found
    finding: PlayersSearch
    facts: tuple[VideoFacts, ...]
    notes: tuple[str, ...]  # what the user should know, one line each

    @property
    def start(self) -> dict[str, Any]:
        """The [start] as a trial file has it."""
        players = [player.model_dump(include={"name", "joints_m"}) for player in self.trial.start.player]
        return {"frame": self.trial.start.frame, "player": players}


def find_players_start(
    trial: Trial, folder: Path, *, take: int | None = None, progress: Progress | None = None
) -> FoundPlayers:
    """Find the players of a trial that says nothing of them, and the earliest frame from which they can be followed.

    Where the pictures do not decide who is there, or which way they face, candidates.json and a picture are written
    into `folder` and UndecidedError is raised; `take` chooses one of them, from 1. Raises TrialError where nobody is.
    """
    require_two_cameras(trial)
    recording, facts, sample = look_through(trial, progress)

    def whole(index: int) -> Frames:
        return next(iter(replace(recording, start=index, stop=index + 1)))

    finding = find_players(sample, whole, near_net=trial.start.near_net, progress=progress)
    if take is not None:
        finding = take_candidate(trial, finding, take)
    elif not finding.is_decided:
        raise _ask_for_help(trial, finding, folder)
    first = finding.candidates[0]
    frame, starts = _track_back(trial, recording, finding)
    stand = "stands" if len(starts) == 1 else "stand"
    note = (
        f"[[start.player]]: {count(len(starts), 'player')} found, who {stand} out in frame {finding.frames.index} "
        f"({describe_probability(first.probability)}) and can be followed back to frame {frame}"
    )
    in_the_air = list_doubts(doubt_starts(starts, None))
    return FoundPlayers(_with_start(trial, frame, starts), finding, facts, (note, *in_the_air))


def _ask_for_help(trial: Trial, finding: PlayersSearch, folder: Path) -> UndecidedError:
    """Write the candidates and return the error that names them."""
    frame, best = finding.frames.index, finding.candidates[0]
    open_candidates(folder)
    write_json(folder / CANDIDATES, _describe(finding))
    draw_player_candidates(
        folder / CANDIDATES_PICTURE,
        finding.frames,
        [(f"{each.probability:.0%}", [player.state for player in each.players]) for each in finding.candidates],
    )
    if best.is_plausible:
        n = len(finding.candidates)
        reason = f"who stands there in frame {frame}, and how; the likeliest of {n} is right by {best.probability:.0%}"
    else:
        reason = f"nobody is seen well in frame {frame}; check [calibration], whose world must be the court's"
    return UndecidedError(
        f"{trial.name}: the players' start is undecided: {reason}; look at {folder / CANDIDATES_PICTURE}, then give "
        "--take 1 (or another number), or [[start.player]] tables"
    )


def _describe(finding: PlayersSearch) -> dict[str, Any]:
    return {
        "frame": finding.frames.index,
        "time_s": float(finding.frames.time_s),
        "candidates": [
            {
                "number": number,
                "probability": round(each.probability, 4),
                "players": [
                    {
                        "name": start.name,
                        "probability": round(player.probability, 3),
                        "support": round(player.support, 3),
                        "evidence": round(player.evidence, 3),
                        "joints_m": _round_joints(start),
                    }
                    for start, player in zip(each.starts, each.players, strict=True)
                ],
            }
            for number, each in enumerate(finding.candidates, start=1)
        ],
    }


def _track_back(trial: Trial, recording: Recording, finding: PlayersSearch) -> tuple[int, tuple[PlayerStart, ...]]:
    """Track from the moment of the finding back in time; return the earliest frame in which all are, and where."""
    found, starts = finding.frames.index, finding.candidates[0].starts
    kept = frames_up_to(trial, recording, found)
    tracker = Blocker(starts)
    state, earliest = tracker.init(), (found, starts)
    for frames in reversed(kept):
        state, estimates = tracker.step(state, turn_time(frames))
        statuses = {estimate.status for estimate in estimates}
        if Status.LOST in statuses:
            break
        if statuses == {Status.TRACKED}:
            starts = tuple(
                PlayerStart(name=each.player, joints_m={**dict(zip(tracker.joints, each.points, strict=True))})
                for each in estimates
            )
            earliest = frames.index, starts
    return earliest


def _with_start(trial: Trial, frame: int, starts: Sequence[PlayerStart]) -> Trial:
    players = [PlayerTable(name=start.name, joints_m=_round_joints(start)) for start in starts]
    return trial.model_copy(update={"start": StartTable(frame=frame, player=players)})


def _round_joints(start: PlayerStart) -> dict[str, list[float]]:
    """Return joints to a tenth of a millimetre."""
    return {joint: [round(x, 4) for x in point.tolist()] for joint, point in start.joints_m.items()}
