"""One recording from files, or live, to results: the loop over its frames, the same for a body and for players."""

from __future__ import annotations

import time
from array import array
from contextlib import ExitStack, closing
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from airborne.cameras import write_pose2sim
from airborne.errors import ResultError
from airborne.export import write_json
from airborne.export.overlays import OverlaysAs
from airborne.export.players_notes import players_warnings
from airborne.export.summary import joint_warnings
from airborne.io.figures import names_not_drawn
from airborne.io.folder_lock import sole_writer
from airborne.motion import Motion, PlayersMotion, read_motion, read_players
from airborne.motion.run_folder import CALIBRATION, EXPORTS, JOINTS, MOTION, REPORT, SUMMARY, read_summary
from airborne.run.body import BodyRun
from airborne.run.corrections import corrections_of, lost_keys
from airborne.run.drawing import DrawingThread
from airborne.run.folder import is_finished, list_tables, prepare_folder, read_choice, refuse_full_folder
from airborne.run.identity import run_identity
from airborne.run.mix_ups import refuse_mix_ups, refuse_same_files, start_foregrounds
from airborne.run.opening import Opened, dark_start_error, open_live, open_trial, past_the_end_error
from airborne.run.provenance import provenance_of
from airborne.run.self_check import alarms
from airborne.run.subject import AnyMotion, Subject
from airborne.tracking.tracker import Found
from airborne.trial.file import Trial
from airborne.types import Progress, StageProgress
from airborne.video import LiveRecording, Outages, Recording

if TYPE_CHECKING:
    from airborne.run.players import PlayersRun

_SEARCH = "looking for the start"  # a stage


@dataclass(frozen=True, slots=True, eq=False)
class TrackResult:
    """The results of a finished run; its folder holds the same."""

    motion: Motion | PlayersMotion
    summary: dict[str, Any]
    was_finished: bool = False  # resumed although nothing was left to do


def track_trial(
    trial: Trial,
    folder: Path,
    *,
    resume: bool = False,
    overwrite: bool = False,
    live: bool = False,
    pictures: bool = True,
    first_frame: bool = False,
    take: int | None = None,
    progress: Progress | None = None,
    stage_progress: StageProgress | None = None,
) -> TrackResult:
    """Track a trial, a body or players, and write the results into a folder.

    `resume` continues a run that was killed, to the same result; of players by tracking again from the start, their
    rows stay. Where [[key]] tables have changed since, the frames between the keys beside them are tracked again. A run
    that is finished stays as it is, unless pictures are still to be drawn.
    `live`, for players, reads pipes, capture devices, or files at their own speed, drops frames rather than fall
    behind, and ends with them or with KeyboardInterrupt. `pictures=False` leaves out videos, figures and report.
    `overwrite` replaces the run that the folder holds. `first_frame` tracks one frame and draws it, without a report.
    `take` chooses one of the poses that were found, from 1, where the trial leaves its start to be found;
    `stage_progress` hears of what goes on before and after the frames are tracked, else `progress` does.
    Raises an AirborneError for input that cannot be used, and for a folder that holds another run.
    """
    if live and resume:
        raise ResultError("a live run cannot be resumed: its frames are gone; track into a new folder")
    if live and not trial.has_players:
        raise ResultError('--live is for players; this trial has no body preset = "legs"')
    if live and trial.mask:
        raise ResultError("a live run does not know its frames beforehand; remove [[mask]]")
    if live and first_frame:
        raise ResultError("a live run has no first frame to come back to; leave --live or --first-frame out")
    if overwrite and resume:
        raise ResultError("a run is either resumed or overwritten (--resume, --overwrite); choose one")
    if not live:
        refuse_same_files(trial)
    if live and trial.start.find:
        raise ResultError("a live run looks for nobody; give [[start.player]] tables")
    if resume and take is None and trial.start.find:
        take = read_choice(folder)
    if take is not None and not trial.start.find:
        raise ResultError("--take chooses between poses that were found; this trial's [start] says where the body is")
    started_s = time.monotonic()
    with sole_writer(folder), ExitStack() as stack:  # from the beginning: to find the start takes its time
        refuse_full_folder(folder, JOINTS if trial.has_players else MOTION, resume=resume, overwrite=overwrite)
        drawn = None if not pictures else "stills" if first_frame else "videos"
        options = _Options(
            folder, started_s, resume, overwrite, live, first_frame, drawn, take, progress, stage_progress
        )
        if trial.has_players:
            return _run(_open_players(trial, options, stack), options, stack)
        return _run(_open_body(trial, options), options, stack)


