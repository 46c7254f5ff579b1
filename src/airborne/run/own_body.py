"""A person's own body from a trial: detections -> a few frames -> `fit_body` -> a body file and an image."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airborne.body import BodyModel, Pose, surface_arrays
from airborne.body.files import write_body
from airborne.body.inverse_kinematics import CORE
from airborne.body.shaping import with_segment_lengths
from airborne.body.sides import without_side
from airborne.body_fitting.checks import (
    check_joints,
    check_lengths,
    height_ratio,
    length_ratios,
    person_of_shares,
    points_of_lengths,
)
from airborne.body_fitting.fit import BodyFit, BodyObservation, fit_body, measure_lengths
from airborne.cameras import Rig
from airborne.cameras.detections import landmarks_from_points
from airborne.errors import BodyError, TrialError
from airborne.export.mosaic import ColumnTitle, draw_mosaic
from airborne.export.pictures import encode_png
from airborne.export.views import crop_camera, resample_view
from airborne.io.writing import missing_folder
from airborne.rendering import FLAT, render
from airborne.run.body_clicks import Clicks
from airborne.run.detections import landmarks_over_time
from airborne.run.first_pose import find_first_pose
from airborne.run.landmarks import read_joint_positions, triangulate_clicks
from airborne.run.mix_ups import refuse_mix_ups, refuse_same_files, start_foregrounds
from airborne.run.opening import Opened, open_trial
from airborne.tracking.first_pose import LANDMARK_WEIGHTS
from airborne.trial.file import Trial
from airborne.trial.keys import KeyTable
from airborne.trial.start import StartTable
from airborne.types import Array, Image, StageProgress
from airborne.video import Frames, Recording

_N_SCENERY = 10  # further frames that show the scene without the person
PICTURE = "fit_body.png"
_CELL_PX, _CELL_SCALE = 400, 0.4  # a cell of the image, and its pixel size in pixels of `crop_camera`
_LINE_RGB = (255, 230, 0)  # sRGB of the outline


@dataclass(frozen=True, slots=True, eq=False)
class PersonFit:
    """The result of fitting a body to a trial's person."""

    fit: BodyFit
    frames: tuple[int, ...]  # that it was fitted to
    picture: Path
    notes: tuple[str, ...] = ()  # of the input, and on what looks unusual, one line each


def fit_person(
    trial: Trial,
    output: Path,
    *,
    n_frames: int = 5,
    skeleton: str | None = None,
    progress: StageProgress | None = None,
) -> PersonFit:
    """Fit a trial's body to the person in its images; write the body file, and beside it `fit_body.png`.

    The joints come from the detections of the trial's [start], or from the joints_m or points_px of it and of the keys,
    for one frame each; `skeleton` says
    whose points the detections are where neither the trial nor their files do.
    Raises an AirborneError for input that cannot be used.
    """
    if n_frames < 1:
        raise TrialError(f"frames is {n_frames}; expected at least 1 frame to fit the body to")
    if not output.absolute().parent.is_dir():
        raise TrialError(missing_folder(output))
    if skeleton is not None:
        if trial.start.detections is None:
            raise TrialError(f"{trial.name}: skeleton goes with detections under [start]; the trial has none")
        trial = trial.model_copy(update={"start": trial.start.model_copy(update={"skeleton": skeleton})})
    report = progress or (lambda what, done, total: None)
    model = trial.model()
    opened = open_trial(trial)
    recording = opened.recording
    landmarks = _landmarks_by_frame(trial, opened)
    chosen, around = _choose_frames(trial, landmarks, n_frames)
    _refuse_mix_ups(trial, opened, model)
    clicks = None if opened.detections is None else Clicks.of(recording, opened.detections, chosen)
    look, notes = (lambda points: "", []) if clicks is None else (clicks.camera_to_check, clicks.notes)
    shares, points = model if trial.body.preset else person_of_shares(model), points_of_lengths(model)
    try:
        measured = with_segment_lengths(model, measure_lengths(model, [landmarks[index] for index in chosen]))
        check_lengths(length_ratios(measured, shares), points, look, height_ratio(measured, shares))
        observations = _read(recording, landmarks, sorted({*chosen, *around}), report)
        missing = [index for index in chosen if index not in observations]
        if missing:
            raise TrialError(f"{trial.name}: the videos end before frame {missing[0]}, which has detections")
        fit = fit_body(
            model,
            [observations[index] for index in chosen],
            scenery=[observations[index] for index in around if index in observations],
            weights=LANDMARK_WEIGHTS,
            mass_kg=trial.body.mass_kg,
            progress=lambda done, total: report("fitting", done, total),
        )
        seen = [observations[index].landmarks for index in chosen]
        warnings = check_joints(fit.model, fit.poses, seen, weights=LANDMARK_WEIGHTS, frames=chosen, look=look)
        warnings += check_lengths(length_ratios(fit.model, shares), points, look, height_ratio(fit.model, shares))
        warnings += trial.body.doubts(fit.model)
    except BodyError as error:
        raise BodyError("; ".join([f"{trial.name}: {error}", *trial.body.doubts(model), *recording.events])) from error
    picture = output.with_name(PICTURE)
    write_body(output, fit.model)
    picture.write_bytes(_contact_sheet(fit, [observations[index].frames for index in chosen], recording.rig))
    return PersonFit(
        fit, tuple(chosen), picture, tuple(dict.fromkeys([*model.notes, *recording.events, *notes, *warnings]))
    )


