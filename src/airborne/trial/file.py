"""A trial: one recording described by one TOML file; paths in it are relative to it."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, cast, get_args

import numpy as np
from pydantic import BaseModel, Field, PrivateAttr, ValidationError, model_validator
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import SAMPLED, BodyModel, Pose, human18, human18_from_measurements
from airborne.body.files import read_body
from airborne.errors import TrialError, one_line
from airborne.geometry.rotations import matrix_from_angles
from airborne.io.text import list_keys, read_toml
from airborne.rendering import Lamp, Lights
from airborne.tracking.direct_search.stepping import VRule
from airborne.tracking.methods import ColourRule, Method, Prediction, Settings
from airborne.tracking.players import PlayerStart
from airborne.trial.players import STRICT, PlayerTable, Vector

StepSizes = list[Annotated[float, Field(gt=0)]]
PlayersMethod = Literal["blocker", "block-jump", "mixture", "framework"]

_PLAYERS_METHODS: tuple[str, ...] = get_args(PlayersMethod)


class _Strict(BaseModel):
    model_config = STRICT


class CameraTable(_Strict):
    """One camera's video, and how its pixels lie in the calibration's image."""

    name: str
    video: str
    fields: Literal["progressive", "top-first", "bottom-first", "auto"] = "progressive"
    offset_s: float = 0.0  # added to this camera's times
    offset_sd_s: float = Field(0.0, ge=0)  # its standard deviation
    drift_ppm: float = Field(0.0, gt=-1e4, lt=1e4)  # by how much its clock runs slow, in parts per million
    calibrated_as: str | None = None  # the camera's name in the calibration file, where it differs
    saved_scale: float = Field(1.0, gt=0)  # calibration px = saved_scale * video px + saved_offset_px
    saved_offset_px: Annotated[list[float], Field(min_length=2, max_length=2)] = [0.0, 0.0]


class CalibrationTable(_Strict):
    """Where the cameras come from: a calibration file, or control points."""

    file: str | None = None
    control_points: str | None = None
    method: Literal["lm", "annealing"] = "lm"
    mend: list[str] = []  # cameras to re-resect from the detections of [start]

    @model_validator(mode="after")
    def _check_source(self) -> CalibrationTable:
        if (self.file is None) == (self.control_points is None):
            raise ValueError('give file = "..." or control_points = "...", one of them')
        return self


class BodyTable(_Strict):
    """Which body: a body file, a person of given stature and mass, a measured person, or players' legs."""

    file: str | None = None
    preset: Literal["human18", "legs"] | None = None
    stature_m: float | None = Field(None, gt=0)
    mass_kg: float | None = Field(None, gt=0)
    measurements: str | None = None

    @model_validator(mode="after")
    def _check_body(self) -> BodyTable:
        if sum(value is not None for value in (self.file, self.preset, self.measurements)) != 1:
            raise ValueError(
                'give file = "...", preset = "human18" or measurements = "...", one of them; '
                'of several players preset = "legs"'
            )
        sizes = (self.stature_m, self.mass_kg)
        if self.preset == "legs" and any(size is not None for size in sizes):
            raise ValueError('preset = "legs" takes no stature_m and no mass_kg; remove them')
        if any(size is None for size in sizes) if self.preset == "human18" else any(size is not None for size in sizes):
            raise ValueError("stature_m and mass_kg go with a preset, both of them, and with nothing else")
        return self

    @property
    def source_file(self) -> str | None:
        """The file that defines the body, if there is one."""
        return self.file or self.measurements


