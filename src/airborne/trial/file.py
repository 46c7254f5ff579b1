"""A trial: one recording described by one TOML file; paths in it are relative to it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, ValidationError, ValidationInfo, field_validator, model_validator

from airborne.body import SAMPLED, BodyModel, human18, human18_from_measurements
from airborne.body.files import read_body
from airborne.errors import MOST_SAID, MistakesError, TrialError, list_mistakes
from airborne.io.names import ColumnName, Name
from airborne.io.text import list_keys
from airborne.tracking.methods import Settings
from airborne.trial.body import BodyTable
from airborne.trial.calibration import CalibrationTable
from airborne.trial.cameras import CameraTable
from airborne.trial.keys import KeyTable
from airborne.trial.lights import LightsTable
from airborne.trial.masks import MaskTable
from airborne.trial.session import read_tables
from airborne.trial.settings import (
    BODY_METHODS,
    KEY_METHODS,
    METHODS,
    PLAYERS_METHODS,
    BodySettings,
    Directions,
    ParticleSettings,
    TrackSettings,
)
from airborne.trial.start import StartTable
from airborne.trial.table import SettingsTable


class Trial(SettingsTable):
    """A whole trial file."""

    name: Name
    labels: dict[ColumnName, str | int | float] = {}  # athlete, condition, whatever tells trials apart
    camera: Annotated[list[CameraTable], Field(min_length=1)]
    calibration: CalibrationTable
    body: BodyTable
    start: StartTable = Field(default_factory=lambda: StartTable(find=True))
    key: list[KeyTable] = []  # what is known of the pose at later frames
    mask: list[MaskTable] = []  # cameras that are left out of some frames
    lights: LightsTable | None = None
    track: TrackSettings = Field(default_factory=BodySettings, validate_default=True)

    @field_validator("track", mode="before")
    @classmethod
    def _choose_settings(cls, table: Any, info: ValidationInfo) -> Any:
        """Add the method where there is none; refuse one that does not go with the body."""
        if not isinstance(table, dict) or "body" not in info.data:
            return table
        is_legs = info.data["body"].preset == "legs"
        methods = PLAYERS_METHODS if is_legs else BODY_METHODS
        method = table.get("method", methods[0])
        if method in METHODS and method not in methods:
            body = 'preset "legs"' if is_legs else "this body"
            raise ValueError(f"method '{method}' does not go with {body}; use one of: {', '.join(methods)}")
        return {"method": method, **table}

    @model_validator(mode="after")
    def _check_players(self) -> Trial:
        is_legs = self.body.preset == "legs"
        if is_legs and not (self.start.player or self.start.find):
            raise ValueError('body preset "legs" needs [[start.player]] tables, or find = true: where the players are')
        if "near_net" in self.start.model_fields_set and not (is_legs and self.start.find):
            raise ValueError('near_net goes with find = true and body preset = "legs"')
        if self.start.player and not is_legs:
            raise ValueError('[[start.player]] goes with body preset = "legs"')
        if is_legs and self.lights is not None:
            raise ValueError("[lights] is not read by methods of players; remove it")
        return self

    @model_validator(mode="after")
    def _check_stretch(self) -> Trial:
        self.track.check_stretch(self.start.frame)
        return self

    @model_validator(mode="after")
    def _check_keys(self) -> Trial:
        frames = [key.frame for key in self.key]
        if frames and self.track.method not in KEY_METHODS:
            raise ValueError(f"[[key]] is not read by method '{self.track.method}'; use {', '.join(KEY_METHODS)}")
        twice = sorted({frame for frame in frames if frames.count(frame) > 1})
        if twice:
            raise ValueError(f"two [[key]] tables are of frame {twice[0]}; join them in one")
        early = [frame for frame in frames if frame <= self.start.frame and not self.start.find]
        if early:
            raise ValueError(f"[[key]] of frame {early[0]}: not after start.frame = {self.start.frame}, the first key")
        return self

    @model_validator(mode="after")
    def _check_cameras(self) -> Trial:
        names = [camera.name for camera in self.camera]
        tables = [forms.points_px for forms in (self.start, *self.start.player, *self.key)]
        inline = [table for table in tables if isinstance(table, dict)]
        clicked = {camera for table in inline for by_camera in table.values() for camera in by_camera}
        for table, cameras in (("points_px", clicked), ("[[mask]]", {mask.camera for mask in self.mask})):
            if unknown := sorted(cameras - set(names)):
                raise ValueError(f"{table}: no camera {', '.join(unknown)}; there are: {', '.join(names)}")
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

    def __init__(self, /, **tables: Any) -> None:
        """Make a trial of tables as a trial file has them; raises MistakesError for what is wrong in them."""
        try:
            super().__init__(**tables)
        except ValidationError as error:
            places = [one["loc"] for one in error.errors(include_url=False)]
            raise MistakesError("Trial", list_mistakes(error, METHODS, tables, Trial), places, MOST_SAID) from None

    _folder: Path = PrivateAttr(default=Path())

    @property
    def has_players(self) -> bool:
        """Whether this is a trial of players' legs, and not of one body."""
        return self.body.preset == "legs"

    @property
    def settings(self) -> Settings:
        """The settings of the tracking method of one body; raises TrialError for players, who have none."""
        if not isinstance(self.track, BodySettings):
            raise TrialError(f"{self.name}: method '{self.track.method}' is of players; this needs one whole body")
        lights = self.lights
        return self.track.with_lights(lights and lights.lights, is_exact=lights is not None and lights.is_exact)

    @property
    def first_frame(self) -> int:
        """The first frame that is tracked: `start.frame`, or one before it, from there back."""
        return self.track.first_frame(self.start.frame)

    @property
    def directions(self) -> Directions:
        """In which directions a body is tracked between its keys, and limbs that were found again."""
        return self.track.directions if isinstance(self.track, BodySettings) else "forward"

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

    @property
    def torso(self) -> str | None:
        """The table of the players' torsos, if there is one."""
        return self.track.torso if isinstance(self.track, ParticleSettings) else None

    @property
    def input_files(self) -> tuple[str, ...]:
        """The files and folders that the trial names beside its videos, without those of its keys."""
        optional = (self.body.source_file, self.calibration.file, self.calibration.control_points, self.torso)
        return (*(name for name in optional if name is not None), *self.start.source_files)

    def mask_stretches(self, camera: str) -> tuple[tuple[int, int], ...]:
        """Return the first and last frame of each stretch in which a camera is left out."""
        return tuple((mask.first, mask.last) for mask in self.mask if mask.camera == camera)

    def path(self, name: str) -> Path:
        """Resolve a path of the trial file."""
        return self._folder / name