@dataclass(frozen=True, slots=True)
class _Options:
    folder: Path
    started_s: float
    resume: bool
    overwrite: bool
    live: bool
    first_frame: bool  # is tracked alone
    drawn: OverlaysAs | None  # None: no pictures
    take: int | None  # of the poses that were found
    progress: Progress | None
    stage_progress: StageProgress | None

    def of_stage(self, stage: str) -> Progress | None:
        """Return what a stage before or after the tracking reports its progress to."""
        return self.progress if self.stage_progress is None else partial(self.stage_progress, stage)

    def shorten(self, trial: Trial) -> Trial:
        """Return the trial with the frames that are tracked."""
        if not self.first_frame:
            return trial
        alone = {"start": None, "stop": trial.start.frame + 1}
        return trial.model_copy(update={"track": trial.track.model_copy(update=alone)})


def _open_body(trial: Trial, options: _Options) -> BodyRun:
    """Open a trial of one body, whose start may have to be found."""
    found = None
    if trial.start.find:
        from airborne.run.find import find_start

        found = find_start(trial, options.folder, take=options.take, progress=options.of_stage(_SEARCH))
        trial = found.trial
    trial = options.shorten(trial)
    opened = open_trial(trial, None if found is None else found.facts)
    with start_foregrounds(opened.recording) as foregrounds:
        body = BodyRun.open(trial, opened, found)
        refuse_mix_ups(body.recording.rig, foregrounds, body.model, body.start)
    return body


def _open_players(trial: Trial, options: _Options, stack: ExitStack) -> PlayersRun:
    """Open a trial of players, whose start may have to be found; live cameras stay open for as long as the stack is."""
    from airborne.run.players import PlayersRun
    from airborne.run.players_mix_ups import refuse_players_mix_ups

    found = None
    if trial.start.find:
        from airborne.run.find_players import find_players_start

        found = find_players_start(trial, options.folder, take=options.take, progress=options.of_stage(_SEARCH))
        trial = found.trial
    trial = options.shorten(trial)
    facts = None if found is None else found.facts
    opened = _open_live(trial, stack, options.progress) if options.live else open_trial(trial, facts)
    opened.recording.events.extend([] if found is None else found.notes)
    players = PlayersRun.open(trial, opened)
    if isinstance(opened.recording, Recording):
        with closing(iter(opened.recording)) as frames:
            refuse_players_mix_ups(players.starts, next(frames, None))
    return players


def _run(subject: Subject[Found, AnyMotion], options: _Options, connection: ExitStack) -> TrackResult:
    """Track an opened subject and write its results; the connection to live cameras ends with the tracking."""
    folder, recording = options.folder, subject.recording
    identity = run_identity(subject.trial, live=options.live, take=options.take)
    if options.resume and (finished := _read_finished_run(folder, identity, subject.table, options.drawn)):
        return finished
    goes_on = prepare_folder(folder, identity, subject.table, resume=options.resume, overwrite=options.overwrite)
    write_pose2sim(folder / CALIBRATION, recording.rig)
    read_s = time.monotonic()
    subject, delays_s = _track(subject, options, resume=goes_on)
    connection.close()
    tracked_s = time.monotonic()
    motion, summary = subject.finish(folder, options.drawn, options.of_stage)
    summary |= corrections_of(subject.trial, motion.index.tolist())
    warnings = summary.pop("warnings", [])  # of finishing
    summary |= provenance_of(subject.trial, recording, subject.calibration, identity["inputs"])
    summary["warnings"] += [
        *subject.warnings(),
        *warnings,
        *lost_keys(subject.trial, motion),
        *joint_warnings(summary.get("joint_statuses", {})),
        *players_warnings(summary),
        *alarms(summary.get("self_check", [])),
    ]
    if (folder / EXPORTS).is_dir():
        summary["warnings"].append(f"{EXPORTS}/ is of the run before; `airborne export` writes it anew")
    if options.drawn is not None:
        summary["events"] += names_not_drawn([subject.trial.name, *recording.rig.names, *subject.names])
    summary["tables"] = list_tables(folder)
    if isinstance(recording, LiveRecording):
        summary["live"] = {
            "cameras": recording.image_counts(),
            "median_delay_s": float(np.median(delays_s)),
            "largest_delay_s": max(delays_s),
        }
    stages_s = summary.pop("timings_s", {})  # of finishing
    summary["timings_s"] = {
        "opening": read_s - options.started_s,
        "tracking": tracked_s - read_s,
        **stages_s,
        "writing": time.monotonic() - tracked_s - sum(stages_s.values()),
        "tracking_a_frame": (tracked_s - read_s) / len(motion),
    }
    write_json(folder / SUMMARY, summary)
    if options.drawn == "videos":
        subject.write_report(folder, summary, motion)
    return TrackResult(motion, summary)