class StartTable(_Strict):
    """The first pose: set by hand, or found from positions of the body's landmarks; or those of several players."""

    frame: Annotated[int, Field(ge=0)] = 0
    position_m: Vector | None = None
    rotation_matrix: Annotated[list[Vector], Field(min_length=3, max_length=3)] | None = None
    quaternion_xyzw: Annotated[list[float], Field(min_length=4, max_length=4)] | None = None
    somersault_tilt_twist_deg: Vector | None = None
    joint_angles_deg: dict[str, Vector] = {}  # segment -> x, y, z
    joints_m: dict[str, Vector] | str | None = None  # landmark -> position, or a table of them
    points_px: str | None = None  # a table of clicked points
    detections: str | None = None  # .npz, or a folder of folders of OpenPose JSON
    detections_cameras: dict[str, str] = {}  # camera -> its array or folder
    player: list[PlayerTable] = []

    @model_validator(mode="after")
    def _check_start(self) -> StartTable:
        by_hand = {"position_m", "rotation_matrix", "quaternion_xyzw", "somersault_tilt_twist_deg", "joint_angles_deg"}
        ways = [self.joints_m, self.points_px, self.detections]
        given = sum(value is not None for value in ways) + bool(by_hand & self.model_fields_set) + bool(self.player)
        if given != 1:
            raise ValueError(
                "give a position_m and a rotation, or joints_m, points_px or detections, one of them; "
                "of several players [[start.player]] tables"
            )
        names = [player.name for player in self.player]
        if len(set(names)) != len(names):
            raise ValueError(f"two players share a name: {', '.join(names)}; give each its own")
        if names and not any(player.has_legs for player in self.player):
            raise ValueError("every player is a bystander; give one of them the points of the legs too")
        if self.detections_cameras and self.detections is None:
            raise ValueError("detections_cameras goes with detections")
        if by_hand & self.model_fields_set:
            self._check_rotation()
        return self

    def _check_rotation(self) -> None:
        if self.position_m is None:
            raise ValueError("position_m is missing: give where the root's origin is")
        given = [self.rotation_matrix, self.quaternion_xyzw, self.somersault_tilt_twist_deg]
        if sum(value is not None for value in given) != 1:
            raise ValueError("give rotation_matrix, quaternion_xyzw or somersault_tilt_twist_deg, one of them")
        if self.quaternion_xyzw is not None and not any(self.quaternion_xyzw):
            raise ValueError("quaternion_xyzw is all zeros; give x, y, z, w of a rotation, of any length above zero")
        if self.rotation_matrix is not None:
            R = np.array(self.rotation_matrix)
            if not np.allclose(R @ R.T, np.eye(3), atol=1e-3) or np.linalg.det(R) < 0:
                raise ValueError("rotation_matrix is no rotation: rows must be unit, at right angles, right-handed")

    @property
    def pose(self) -> Pose:
        """The start as set by hand, joints straight.

        Raises TrialError where it depends on the body or the cameras: then `airborne.run.first_pose` finds it.
        """
        if self.position_m is None or self.joint_angles_deg:
            raise TrialError("this start needs the body and the cameras; use airborne.run.first_pose")
        return Pose(world_from_root=self.world_from_root)

    @property
    def world_from_root(self) -> RigidTransform:
        """The root's pose as set by hand; raises TrialError where it is not set."""
        if self.position_m is None:
            raise TrialError("the root's position is not set by hand; use airborne.run.first_pose")
        if self.rotation_matrix is not None:
            rotation = Rotation.from_matrix(self.rotation_matrix)
        elif self.quaternion_xyzw is not None:
            rotation = Rotation.from_quat(self.quaternion_xyzw)
        else:
            angles = np.radians(self.somersault_tilt_twist_deg or [0.0, 0.0, 0.0])
            rotation = Rotation.from_matrix(matrix_from_angles(angles))
        return RigidTransform.from_components(self.position_m, rotation)

    @property
    def source_files(self) -> list[str]:
        """The files and folders that define the start."""
        joints = self.joints_m if isinstance(self.joints_m, str) else None
        return [name for name in (joints, self.points_px, self.detections) if name is not None]


class LampTable(_Strict):
    """A lamp: a point light, or with a direction and a half angle a spot light."""

    position_m: Vector
    intensity: float = Field(ge=0)  # irradiance of a matt surface facing it, as a share of its colour
    direction: Vector | None = None
    half_angle_deg: float | None = Field(None, gt=0, lt=90)

    @model_validator(mode="after")
    def _check_spot(self) -> LampTable:
        if (self.direction is None) != (self.half_angle_deg is None) or self.direction == [0, 0, 0]:
            raise ValueError("a spot light needs a direction with a length and half_angle_deg; a point light neither")
        return self


class LightsTable(_Strict):
    """Measured lights; without this table the light is unknown."""

    ambient: float = Field(ge=0)
    is_exact: bool = False  # rendered images: their light is exactly this, so that every method uses it
    lamp: list[LampTable] = []

    @property
    def lights(self) -> Lights:
        """The lights as the renderer takes them."""
        return Lights(self.ambient, tuple(_lamp(lamp) for lamp in self.lamp))


