"""Everything about a trial that can be found wrong before it is tracked, all at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import TypeVar

from airborne.errors import AirborneError, MistakesError, TrialError, count
from airborne.run.detections import read_trial_detections
from airborne.run.find import require_two_cameras
from airborne.run.first_pose import OUT_OF_SIGHT, find_first_pose, out_of_sight
from airborne.run.keys import keys_of_frames
from airborne.run.mix_ups import find_undecided_mix_ups, refuse_mix_ups, refuse_same_files, start_foregrounds
from airborne.run.moving_mix_ups import MovingSilhouettes, look_at_silhouettes, refuse_moving_mix_ups
from airborne.run.opening import (
    Opened,
    dark_start_error,
    open_trial,
    past_the_end_error,
    read_or_calibrate,
    video_source,
)
from airborne.run.players_mix_ups import refuse_players_mix_ups
from airborne.run.players_tracker import doubt_starts, list_doubts, player_starts, players_tracker_of, start_notes
from airborne.trial.file import Trial, list_wrong_names, parse_trial
from airborne.trial.remainder import Remainder, parse_remainder
from airborne.video import Recording, VideoFacts, inspect
from airborne.video.outages import DARK_LEVEL, is_dark

_T = TypeVar("_T")
_DIM_LEVEL = 2 * DARK_LEVEL  # chosen: an image at 6 % of its brightness has no brighter pixel
_NO_MIX_UP = "videos: no sign at the start that cameras' videos were exchanged"
_UNDECIDED = "videos: what moves does not show whether any were exchanged or mirrored; tracking may show it"
_ONE_BODY = "videos: what moves in them looks like one body seen by all cameras"


class Checks:
    """What was found: a line for each thing that is well, for each mistake, and for each doubt."""

    def __init__(self, report: Callable[[str], None]) -> None:
        """Start with nothing found; `report` is called with each line for what is well."""
        self.well: list[str] = []
        self.mistakes: list[str] = []
        self.doubts: list[str] = []  # what may be right, but makes frames uncertain or leaves little to be tracked
        self._report = report

    def add(self, line: str) -> None:
        """Note something that is well."""
        self.well.append(line)
        self._report(line)

    def attempt(self, read: Callable[[], _T], describe: Callable[[_T], str | None]) -> _T | None:
        """Read something and describe it, unless nothing is to be said; None where it has a mistake."""
        try:
            value = read()
        except MistakesError as error:
            self.mistakes += error.mistakes
        except AirborneError as error:
            self.mistakes.append(str(error))
        else:
            if (line := describe(value)) is not None:
                self.add(line)
            return value
        return None


def check_trial(path: Path, report: Callable[[str], None] = lambda line: None) -> Checks:
    """Read everything that a trial names, and track nothing; `report` is called with each line for what is well.

    Of tables with mistakes, what is left without them is read.
    """
    checks = Checks(report)
    trial = checks.attempt(lambda: parse_trial(path), lambda trial: f"{path.name}: {_describe(trial)}")
    remainder = Remainder(trial, has_body=True) if trial is not None else _read_remainder(path)
    if remainder is None:
        return checks
    trial = remainder.trial
    checks.mistakes += [f"{path.name}: {mistake}" for mistake in list_wrong_names(trial)]
    facts = _check_videos(checks, trial)
    checks.attempt(lambda: refuse_same_files(trial), lambda _: "videos: each camera has a file of its own")
    _check_files(checks, remainder, facts)
    if not checks.mistakes:
        _check_start(checks, trial, tuple(facts.values()))
    return checks


def _read_remainder(path: Path) -> Remainder | None:
    try:
        return parse_remainder(path)
    except TrialError:
        return None


def _check_videos(checks: Checks, trial: Trial) -> dict[str, VideoFacts]:
    """Inspect every video; return the facts of the good ones by camera."""
    found = {}
    for camera in trial.camera:
        facts = checks.attempt(
            partial(inspect, video_source(trial, camera)),
            lambda facts, name=camera.name: f"{name}: {_describe_video(facts)}",
        )
        if facts is not None:
            found[camera.name] = facts
            if facts.n_cut:
                checks.doubts.append(
                    f"camera '{camera.name}': {camera.video} is cut off before its last {count(facts.n_cut, 'image')}; "
                    "copy it again, or track without them"
                )
    return found


def _check_files(checks: Checks, remainder: Remainder, facts: dict[str, VideoFacts]) -> None:
    """Read the calibration, the body and the detections; those that do not exist are listed already."""
    trial = remainder.trial
    calibration, body, detections = trial.calibration, trial.body, trial.start.detections
    shown = trial.model_copy(update={"camera": [camera for camera in trial.camera if camera.name in facts]})
    if facts and _exists(trial, calibration.file or calibration.control_points):
        cameras = checks.attempt(
            lambda: read_or_calibrate(shown, facts), lambda cameras: f"calibration: {', '.join(cameras[0].names)}"
        )
        for warning in cameras[1].warnings if cameras is not None and cameras[1] is not None else ():
            checks.add(f"note: {warning}")
    if remainder.has_body and not trial.has_players and _exists(trial, body.source_file):
        model = checks.attempt(
            trial.model,
            lambda model: "; ".join([f"body: {model.name}, {count(len(model.segments), 'segment')}", *model.notes]),
        )
        for note in () if model is None else body.doubts(model):
            checks.add(f"note: {note}")
    if detections is not None and facts and _exists(trial, detections):
        checks.attempt(
            lambda: read_trial_detections(shown, tuple(facts.values())), lambda _: f"detections: {detections}"
        )
    if trial.lights is not None:
        checks.add(f"lights: {count(len(trial.lights.lamp), 'lamp')}, ambient {trial.lights.ambient:g}")


def _check_start(checks: Checks, trial: Trial, facts: Sequence[VideoFacts]) -> None:
    """Find the start in good files, and look whether there are frames to track."""
    opened = checks.attempt(lambda: open_trial(trial, facts), lambda opened: f"frames: {_count_frames(trial, opened)}")
    if opened is None:
        return
    recording = opened.recording
    if recording.n_frames == 0:
        checks.mistakes.append(str(past_the_end_error(trial, recording)))
        return
    with closing(iter(recording)) as frames:
        first = list(islice(frames, 1))
        if error := dark_start_error(trial, chain(first, frames)):
            checks.mistakes.append(str(error))
            return
    views = [view for each in first for view in each.views if view is not None]
    dark = [view.camera.name for view in views if is_dark(view, _DIM_LEVEL)]
    if dark:
        checks.doubts.append(
            f"the images of {', '.join(dark)} in frame {first[0].index} are black or nearly: brighten the video, start "
            "where it shows something, or leave the camera out"
        )
    for mask in trial.mask:
        if recording.n_images is not None and mask.first >= recording.n_images:
            checks.add(f"note: [[mask]] of {mask.camera} begins at frame {mask.first}, after the recording's end")
    if trial.key and not trial.has_players:
        checks.attempt(
            lambda: keys_of_frames(trial, trial.model(), recording),
            lambda keys: "; ".join([f"keys: {len(keys[0])} of {len(trial.key)} are used", *keys[1]]),
        )
    if trial.start.find:
        who = "players are" if trial.has_players else "body is"
        checks.attempt(
            lambda: require_two_cameras(trial),
            lambda _: f"start: not given; the {who} looked for when the trial is tracked",
        )
        if not trial.has_players and len(recording.rig) > 1:
            seen = checks.attempt(
                lambda: _look_for_mix_ups(trial, recording),
                lambda seen: None if seen.doubts else _ONE_BODY if seen.are_one_body else _UNDECIDED,
            )
            checks.doubts += [] if seen is None else seen.doubts
    elif trial.has_players:
        tracker = checks.attempt(
            lambda: players_tracker_of(trial, recording.rig),
            lambda _: f"start: frame {trial.start.frame}, {', '.join(player.name for player in trial.start.player)}",
        )
        if tracker is not None:
            starts = player_starts(trial, recording.rig)
            recording.events.extend(start_notes(starts))
            begun = next(iter(first), None)
            if len(recording.rig) > 1:
                checks.attempt(lambda: refuse_players_mix_ups(starts, begun), lambda _: _NO_MIX_UP)
            checks.doubts += list_doubts(doubt_starts(starts, begun))
    else:
        model = trial.model()
        found = checks.attempt(
            lambda: find_first_pose(trial, model, recording.rig, opened.detections),
            lambda found: "; ".join([f"start: frame {trial.start.frame}", *found.plain_notes]),
        )
        checks.doubts += [] if found is None else [*found.doubts, *found.size_notes]
        if found is not None and trial.start.detections is None:  # a network's mistakes are not the user's
            checks.mistakes += [f"{trial.name}: {mistake}" for mistake in found.mistakes]
        unseen = out_of_sight(model.with_pose(found.pose), recording.rig) if found is not None else ""
        if unseen == OUT_OF_SIGHT:
            checks.mistakes.append(f"{trial.name}: {unseen}")
        elif found is not None:
            if unseen:
                checks.add(f"note: {unseen}")
            if len(recording.rig) > 1:
                with start_foregrounds(recording) as foregrounds:
                    seen = recording.rig, list(foregrounds), model, found.pose
                    checks.attempt(
                        lambda: refuse_mix_ups(*seen),
                        lambda _: _UNDECIDED if find_undecided_mix_ups(*seen) else _NO_MIX_UP,
                    )
                silhouettes = look_at_silhouettes(trial, recording)
                checks.doubts += [*filter(None, [silhouettes.mix_up]), *silhouettes.doubts]
    for event in recording.events:
        checks.add(f"note: {event}")


def _look_for_mix_ups(trial: Trial, recording: Recording) -> MovingSilhouettes:
    """Return what the silhouettes of what moves say; raises MistakesError where they speak of a mix-up."""
    silhouettes = look_at_silhouettes(trial, recording)
    refuse_moving_mix_ups(silhouettes)
    return silhouettes


def _exists(trial: Trial, name: str | None) -> bool:
    return name is None or trial.path(name).exists()


def _count_frames(trial: Trial, opened: Opened[Recording]) -> str:
    n = replace(opened.recording, start=trial.first_frame).n_frames
    return "to the videos' end" if n is None else f"{n} to track"


def _describe(trial: Trial) -> str:
    return f"{trial.name}, {count(len(trial.camera), 'camera')}, method {trial.track.method}"


def _describe_video(facts: VideoFacts) -> str:
    width, height = facts.size
    return f"{width}×{height} px, {float(facts.image_rate):.5g} images/s, {facts.fields}"
