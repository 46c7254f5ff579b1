"""The file of sources: one TOML file that names cameras and sources; paths are relative to it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, ClassVar, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError, model_validator

from airborne.calibration.sources.court import ScenePoint, court_points
from airborne.cameras import PixelConvention
from airborne.errors import CalibrationError, one_line
from airborne.io.names import CheckedPath, Name
from airborne.io.text import list_keys, read_toml

Positive = Annotated[float, Field(gt=0)]
PixelConventionName = Literal["upper-left-1", "upper-left-0", "lower-left-1", "lower-left-0"]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class CameraSource(_Strict):
    """One camera: its recording, or only its image size."""

    name: Name
    video: CheckedPath | None = None  # shows the board or the wand together with the other cameras
    pictures: CheckedPath | None = None  # the same as images: a folder or a pattern such as "left/*.png"
    lens_video: CheckedPath | None = None  # shows the board to this camera alone, for its lens
    lens_pictures: CheckedPath | None = None
    size: Annotated[list[Annotated[int, Field(ge=16, le=20000)]], Field(min_length=2, max_length=2)] | None = None
    lens: Literal["brown", "fisheye"] = "brown"
    focal: Literal["auto", "free", "fixed", "shared"] = "auto"  # shared: one focal length for all cameras that say so
    offset_s: float = 0.0  # added to this camera's times
    calibrated_as: str | None = None  # its name in [start] file, where it differs
    saved_scale: Positive = 1.0  # pixels of the [start] file = saved_scale * this camera's pixels + saved_offset_px
    saved_offset_px: Annotated[list[float], Field(min_length=2, max_length=2)] = [0.0, 0.0]


class StartSource(_Strict):
    """An existing calibration: the initial values."""

    file: CheckedPath


class SourceTable(_Strict):
    """A source's table: what it tells of cameras is asked of it, not of its kind."""

    places_cameras: ClassVar[bool] = True  # it says where cameras stand, without others' initial values
    has_lengths: ClassVar[bool] = False  # lengths on it are known, so that a world of another scale is no option
    is_court: ClassVar[bool] = False  # z = 0 is a floor, over which a net stands


class SurveyTable(SourceTable):
    """Clicked points whose places in the world are known."""

    file: CheckedPath

    def scene_points(self) -> dict[str, ScenePoint]:
        """Return the points whose places are known by their names alone."""
        return {}


class BoardSource(SourceTable):
    """A printed board that is moved about."""

    has_lengths: ClassVar[bool] = True
    file: CheckedPath | None = None
    kind: Literal["charuco", "chessboard"] | None = None  # these, or a file with them
    columns: int | None = None
    rows: int | None = None
    square_m: Positive | None = None
    marker_m: Positive | None = None
    dictionary: str | None = None
    inverted: bool | None = None
    legacy: bool | None = None
    two_sided: bool | None = None  # the back is printed with the mirror image
    thickness_m: Annotated[float, Field(ge=0, le=0.2)] | None = None  # of a two-sided board
    timestamps: CheckedPath | None = None  # which frames belong together: sync_index,cam_id,frame_time
    sync: Literal["auto", "exact", "loose"] = "auto"  # loose: every image may lag behind the others

    @model_validator(mode="after")
    def _one_way(self) -> BoardSource:
        if (self.file is None) == (self.columns is None):
            raise ValueError('give file = "..." or kind, columns, rows and square_m')
        return self


class PointsSource(SurveyTable):
    """Points with surveyed positions."""


class CourtSource(SurveyTable):
    """Clicked points of a volleyball court and net."""

    is_court: ClassVar[bool] = True
    net: Literal["men", "women"] | Positive = "men"

    def scene_points(self) -> dict[str, ScenePoint]:
        """Return the named points of the court, with this net."""
        return court_points(self.net)


class WandSource(SourceTable):
    """A stick of known length that is waved about; without a file it is looked for in the cameras' videos."""

    has_lengths: ClassVar[bool] = True
    file: CheckedPath | None = None
    length_m: Positive | None = None
    lengths_m: list[Positive] | None = None
    pixels: PixelConventionName = "upper-left-1"
    cameras: list[str] | None = None  # of the file's columns, in order; None: all cameras

    @model_validator(mode="after")
    def _one_length(self) -> WandSource:
        if (self.length_m is None) == (self.lengths_m is None):
            raise ValueError("give length_m, or lengths_m between the markers in a row")
        if self.file is None and self.length_m is None:
            raise ValueError("a wand found in videos has two markers: give length_m, or file = their table")
        return self