class TrackTable(_Strict):
    """How to track; each method reads its own settings."""

    method: Literal[Method, PlayersMethod] = "refined"
    every: Annotated[int, Field(ge=1)] = 1  # track every n-th frame or field
    stop: Annotated[int, Field(ge=1)] | None = None  # one past the last frame or field
    prediction: Prediction = "smooth"
    fixed_shape: bool = False  # joint angles stay those of the start; stepping and simplex never change them
    colour: ColourRule = "normalised"  # stepping and simplex: paper B's score
    v_rule: VRule = "v_sym"  # stepping
    steps_mm: StepSizes = [50, 30, 20, 10, 10, 5, 5]  # stepping: one loop each
    steps_deg: StepSizes = [5, 3, 2, 1, 1, 0.5, 0.5]
    scale: Literal[1, 2, 4] = 1  # stepping and simplex: reduction of the images
    n_particles: Annotated[int, Field(ge=50, le=100_000)] | None = None  # particle filters; None: the method's own
    seed: Annotated[int, Field(ge=0)] = 0  # particle filters: seed of the random numbers
    swing: Literal["literal", "consistent"] = "literal"  # block-jump: how rods swing
    estimate: Literal["max", "mean", "top10_mean"] | None = None  # particle filters; None: the method's own
    views: Literal["all", "visible", "robust"] = "all"  # particle filters: which cameras count
    tempered: bool = False  # particle filters: a softer comparison of histograms, the more cameras
    torso_shift: bool = False  # particle filters: the whole body moves along with the torso
    resample: Literal["systematic", "stratified", "residual", "multinomial"] = "systematic"  # particle filters
    resample_when: Literal["always", "ess"] = "always"  # particle filters
    torso: str | None = None  # particle filters: a table of torsos; None: they are tracked
    overlay: Literal["paper", "broadcast"] = "paper"  # legs: what the overlay videos show

    @model_validator(mode="after")
    def _check_steps(self) -> TrackTable:
        if len(self.steps_mm) != len(self.steps_deg) or not self.steps_mm:
            raise ValueError("steps_mm and steps_deg need one number each for every loop, equally many")
        return self

    @property
    def method_settings(self) -> dict[str, Any]:
        """The settings that the method may read."""
        settings = self.model_dump()
        if self.method not in _PLAYERS_METHODS:
            excluded = _LEGS_SETTINGS
        else:
            excluded = (*_BODY_SETTINGS, *(_FILTER_SETTINGS if self.method == "blocker" else ()))
        return {name: value for name, value in settings.items() if name not in excluded}


_FILTER_SETTINGS = (
    *("n_particles", "seed", "swing", "estimate", "views", "tempered"),
    *("torso_shift", "resample", "resample_when", "torso"),
)
_LEGS_SETTINGS = (*_FILTER_SETTINGS, "overlay")
_BODY_SETTINGS = ("prediction", "fixed_shape", "colour", "v_rule", "steps_mm", "steps_deg", "scale")


class Trial(_Strict):
    """A whole trial file."""

    name: str
    camera: Annotated[list[CameraTable], Field(min_length=1)]
    calibration: CalibrationTable
    body: BodyTable
    start: StartTable
    lights: LightsTable | None = None
    track: TrackTable = TrackTable()

    @model_validator(mode="before")
    @classmethod
    def _default_players_method(cls, table: Any) -> Any:
        match table:
            case {"body": {"preset": "legs"}, **rest}:
                track = rest.get("track", {})
                return (
                    {**table, "track": {"method": _PLAYERS_METHODS[0], **track}} if isinstance(track, dict) else table
                )
        return table

    @model_validator(mode="after")
    def _check_players(self) -> Trial:
        is_legs, method = self.body.preset == "legs", self.track.method
        if is_legs and not self.start.player:
            raise ValueError('body preset "legs" needs [[start.player]] tables: where every player is at the start')
        if self.start.player and not is_legs:
            raise ValueError('[[start.player]] goes with body preset = "legs"')
        if is_legs != (method in _PLAYERS_METHODS):
            methods = _PLAYERS_METHODS if is_legs else get_args(Method)
            body = 'preset "legs"' if is_legs else "this body"
            raise ValueError(f"track.method = '{method}' does not go with {body}; use one of: {', '.join(methods)}")
        unread = sorted(self.track.model_fields_set & {*(_BODY_SETTINGS if is_legs else _LEGS_SETTINGS)})
        if is_legs and self.lights is not None:
            unread.append("[lights]")
        if unread:
            raise ValueError(f"{', '.join(unread)} under [track]: not read by method '{method}'; remove it")
        return self

    @model_validator(mode="after")
    def _check_saved_pixels(self) -> Trial:
        for camera in self.camera:
            if self.calibration.file is None and camera.model_fields_set & {
                "calibrated_as",
                "saved_scale",
                "saved_offset_px",
            }:
                raise ValueError(
                    f"camera '{camera.name}': calibrated_as, saved_scale and saved_offset_px need a calibration file, "
                    "because control points are clicked in the video's own pixels"
                )
        return self

    @model_validator(mode="after")
    def _check_mend(self) -> Trial:
        names = [camera.name for camera in self.camera]
        unknown = [name for name in self.calibration.mend if name not in names]
        if unknown:
            raise ValueError(f"calibration.mend: no camera {', '.join(unknown)}; there are: {', '.join(names)}")
        if self.calibration.mend and self.start.detections is None:
            raise ValueError("calibration.mend needs [start] with detections: they say where the points are")
        return self

    _folder: Path = PrivateAttr(default=Path())

    @property
    def has_players(self) -> bool:
        """Whether this is a trial of players' legs, and not of one body."""
        return bool(self.start.player)

    @property
    def players(self) -> tuple[PlayerStart, ...]:
        """Where every player and bystander starts."""
        return tuple(
            PlayerStart(name=player.name, joints_m={name: np.array(point) for name, point in player.joints_m.items()})
            for player in self.start.player
        )

    @property
    def settings(self) -> Settings:
        """The settings of the tracking method of one body."""
        track = self.track
        steps = zip(track.steps_mm, track.steps_deg, strict=True)
        return Settings(
            method=cast(Method, track.method),
            prediction=track.prediction,
            fixed_shape=track.fixed_shape,
            colour=track.colour,
            v_rule=track.v_rule,
            loops=tuple((mm / 1000, float(np.radians(deg))) for mm, deg in steps),
            scale=track.scale,
            lights=None if self.lights is None else self.lights.lights,
            is_light_exact=self.lights is not None and self.lights.is_exact,
        )

    def model(self) -> BodyModel:
        """Return the body; a person by preset or measurements takes its colours from the video.

        Raises BodyError for an unusable body, TrialError for players, who have none.
        """
        body = self.body
        if body.preset == "legs":
            raise TrialError(f'{self.name}: preset = "legs" is points of several players; this needs one whole body')
        if body.measurements is not None:
            return human18_from_measurements(self.path(body.measurements), outfit=SAMPLED)
        if body.file is not None:
            return read_body(self.path(body.file))
        assert body.stature_m is not None and body.mass_kg is not None, "checked with the table"
        return human18(body.stature_m, body.mass_kg, outfit=SAMPLED)

    def path(self, name: str) -> Path:
        """Resolve a path of the trial file."""
        return self._folder / name


