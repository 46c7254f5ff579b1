"""A scene written as a trial: videos, cameras, control points, body, start and truth."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from airborne.body.files import write_body
from airborne.cameras import write_pose2sim
from airborne.constants import GRAVITY_M_S2
from airborne.errors import TrialError
from airborne.geometry.rotations import angles_from_matrix, unwrap
from airborne.io.writing import write_text
from airborne.synthetic.flight.articulated import Takeoff
from airborne.synthetic.flight.rigid import SampledFlight
from airborne.synthetic.flight.skill import Skill
from airborne.synthetic.flight.somersault import PictureStyle, SomersaultPreset, Target, somersault_scene
from airborne.synthetic.throw.measurements import control_points, digitise, lights_table, start_pose
from airborne.synthetic.throw.pictures import scene_frames
from airborne.synthetic.throw.scene import Scene, ThrowPreset, cross_scene
from airborne.types import Progress
from airborne.video import VideoWriter, weave

_TRIAL = "trial.toml"
_CRF, _NEAR_LOSSLESS_CRF = 16, 2  # of x264; nearly lossless


def write_thrown_cross(
    folder: Path,
    *,
    preset: ThrowPreset = "half-twist",
    seed: int = 0,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> None:
    """Write a trial of a `cross_scene` preset; see `write_trial`."""
    write_trial(cross_scene(preset, seed=seed), folder, overwrite=overwrite, progress=progress)


def write_somersault(
    folder: Path,
    *,
    preset: SomersaultPreset = "paper",
    target: Target = "skin",
    style: PictureStyle = "exact",
    seed: int = 0,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> None:
    """Write a trial of a `somersault` preset; see `write_trial`."""
    require_empty(folder, overwrite)
    scene = somersault_scene(preset, target=target, style=style, seed=seed)
    write_trial(scene, folder, overwrite=overwrite, progress=progress)


def write_trial(scene: Scene, folder: Path, *, overwrite: bool = False, progress: Progress | None = None) -> None:
    """Record a scene into a folder, which is made; nothing is left of it where that is broken off.

    `<camera>.mp4`, `calib_true.toml` (exact), the body's file, `truth.csv` (the root's pose in every picture) and
    `trial.toml` (with a hand-set start). Of a surveyed scene also `control_points.csv` (surveyed exactly, clicked),
    `digitised.csv` (clicked) and `lights.json` (roughly measured); of a body with joints `truth_joints.csv` (its
    landmarks) and `truth_angles.csv`, of a person who moves freely `truth_flight.csv`. `progress` is called after every
    image. Raises TrialError for a folder that holds anything, unless `overwrite`: then files of these names are
    replaced.
    """
    with fill_folder(folder, overwrite) as part:
        flight = scene.flight(np.array([float(scene.time_s(i)) for i in range(scene.n_pictures)]))
        write_pose2sim(part / "calib_true.toml", scene.rig)
        write_body(part / _body_file_name(scene), scene.model)
        if scene.is_surveyed:
            _write_control_points(part / "control_points.csv", scene)
            _write_digitised(part / "digitised.csv", scene, flight)
            write_text(part / "lights.json", json.dumps(lights_table(scene), indent=1) + "\n")
        if _has_joints(scene):
            _write_landmarks(part / "truth_joints.csv", scene, flight)
            _write_angles(part / "truth_angles.csv", scene, flight)
        if isinstance(scene.flight, Skill) and not scene.flight.is_rigid:
            _write_flight(part / "truth_flight.csv", scene, scene.flight.takeoff, flight)
        _write_truth(part / "truth.csv", scene, flight)
        _write_videos(part, scene, progress)
        write_text(part / _TRIAL, trial_toml(scene))


@contextmanager
def fill_folder(folder: Path, overwrite: bool) -> Iterator[Path]:
    """Give a folder to write a trial in; its files become those of `folder` once all are there, `trial.toml` last.

    Where writing ends by an error or by Ctrl-C, nothing is left. Raises TrialError as `require_empty` does.
    """
    require_empty(folder, overwrite)
    is_new = not folder.is_dir()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with TemporaryDirectory(prefix=".part", dir=folder) as name:
            yield Path(name)
            (folder / _TRIAL).unlink(missing_ok=True)
            for path in sorted(Path(name).iterdir(), key=lambda path: path.name == _TRIAL):
                path.replace(folder / path.name)
    except BaseException:
        if is_new:
            with suppress(OSError):  # somebody has put something there
                folder.rmdir()
        raise


def require_empty(folder: Path, overwrite: bool) -> None:
    """Raise TrialError for a file, and for a folder that holds anything, unless it may be overwritten."""
    if folder.exists() and not folder.is_dir():
        raise TrialError(f"{folder} is a file; give a folder for the trial")
    if not overwrite and folder.is_dir() and any(folder.iterdir()):
        raise TrialError(f"{folder} is not empty; give a new folder, or empty this one")


def trial_toml(scene: Scene) -> str:
    """Return the trial file of a scene's recording."""
    lines = [f"name = {json.dumps(scene.name)}"]
    for camera in scene.rig:
        lines += ["", "[[camera]]", f"name = {json.dumps(camera.name)}", f"video = {json.dumps(camera.name + '.mp4')}"]
        lines += ['fields = "top-first"'] if scene.is_interlaced else []
    calibration = 'control_points = "control_points.csv"     # calib_true.toml holds the exact cameras'
    lines += [
        "",
        "[calibration]",
        calibration if scene.is_surveyed else 'file = "calib_true.toml"                  # exact',
        "",
        "[body]",
        f"file = {json.dumps(_body_file_name(scene))}",
        *_lights_lines(scene),
        *_start_lines(scene),
        "",
        "[track]",
        'method = "refined"',
        f"stop = {scene.n_pictures}",
        *(["fixed_shape = true"] if isinstance(scene.flight, Skill) and scene.flight.is_rigid else []),
    ]
    return "\n".join(lines) + "\n"