class DetectionsSource(SourceTable):
    """Keypoints of a moving person, detected by a pose network."""

    places_cameras: ClassVar[bool] = False
    file: CheckedPath
    cameras: dict[str, str] = {}
    skeleton: str | None = None  # whose points they are; None: as the file says


class WorldTable(_Strict):
    """The world's origin and axes; without this table the sources decide."""

    frame: Literal["auto", "board", "camera", "start"] = "auto"
    moment: Annotated[int, Field(ge=0)] | None = None  # of the board: the frame at which it defines the world
    points: CheckedPath | None = None  # clicked points: point,<camera>_u,<camera>_v,...
    origin: str | None = None
    along_x: str | None = None
    in_xy: str | None = None
    throw: CheckedPath | None = None  # tracks of a thrown object: DLTdv's xypts
    rate_hz: Positive | None = None  # of the throw
    pixels: PixelConventionName = "upper-left-1"

    @model_validator(mode="after")
    def _whole(self) -> WorldTable:
        if self.points is not None and (self.origin is None or self.along_x is None):
            raise ValueError("points needs origin and along_x, and in_xy or a throw")
        if self.points is not None and self.in_xy is None and self.throw is None:
            raise ValueError("points needs in_xy = the third point's name, or a throw that tells which way is up")
        if self.throw is not None and self.rate_hz is None:
            raise ValueError("throw needs rate_hz, the frames in a second")
        return self


class Sources(_Strict):
    """All that a calibration is made from."""

    camera: Annotated[list[CameraSource], Field(min_length=1)]
    start: StartSource | None = None
    board: BoardSource | None = None
    control_points: PointsSource | None = None
    court: CourtSource | None = None
    wand: WandSource | None = None
    detections: DetectionsSource | None = None
    world: WorldTable = WorldTable()
    _folder: Path = PrivateAttr(Path())

    @model_validator(mode="after")
    def _usable(self) -> Sources:
        names = self.names
        if len(set(names)) < len(names):
            raise ValueError(f"two cameras share a name: {', '.join(names)}; give each its own")
        if not self.tables:
            raise ValueError(f"no source: add {_names_of_tables()}")
        if self.start is None and not self.place_cameras:
            refining = " and ".join(self.tables)
            raise ValueError(f'{refining} refine cameras that are known: give [start] file = "..." or another source')
        return self

    @property
    def names(self) -> list[str]:
        """The cameras' names, in order."""
        return [camera.name for camera in self.camera]

    @property
    def tables(self) -> dict[str, SourceTable]:
        """The sources that are given, by what they are called."""
        given = {name.replace("_", " "): getattr(self, name) for name in type(self).model_fields}
        return {name: table for name, table in given.items() if isinstance(table, SourceTable)}

    @property
    def place_cameras(self) -> bool:
        """Whether any source says where cameras stand."""
        return any(table.places_cameras for table in self.tables.values())

    def path(self, name: str) -> Path:
        """Return the path of a file named here."""
        return self._folder / name


def _names_of_tables() -> str:
    """Name the tables that a source can have: [board], [control_points], ... or [detections]."""
    names = [
        f"[{name}]"
        for name, field in Sources.model_fields.items()
        if any(isinstance(kind, type) and issubclass(kind, SourceTable) for kind in get_args(field.annotation))
    ]
    return f"{', '.join(names[:-1])} or {names[-1]}"


def pixel_convention(name: PixelConventionName) -> PixelConvention:
    """Return the pixel convention of a name."""
    corner, _, base = name.rpartition("-")
    return PixelConvention("lower-left" if corner == "lower-left" else "upper-left", int(base))


def read_sources(path: Path) -> Sources:
    """Read the TOML file; raises CalibrationError in one line for what cannot be used."""
    try:
        document = read_toml(path)
    except OSError as error:
        raise CalibrationError(f"{path} cannot be read ({error.strerror}); give a file of sources") from None
    except tomllib.TOMLDecodeError as error:
        raise CalibrationError(
            f"{path} is no TOML file ({str(error).lower()}); expected [[camera]], [board], ..."
        ) from None
    return sources_from(document, path.parent, str(path))


def sources_from(document: dict, folder: Path, where: str) -> Sources:
    """Check the tables; relative paths count from the folder. Raises CalibrationError, naming `where`."""
    if "camera" not in document or "body" in document:
        raise CalibrationError(
            f"{where} is not a sources file: expected [[camera]] and {_names_of_tables()} (found {list_keys(document)})"
        )
    try:
        sources = Sources.model_validate(document)
    except ValidationError as error:
        raise CalibrationError(f"{where}: {one_line(error, document, Sources)}") from None
    sources._folder = folder
    return sources
