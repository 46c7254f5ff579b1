"""Opening a trial: every file once, and what was found in it as a value."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import combinations, takewhile
from typing import Generic, TypeVar

import numpy as np

from airborne.calibration.acceptance import require_plausible
from airborne.calibration.diagnosis import is_turned
from airborne.calibration.from_points import Calibration, calibrate
from airborne.calibration.sources.control_points import read_control_points
from airborne.cameras import Camera, Rig, read_rig
from airborne.errors import TrialError
from airborne.run.detections import TrialDetections, read_trial_detections, resect_moved_cameras
from airborne.tracking.methods import FIELD_MODES
from airborne.trial.cameras import CameraTable
from airborne.trial.file import Trial
from airborne.video import (
    Frames,
    LiveRecording,
    Recording,
    VideoFacts,
    VideoSource,
    connect,
    inspect,
    live_recording,
    open_recording,
)
from airborne.video.containers import ADDRESS
from airborne.video.outages import is_dark

# shares of the calibration's image, chosen: how far a video may reach beyond it, as one of all of a sensor of which
# a part was calibrated, and how much of it a video shows at least; one said to be twice as large as it is does not pass
_BEYOND, _LEAST_SHARE = 0.5, 0.1

_SHARES = (2, 3, 4)  # chosen: of images that are left out evenly: every second, two of three, three of four
_OTHER_RATE = 0.005  # chosen: of the usual rate; 59.94 and 60 images a second differ by a thousandth
_UNEQUAL = 0.05  # chosen: of the first camera's duration; cameras stopped one after the other differ by less
_FEWEST_IMAGES = 10  # chosen: of a video whose length says something

AnyRecording = TypeVar("AnyRecording", bound=Recording | LiveRecording, covariant=True)


@dataclass(frozen=True, slots=True, eq=False)
class Cameras:
    """The cameras of a trial's videos, and what they come from."""

    rig: Rig  # in the trial's order, resected where the trial asks for it
    calibration: Calibration | None  # if it was made from control points
    detections: TrialDetections | None
    facts: tuple[VideoFacts, ...]
    notes: tuple[str, ...]  # of the resection


@dataclass(frozen=True, slots=True, eq=False)
class Opened(Generic[AnyRecording]):
    """A trial's recording, and what was read to open it."""

    recording: AnyRecording
    calibration: Calibration | None = None
    detections: TrialDetections | None = None


def open_trial(trial: Trial, facts: Sequence[VideoFacts] | None = None) -> Opened[Recording]:
    """Open a trial's videos with its cameras, fields as its method takes them.

    Images are converted lazily, only in the regions that are used, but for fields whose missing rows are interpolated.
    `facts` are the videos', where `inspect` has been called before.
    """
    fields_as = "rows" if trial.has_players else FIELD_MODES[trial.settings.method]
    sources = [video_source(trial, camera) for camera in trial.camera]
    if all(source.is_left_out(trial.start.frame) for source in sources):
        raise TrialError(
            f"{trial.name}: [[mask]] leaves every camera out at start.frame = {trial.start.frame}; leave one of them in"
        )
    cameras = open_cameras(trial, facts)
    recording = open_recording(
        sources,
        cameras.rig,
        facts=cameras.facts,
        fields_as=fields_as,
        every=trial.track.every,
        start=trial.start.frame,
        stop=trial.track.stop,
        lazy=fields_as == "rows",
    )
    videos = recording.rig.names, cameras.facts
    recording.events.extend([*cameras.notes, *fewer_images(*videos), *other_rates(*videos)])
    if not any(camera.offset_s for camera in trial.camera):  # else somebody has said that cameras began apart
        recording.events.extend(shorter_videos(*videos))
    n, stop = recording.n_images, trial.track.stop
    if n is not None and stop is not None and stop > n:
        recording.events.append(f"track.stop = {stop} lies past the end: the last frame is {n - 1}")
    return Opened(recording, cameras.calibration, cameras.detections)