def _lights_lines(scene: Scene) -> list[str]:
    """Return the [lights] table where the images were rendered in the tracker's own light."""
    if scene.lights is None:
        return []
    lines = ["", "[lights]", "is_exact = true", f"ambient = {scene.lights.ambient}"]
    for lamp in scene.lights.lamps:
        lines += ["", "[[lights.lamp]]", f"position_m = {_numbers(lamp.position_m)}", f"intensity = {lamp.intensity}"]
        if lamp.direction is not None and lamp.half_angle_rad is not None:
            lines += [f"direction = {_numbers(lamp.direction)}", f"half_angle_deg = {np.degrees(lamp.half_angle_rad)}"]
    return lines


def _start_lines(scene: Scene) -> list[str]:
    pose = start_pose(scene)
    root = pose.world_from_root
    off = f"{1000 * scene.start_error_m:.0f} mm and {np.degrees(scene.start_error_rad):.1f} degrees off"
    lines = [
        "",
        f"[start]                                   # as set by hand: {off}",
        "frame = 0",
        f"position_m = {_numbers(np.round(root.translation, 5))}",
        f"rotation_matrix = [{', '.join(_numbers(row) for row in np.round(root.rotation.as_matrix(), 6))}]",
    ]
    if _has_joints(scene):
        off = f"{np.degrees(scene.start_joint_error_rad):.1f} degrees off" if scene.start_joint_error_rad else "exact"
        lines += ["", f"[start.joint_angles_deg]                  # about x, the new y, the new z; {off}"]
        for segment, angles in zip(scene.model.segments[1:], np.degrees(pose.joint_angles), strict=True):
            lines.append(f"{segment.name} = {_numbers(np.round(angles, 4) + 0.0)}")
    return lines


def _write_videos(folder: Path, scene: Scene, progress: Progress | None) -> None:
    rate, fields = (scene.rate / 2, "top-first") if scene.is_interlaced else (scene.rate, "progressive")
    crf = _CRF if scene.lights is None else _NEAR_LOSSLESS_CRF
    with ExitStack() as stack:
        writers = [
            stack.enter_context(
                VideoWriter(folder / f"{camera.name}.mp4", size=camera.size, rate=rate, fields=fields, crf=crf)
            )
            for camera in scene.rig
        ]
        tops: list[NDArray[np.uint8]] = []
        for recorded in scene_frames(scene):
            pictures = [view.rgb for view in recorded.views if view is not None]
            if scene.is_interlaced and scene.parity(recorded.index) == 0:
                tops = pictures
            else:
                whole = [weave(*pair) for pair in zip(tops, pictures, strict=True)] if tops else pictures
                for writer, picture in zip(writers, whole, strict=True):
                    writer.write(picture)
            if progress is not None:
                progress(recorded.index + 1, scene.n_recorded)