def _refuse_mix_ups(trial: Trial, opened: Opened[Recording], model: BodyModel) -> None:
    """Raise MistakesError where videos are mixed up, as where the trial is tracked."""
    refuse_same_files(trial)
    if not trial.start.find:
        rig = opened.recording.rig
        first = find_first_pose(trial, model, rig, opened.detections)
        with start_foregrounds(opened.recording) as foregrounds:
            refuse_mix_ups(rig, foregrounds, model, first.pose)


def describe_fit(person: PersonFit) -> str:
    """Describe a fitted body in a few lines."""
    fit = person.fit
    lines = [f"fitted to frames {', '.join(map(str, person.frames))}", "segment     length  girth (two across)"]
    for stem, length in fit.lengths.items():
        wide, deep = fit.girths[stem]
        girth = f"{wide:.2f}" if wide == deep else f"{wide:.2f} {deep:.2f}"
        lines.append(f"{stem:<12}{length:5.2f}   {girth}")
    widths = [f"{joint}s {ratio:.2f}" for joint, ratio in fit.joint_widths.items()]
    lines.append(f"distance of left and right joints: {', '.join(widths)}")
    borders = [f"{stem} at {border.share:.2f}" for stem, border in fit.borders.items()]
    lines.append(f"colours change along: {', '.join(borders) or 'no segment'}")
    colours: dict[str, str] = {}
    for part in fit.model.parts:
        if part.colour is not None:
            colours[without_side(part.name)] = " ".join(f"{value:.0f}" for value in part.colour)
    lines.append("sRGB: " + "; ".join(f"{name} {colour}" for name, colour in colours.items()))
    before, after = fit.rms_light
    lines.append(f"residual: {before * 255:.2f} to {after * 255:.2f} (linear light, 0 to 255)")
    before, after = fit.landmark_rms_m
    lines.append(f"joints: {before * 1e3:.0f} to {after * 1e3:.0f} mm off (RMS)")
    return "\n".join([*lines, *(f"note: {note}" for note in person.notes)])