def read_trial(path: Path, track: dict[str, Any] | None = None, cameras: Sequence[str] | None = None) -> Trial:
    """Read a trial file; raises TrialError, naming the file and what is wrong, for anything unusable.

    `track` replaces entries of its [track] table, as options of `airborne track` do; `cameras` selects cameras by
    name.
    """
    try:
        trial = _validate(read_toml(path), track or {}, path.name)
    except OSError as error:
        raise TrialError(f"{path}: cannot be read ({error.strerror}); give the path of a trial's TOML file") from error
    except tomllib.TOMLDecodeError as error:
        raise TrialError(f"{path.name}: not a TOML file: {error}; expected a trial's TOML") from error
    trial._folder = path.parent
    _check(path, trial)
    return trial if cameras is None else _select_cameras(path, trial, cameras)


def _validate(table: dict[str, Any], changes: dict[str, Any], where: str) -> Trial:
    """Return the trial of a table with changes to its settings; an error names the changes where they cause it."""
    heads = ("[[camera]]", "[calibration]", "[body]", "[start]")
    missing = [head for head in heads if head.strip("[]") not in table]
    if len(missing) > 1:
        raise TrialError(f"{where}: no trial file, as {', '.join(missing)} are missing (found {list_keys(table)})")
    settings = table.get("track", {})
    changed = {**table, "track": {**settings, **changes} if isinstance(settings, dict) else settings}
    try:
        return Trial.model_validate(changed)
    except ValidationError as error:
        reason = one_line(error)
    if changes:
        try:
            Trial.model_validate(table)
            where = " ".join(f"--{name} {value}" for name, value in changes.items())
        except ValidationError:
            pass
    raise TrialError(f"{where}: {reason}")


def _check(path: Path, trial: Trial) -> None:
    names = [camera.name for camera in trial.camera]
    if len(set(names)) != len(names):
        raise TrialError(f"{path.name}: two cameras share a name: {', '.join(names)}; give each its own")
    calibration, body = trial.calibration, trial.body
    files = [
        body.source_file,
        calibration.file,
        calibration.control_points,
        trial.track.torso,
        *trial.start.source_files,
    ]
    for name in files:
        if name is not None and not (
            trial.path(name).is_file() or (name == trial.start.detections and trial.path(name).is_dir())
        ):
            raise TrialError(f"{path.name}: {name} not found beside it")


def _select_cameras(path: Path, trial: Trial, cameras: Sequence[str]) -> Trial:
    by_name = {camera.name: camera for camera in trial.camera}
    unknown = [name for name in cameras if name not in by_name]
    if unknown:
        raise TrialError(f"{path.name}: no camera {', '.join(unknown)}; it has: {', '.join(by_name)}")
    mend = [name for name in trial.calibration.mend if name in cameras]
    calibration = trial.calibration.model_copy(update={"mend": mend})
    return trial.model_copy(update={"camera": [by_name[name] for name in cameras], "calibration": calibration})


def _lamp(table: LampTable) -> Lamp:
    angle = None if table.half_angle_deg is None else float(np.radians(table.half_angle_deg))
    direction = None if table.direction is None else np.array(table.direction)
    return Lamp(np.array(table.position_m), table.intensity, direction, angle)