def _read_finished_run(
    folder: Path, identity: dict[str, Any], table: str, drawn: OverlaysAs | None
) -> TrackResult | None:
    """Return the run that a folder holds; None where something is still to be tracked or drawn."""
    if not is_finished(folder, identity) or (drawn is not None and not (folder / REPORT).is_file()):
        return None
    motion = (read_motion if table == MOTION else read_players)(folder / table)
    summary = read_summary(folder)
    return TrackResult(motion, summary, was_finished=True) if len(motion) == summary["n_frames"] else None


def _open_live(trial: Trial, stack: ExitStack, progress: Progress | None) -> Opened[LiveRecording]:
    """Open a trial's live cameras for as long as the stack is."""
    from airborne.run.players_tracker import compile_kernels

    compile_kernels(trial)
    return stack.enter_context(open_live(trial, (lambda: None) if progress is None else (lambda: progress(0, None))))


def _track(
    subject: Subject[Found, AnyMotion], options: _Options, *, resume: bool
) -> tuple[Subject[Found, AnyMotion], array[float]]:
    """Track every frame, written and drawn at once; return the subject as seen, and live frames' delays [s]."""
    folder, drawn, recording = options.folder, options.drawn, subject.recording
    delays_s = array("d")
    outages = Outages(recording.rig.names, {name: subject.trial.mask_stretches(name) for name in recording.rig.names})
    with ExitStack() as stack:
        frames = stack.enter_context(closing(iter(recording)))
        first = next(frames, None)
        if first is None:
            raise past_the_end_error(subject.trial, recording)
        if error := dark_start_error(subject.trial, chain([first], frames)):
            raise error
        if options.progress is not None:
            options.progress(0, subject.n_frames)  # seeing a person takes seconds
        subject = subject.see(first)
        subject.copy_inputs(folder)
        done = subject.read_done(folder) if resume else {}
        writer = stack.enter_context(subject.writer(folder, resume=resume))
        artists = [stack.enter_context(artist) for artist in subject.artists(folder, drawn)] if drawn else []
        drawing = stack.enter_context(DrawingThread(partial(subject.draw, artists))) if drawn else None

        most = 0

        def tick(n_done: int) -> None:
            nonlocal most
            most = max(most, n_done)  # gone over in both directions, frames are counted before they are yielded
            if options.progress is not None:
                options.progress(most, subject.n_frames)

        tracked = subject.track(chain([first], frames), partial(subject.write, writer), done, tick)
        try:
            for number, (observed, estimate) in enumerate(tracked, start=1):
                if isinstance(recording, LiveRecording):
                    delays_s.append(time.monotonic() - recording.arrival_s)
                outages.add(observed)
                subject.keep(observed)
                if drawing is not None:
                    drawing.put(observed, estimate)
                tick(number)
        except KeyboardInterrupt:
            if not delays_s:  # only a live run ends like this
                raise
    recording.events.extend(outages.describe())
    return subject, delays_s