def _landmarks_by_frame(trial: Trial, opened: Opened[Recording]) -> dict[int, dict[str, Array]]:
    """Return the landmarks of each frame of the recording: frame -> landmark -> (3,) [m]."""
    recording = opened.recording
    if opened.detections is not None:
        over_time = landmarks_over_time(recording.rig, opened.detections)
        facts, n = recording.facts[0], len(next(iter(over_time.values())))
        per_frame = round(facts.image_rate / facts.frame_rate)
        stop = n * per_frame if trial.track.stop is None else min(n * per_frame, trial.track.stop)
        indices = range(trial.start.frame, stop, trial.track.every * per_frame)
        at = {
            index: {name: positions[index // per_frame] for name, positions in over_time.items()} for index in indices
        }
        return {
            index: {name: position for name, position in positions.items() if np.isfinite(position).all()}
            for index, positions in at.items()
        }
    given = {forms.frame: _landmarks_of(trial, forms, recording.rig) for forms in (trial.start, *trial.key)}
    known = {frame: landmarks for frame, landmarks in given.items() if landmarks}
    if not known:
        raise TrialError(
            f"{trial.name}: fitting the body needs known joints; give detections, joints_m or points_px under [start] "
            "or [[key]]"
        )
    return known


def _landmarks_of(trial: Trial, forms: StartTable | KeyTable, rig: Rig) -> dict[str, Array]:
    """Return the landmarks that a start or a key gives in metres or clicked in two cameras; none of other forms."""
    if forms.joints_m is not None:
        names, points = read_joint_positions(trial, forms.joints_m)
        return dict(zip(names, points, strict=True))
    if forms.points_px is not None:
        return landmarks_from_points(*triangulate_clicks(trial, forms.points_px, rig, f"frame {forms.frame}"))
    return {}


def _choose_frames(trial: Trial, landmarks: dict[int, dict[str, Array]], n: int) -> tuple[list[int], list[int]]:
    """Choose frames spread over the recording, each with the most landmarks of its stretch; more for the background."""
    usable = [index for index, positions in landmarks.items() if set(CORE) <= set(positions)]
    if not usable:
        raise TrialError(f"{trial.name}: no frame has both hips and both shoulders seen by two cameras that agree")
    stretches = [stretch for stretch in np.array_split(np.array(usable), min(n, len(usable))) if len(stretch)]
    chosen = []
    for stretch in stretches:
        middle = stretch[len(stretch) // 2]
        chosen.append(int(max(stretch, key=lambda index: (len(landmarks[int(index)]), -abs(int(index) - int(middle))))))
    rest = [index for index in usable if index not in chosen]
    around = [rest[i] for i in np.unique(np.linspace(0, len(rest) - 1, _N_SCENERY).round().astype(int))] if rest else []
    return chosen, around


def _read(
    recording: Recording, landmarks: dict[int, dict[str, Array]], indices: Sequence[int], progress: StageProgress
) -> dict[int, BodyObservation]:
    observations = {}
    with closing(iter(recording)) as stream:
        for frames in stream:
            if frames.index in indices:
                observations[frames.index] = BodyObservation(frames, landmarks[frames.index])
                progress("reading", len(observations), len(indices))
            if frames.index >= indices[-1]:
                break
    return observations


def _contact_sheet(fit: BodyFit, frames: Sequence[Frames], rig: Rig) -> bytes:
    """Draw the fitted body over every image used, as a PNG: rows are times, columns cameras, both with their names."""
    rows = [
        [_cell(each, i, fit.model, pose) for i in range(len(rig))] for each, pose in zip(frames, fit.poses, strict=True)
    ]
    titles, names = [ColumnTitle(name) for name in rig.names], [f"frame {each.index}" for each in frames]
    return encode_png(draw_mosaic(rows, names, titles, cell_px=(_CELL_PX, _CELL_PX)))


def _cell(frames: Frames, camera: int, model: BodyModel, pose: Pose) -> Image | None:
    """Draw one camera's image around the body, with lines where parts border on each other or on the scene, if any."""
    view, posed = frames.views[camera], model.with_pose(pose)
    crop = None if view is None else crop_camera(view.camera, posed)
    if view is None or crop is None:
        return None
    middle = (_CELL_SCALE - 1) / 2
    larger = crop.resample(scale=(_CELL_SCALE, _CELL_SCALE), offset=(middle, middle), size=(_CELL_PX, _CELL_PX))
    image = resample_view(view, larger)
    part = render(surface_arrays(model), posed, larger, FLAT).part
    edge = np.zeros(part.shape, bool)
    edge[1:] |= part[1:] != part[:-1]
    edge[:, 1:] |= part[:, 1:] != part[:, :-1]
    image[edge] = _LINE_RGB
    return image