def parse_trial(path: Path, track: dict[str, Any] | None = None, given_as: str = "{} = {!r}") -> Trial:
    """Read a trial's tables, but look for none of the files that they name; raises TrialError."""
    read = read_tables(path)
    trial = _validate(read.tables, track or {}, read.name, given_as)
    trial._folder = read.folder
    return trial


def read_trial(
    path: Path,
    track: dict[str, Any] | None = None,
    cameras: Sequence[str] | None = None,
    given_as: str = "{} = {!r}",
) -> Trial:
    """Read a trial file; raises TrialError, naming the file and what is wrong, for anything unusable.

    `track` replaces entries of its [track] table, as options of `airborne track` do; `cameras` selects cameras by
    name. `given_as` is how errors write a replaced entry's name and value.
    """
    trial = parse_trial(path, track, given_as)
    mistakes = list_wrong_names(trial)
    if mistakes:
        raise MistakesError(path.name, mistakes)
    return trial if cameras is None else _select_cameras(path, trial, cameras)


def _validate(table: dict[str, Any], changes: dict[str, Any], where: str, given_as: str) -> Trial:
    """Return the trial of a table with changes to its settings; an error names the changes where they cause it."""
    missing = [head for head in ("[[camera]]", "[calibration]", "[body]") if head.strip("[]") not in table]
    if len(missing) > 1:
        raise TrialError(f"{where}: not a trial file, as {', '.join(missing)} are missing (found {list_keys(table)})")
    settings = table.get("track", {})
    changed = {**table, "track": {**settings, **changes} if isinstance(settings, dict) else settings}
    try:
        return Trial(**changed)
    except MistakesError as error:
        found = error
    if changes:
        try:
            Trial(**table)
            where = " ".join(given_as.format(name, value) for name, value in changes.items())
        except MistakesError:
            changes = {}
    said = rf"^track(\.|: )({'|'.join(map(re.escape, changes))}): "  # where it stands in the file, as its name is said
    raise MistakesError(where, [re.sub(said, "", each) for each in found.plain], found.places)


def list_wrong_names(trial: Trial) -> list[str]:
    """List names of cameras that are not unique, and of files that do not exist."""
    names = [camera.name for camera in trial.camera]
    folders = {forms.detections for forms in (trial.start, *trial.key)}
    same = [f"two cameras share a name: {', '.join(names)}; give each its own"]
    return same * (len(set(names)) < len(names)) + [
        f"{name} not found in {trial.path('')}"
        for name in (*trial.input_files, *chain.from_iterable(key.source_files for key in trial.key))
        if not (trial.path(name).is_file() or (name in folders and trial.path(name).is_dir()))
    ]


def _select_cameras(path: Path, trial: Trial, cameras: Sequence[str]) -> Trial:
    by_name = {camera.name: camera for camera in trial.camera}
    if isinstance(cameras, str) or not cameras or not all(isinstance(name, str) for name in cameras):
        raise TrialError(f"{path.name}: cameras = {cameras!r}; expected a list of names, of: {', '.join(by_name)}")
    unknown = [name for name in cameras if name not in by_name]
    if unknown:
        raise TrialError(f"{path.name}: no camera {', '.join(unknown)}; it has: {', '.join(by_name)}")
    twice = [name for name in by_name if cameras.count(name) > 1]
    if twice:
        raise TrialError(f"cameras names {', '.join(twice)} twice; name each camera once")
    mend = [name for name in trial.calibration.mend if name in cameras]
    calibration = trial.calibration.model_copy(update={"mend": mend})
    masks = [mask for mask in trial.mask if mask.camera in cameras]
    chosen = {"camera": [by_name[name] for name in cameras], "mask": masks, "calibration": calibration}
    return trial.model_copy(update=chosen)