def _write_control_points(path: Path, scene: Scene) -> None:
    points = control_points(scene)
    header = ["point", "x_m", "y_m", "z_m", *(f"{camera}_{axis}" for camera in points.cameras for axis in "uv")]
    rows = [
        [name, *(f"{x:.4f}" for x in world), *map(_pixel, px.ravel())]
        for name, world, px in zip(points.names, points.world, points.px, strict=True)
    ]
    _write_csv(path, header, rows)


def _write_digitised(path: Path, scene: Scene, flight: SampledFlight) -> None:
    points = digitise(scene, flight)
    header = [f"{point}_{camera}_{axis}" for point in points for camera in scene.rig.names for axis in "uv"]
    values = np.concatenate([px.reshape(len(px), -1) for px in points.values()], axis=1)
    _write_csv(path, [_index_name(scene), *header], [[i, *map(_pixel, row)] for i, row in enumerate(values)])


def _write_truth(path: Path, scene: Scene, flight: SampledFlight) -> None:
    header = [_index_name(scene), "time_s", "x_m", "y_m", "z_m", *(f"r{i}{j}" for i in range(3) for j in range(3))]
    values = np.column_stack([flight.time_s, flight.position, flight.R.reshape(-1, 9)])
    _write_csv(path, header, [[i, *map(repr, row.tolist())] for i, row in enumerate(values)])


def _write_landmarks(path: Path, scene: Scene, flight: SampledFlight) -> None:
    rows = [
        [i, repr(float(time)), landmark.name, *map(repr, point.tolist())]
        for i, time in enumerate(flight.time_s)
        for landmark, point in zip(scene.model.landmarks, scene.model.with_pose(flight.pose(i)).landmarks, strict=True)
    ]
    _write_csv(path, [_index_name(scene), "time_s", "joint", "x_m", "y_m", "z_m"], rows)


def _write_angles(path: Path, scene: Scene, flight: SampledFlight) -> None:
    joints = [f"{segment.name}_{axis}_rad" for segment in scene.model.segments[1:] for axis in "xyz"]
    values = np.column_stack([flight.time_s, flight.joint_angles.reshape(len(flight.time_s), -1)])
    _write_csv(
        path,
        [_index_name(scene), "time_s", *joints],
        [[i, *map(repr, row.tolist())] for i, row in enumerate(values)],
    )


def _write_flight(path: Path, scene: Scene, takeoff: Takeoff, flight: SampledFlight) -> None:
    """Write the centre of mass, which falls, the angular momentum, which lasts, and the root's rotation."""
    t = flight.time_s[:, None]
    com = takeoff.centre + t * takeoff.velocity - 0.5 * GRAVITY_M_S2 * t**2 * [0, 0, 1]
    momentum = np.tile(takeoff.angular_momentum, (len(t), 1))
    rotation_deg = np.degrees(unwrap(angles_from_matrix(flight.R), flight.time_s))
    values = np.column_stack([t, com, momentum, rotation_deg])
    of_axes = [f"{name}_{axis}_{unit}" for name, unit in (("com", "m"), ("L", "kg_m2_s")) for axis in "xyz"]
    header = [_index_name(scene), "time_s", *of_axes, "somersault_deg", "tilt_deg", "twist_deg"]
    _write_csv(path, header, [[i, *map(repr, row.tolist())] for i, row in enumerate(values)])


def _write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def _index_name(scene: Scene) -> str:
    return "field" if scene.is_interlaced else "frame"


def _body_file_name(scene: Scene) -> str:
    return "body.toml" if _has_joints(scene) else f"{scene.model.segments[0].name}.toml"


def _has_joints(scene: Scene) -> bool:
    return scene.model.has_joints


def _pixel(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2f}"


def _numbers(values: NDArray) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"