def fewer_images(names: Sequence[str], facts: Sequence[VideoFacts]) -> list[str]:
    """Return, as sentences, which videos are a half, third or fourth as long as most, as where images are left out."""
    durations_s = [each.duration_s for each in facts if each.duration_s is not None]
    if not durations_s:
        return []
    usual_s = sorted(durations_s)[len(durations_s) // 2]
    notes = []
    for name, each in zip(names, facts, strict=True):
        if each.duration_s is None or each.duration_s * each.frame_rate < _FEWEST_IMAGES:
            continue
        share = round(usual_s / each.duration_s)
        if share in _SHARES and abs(share * each.duration_s - usual_s) <= share / each.frame_rate:  # to an image
            stated, true = float(each.frame_rate), float(each.frame_rate / share)
            notes.append(
                f"{name}: its video lasts 1/{share} as long as most, {float(each.duration_s):.2f} s of "
                f"{float(usual_s):.2f}, at its stated {stated:.5g} images/s: it ended earlier, or its images come at "
                f"{true:.5g} a second, and all but its first are shown too early; write it anew with the rate it has"
            )
    return notes


def other_rates(names: Sequence[str], facts: Sequence[VideoFacts]) -> list[str]:
    """Return, as sentences, which videos state another rate than most, and where that is surely wrong."""
    usual = sorted(facts, key=lambda each: each.image_rate)[len(facts) // 2]
    notes = []
    for name, each in zip(names, facts, strict=True):
        if abs(each.image_rate / usual.image_rate - 1) <= _OTHER_RATE:
            continue
        has_same = _n_pictures(each) is not None and _n_pictures(each) == _n_pictures(usual)
        notes.append(
            f"{name}: {float(each.image_rate):.5g} images/s are stated, of other cameras {float(usual.image_rate):.5g}"
            + (", and it has as many images as they: its rate is wrong, unless it ended earlier" if has_same else "")
            + "; if it was filmed at their rate, write the video anew with that"
        )
    return notes


def shorter_videos(names: Sequence[str], facts: Sequence[VideoFacts]) -> list[str]:
    """Return, as sentences, which videos are shorter than the first camera's, as where they began later."""
    first_s, notes = facts[0].duration_s, []
    for name, each in zip(names[1:], facts[1:], strict=True):
        if first_s is None or each.duration_s is None or has_fewer_seconds_by_rate(each, facts[0]):
            continue
        if first_s - each.duration_s > _UNEQUAL * first_s:
            notes.append(
                f"the video of {name} is {float(first_s - each.duration_s):.2f} s shorter than that of {names[0]}: if "
                "it began later, `airborne sync` finds by how much"
            )
    return notes


def has_fewer_seconds_by_rate(facts: VideoFacts, usual: VideoFacts) -> bool:
    """Whether a video lasts less than another of as many pictures, as by a wrong rate."""
    return facts.image_rate > usual.image_rate and _n_pictures(facts) == _n_pictures(usual)


def _n_pictures(facts: VideoFacts) -> int | None:
    return None if facts.duration_s is None else round(facts.duration_s * facts.frame_rate)


@contextmanager
def open_live(trial: Trial, waiting: Callable[[], None] = lambda: None) -> Iterator[Opened[LiveRecording]]:
    """Connect to a trial's live cameras and find where they are; `waiting` is called until all deliver frames."""
    with connect([video_source(trial, camera) for camera in trial.camera], waiting) as cameras:
        facts = {camera.source.name: camera.facts for camera in cameras if camera.facts is not None}
        rig, calibration = read_or_calibrate(trial, facts)
        recording = live_recording(
            cameras, rig, every=trial.track.every, start=trial.start.frame, stop=trial.track.stop
        )
        yield Opened(recording, calibration)


def open_cameras(trial: Trial, facts: Sequence[VideoFacts] | None = None) -> Cameras:
    """Inspect a trial's videos and read its cameras and detections, each once."""
    facts = tuple(facts or (inspect(video_source(trial, camera)) for camera in trial.camera))
    facts_of = {camera.name: each for camera, each in zip(trial.camera, facts, strict=True)}
    rig, calibration = read_or_calibrate(trial, facts_of)
    detections = read_trial_detections(trial, facts)
    notes: tuple[str, ...] = ()
    if detections is not None:
        rig, notes = resect_moved_cameras(rig, detections, trial.calibration.mend)
    return Cameras(rig, calibration, detections, facts, notes)


def read_or_calibrate(trial: Trial, facts: Mapping[str, VideoFacts]) -> tuple[Rig, Calibration | None]:
    """Return the calibrated cameras of videos, by camera."""
    sizes = {name: each.size for name, each in facts.items()}
    if trial.calibration.control_points is not None:
        points = read_control_points(trial.path(trial.calibration.control_points))
        missing = [name for name in sizes if name not in points.cameras]
        if missing:
            raise TrialError(
                f"{trial.calibration.control_points} has no points clicked in {', '.join(missing)}; "
                f"it has: {', '.join(points.cameras)}"
            )
        points = points.select(list(sizes))
        for camera, px in zip(points.cameras, np.moveaxis(points.px, 1, 0), strict=True):
            if is_turned(px, sizes[camera]):
                raise _rotation_error(trial, camera, facts[camera])
        calibration = calibrate(points, sizes, method=trial.calibration.method)
        require_plausible(calibration)
        return calibration.rig, calibration
    rig = read_rig(trial.path(trial.calibration.file or ""))
    cameras = tuple(_camera_as_saved(rig, camera, sizes[camera.name]) for camera in trial.camera)
    for a, b in combinations(cameras, 2):
        if np.array_equal(a.camera_from_world.as_matrix(), b.camera_from_world.as_matrix()):
            raise TrialError(
                f"cameras {a.name} and {b.name} have the same place and turn in {trial.calibration.file}; each needs a "
                "calibration of its own"
            )
    return Rig(cameras), None


def _rotation_error(trial: Trial, camera: str, facts: VideoFacts) -> TrialError:
    """Return the error of a video that lies on its side in comparison with its camera's control points."""
    width, height = facts.size
    flag = f", by the flag in the file that turns it by {facts.rotation_deg} degrees" if facts.rotation_deg else ""
    mend = "take the flag out of the file" if facts.rotation_deg else "write the video anew, upright"
    return TrialError(
        f"camera '{camera}': its video is {width}×{height} px{flag}, but {trial.calibration.control_points} was "
        f"clicked in pictures of {height}×{width}: one of them is turned by 90 degrees; {mend}, or click anew in "
        "the pictures that `airborne studio` shows"
    )


def _camera_as_saved(rig: Rig, table: CameraTable, size: tuple[int, int]) -> Camera:
    """Return a calibrated camera as the camera of its video's own pixels."""
    name = table.calibrated_as or table.name
    if name not in rig.names:
        raise TrialError(
            f"the calibration file has no camera '{name}'; it has: {', '.join(rig.names)}; say which of them the "
            "video is of: calibrated_as under [[camera]]"
        )
    camera = replace(rig[name], name=table.name)
    du, dv = table.saved_offset_px
    if table.saved_scale == 1 and (du, dv) == (0, 0):
        return camera
    _refuse_outside(camera, table, size)
    saved = camera.resample(scale=(table.saved_scale, table.saved_scale), offset=(du, dv), size=size)
    return replace(saved, shift_sd_px=camera.shift_sd_px / table.saved_scale)


def _refuse_outside(camera: Camera, table: CameraTable, size: tuple[int, int]) -> None:
    """Raise TrialError where a video is said to lie beside the calibration's image, or in a scrap of it."""
    calibrated, scale = np.array(camera.size), table.saved_scale
    low, high = (scale * (np.array(corner) - 0.5) + table.saved_offset_px + 0.5 for corner in ((0, 0), size))
    is_inside = np.all((low > -_BEYOND * calibrated) & (high < (1 + _BEYOND) * calibrated))
    if not is_inside or np.any(high - low < _LEAST_SHARE * calibrated):
        (x0, y0), (x1, y1), (width, height) = np.rint([low, high, calibrated]).astype(int)
        raise TrialError(
            f"camera '{table.name}': saved_scale = {scale:g} takes its {size[0]}×{size[1]} px to columns {x0} to "
            f"{x1} and rows {y0} to {y1} of the calibration's {width}×{height} px; correct saved_scale or "
            "saved_offset_px"
        )


def video_source(trial: Trial, camera: CameraTable) -> VideoSource:
    """Return a camera's video: a file, or the address of a camera on the network."""
    path = camera.video if camera.video.startswith(ADDRESS) else trial.path(camera.video)
    times = camera.offset_s, camera.drift_ppm, camera.exposure_s
    return VideoSource(camera.name, path, camera.fields, *times, trial.mask_stretches(camera.name))


def past_the_end_error(trial: Trial, recording: Recording | LiveRecording) -> TrialError:
    """Return the error of a recording that ends before its first frame to track."""
    n = recording.n_images if isinstance(recording, Recording) else None
    last = f", the last is {n - 1}" if n else ""
    return TrialError(f"{trial.name}: there is no frame {trial.start.frame}{last}; start.frame lies past the end")


def dark_start_error(trial: Trial, frames: Iterable[Frames]) -> TrialError | None:
    """Return the error of a recording whose cameras are all dark in the first of the frames; None where one is not."""
    dark = [each.index for each in takewhile(_is_dark, frames)]
    if not dark:
        return None
    named = f"frame {dark[0]} is" if len(dark) == 1 else f"frames {dark[0]} to {dark[-1]} are"
    return TrialError(
        f"{trial.name}: {named} dark in all cameras, so nothing can be tracked from there; set start.frame to a later "
        "frame, and the pose in [start] to that of the frame"
    )


def _is_dark(frames: Frames) -> bool:
    views = [view for view in frames.views if view is not None]
    return bool(views) and all(map(is_dark, views))
