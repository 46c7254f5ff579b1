"""One file of cameras or of points in pictures into another: told apart by content, with what got lost said."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from airborne.cameras import Detections, Rig, read_detections, read_rig
from airborne.cameras.detections import cameras_in, write_detections
from airborne.cameras.files import UNITS, CalibrationFile, format_of_name, open_calibration, rig_of, write_rig
from airborne.cameras.formats.dltdv import Digitisation, is_xypts, placed, read_digitisation, write_digitisation
from airborne.cameras.formats.options import Given
from airborne.cameras.units import odd_distances
from airborne.errors import AirborneError, CalibrationError
from airborne.evaluation import Digitised, read_clicked_frames, write_clicked_frames
from airborne.io.text import read_toml

POINT_FORMATS = ("digitised", "dltdv", "npz", "openpose")
FORMATS = (*UNITS, *POINT_FORMATS)
LARGE = 0.01  # of a picture's longer side: a median residual beyond it comes from more than inexact clicks
_MOST_NUMBERS = 20_000_000  # of a table of clicked points
_PIXELS = frozenset({"--origin", "--pixel-base"})
_NAMES = frozenset({"--cameras", "--calibration"})
_EXPECTED_POINTS = "points in pictures: tables frame,<point>_<camera>_u,..., DLTdv's xypts, .npz, OpenPose's folders"
_EXPECTED = f"calibrations, or {_EXPECTED_POINTS}"
_OTHERS = (
    ({"run.json"}, "a run's folder, which `airborne export` hands on"),
    ({"point"}, "control points or a court's points, by which `airborne calibrate` finds cameras"),
    ({"time_s"}, "a table of motion"),
    ({"segment"}, "a body file"),
    ({"camera", "body"}, "a trial file, which names its calibration"),
    ({"camera"}, "a file of sources, by which `airborne calibrate` finds cameras"),
)  # what stands in files and folders that hold neither cameras nor points in pictures
_FROM: Mapping[str, frozenset[str]] = {
    **dict.fromkeys(UNITS, frozenset({"--unit"})),
    "opencv": frozenset({"--unit", "--size"}),
    "dlt": frozenset({"--unit", "--size"}) | _PIXELS,
    "dltdv": frozenset({"--unit", "--size"}) | _PIXELS | _NAMES,
    "digitised": _NAMES,
    "npz": _NAMES,
    "openpose": _NAMES | {"--person"},
}  # the options that say something about a file that is read
_TO: Mapping[str, frozenset[str]] = {
    **dict.fromkeys(FORMATS, frozenset()),
    **{name: frozenset({"--to-unit"}) for name in ("aniposelib", "opencv", "easymocap")},
    "dlt": frozenset({"--to-unit", "--to-origin", "--to-pixel-base"}),
    "dltdv": frozenset({"--to-unit", "--to-origin", "--to-pixel-base", "--size", "--calibration"}),
}  # and about a file that is written


@dataclass(frozen=True, slots=True, kw_only=True)
class Wishes:
    """What the user says about the two files."""

    to: str | None = None  # one of FORMATS; None goes by the name of the file to write
    source: Given = field(default_factory=Given)
    target: Given = field(default_factory=Given)
    cameras: tuple[str, ...] = ()  # the names of the cameras of points
    calibration: Path | None = None  # cameras by whom points are placed in the world
    person: int | None = None  # of OpenPose's people
    said: frozenset[str] = frozenset()  # the options that were given


@dataclass(frozen=True, slots=True, kw_only=True)
class Conversion:
    """What was done: a line each about what was read, what was written, what the new file does not hold, and doubts."""

    read: str
    written: str
    lost: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def describe(self) -> str:
        """Return the lines."""
        lost = [f"not in the new file: {'; '.join(self.lost)}"] if self.lost else []
        notes = [f"note: {note}" for note in self.notes]
        return "\n".join([f"read: {self.read}", f"written: {self.written}", *lost, *notes])


def convert(source: Path, target: Path, wishes: Wishes) -> Conversion:
    """Read one file and write the other. Raises AirborneError where one cannot be, or an option says nothing."""
    if source.exists() and target.exists() and source.samefile(target):
        raise AirborneError(f"{target} is the file that is read; give another name for what is written")
    kind = _points_kind(source)
    if kind is None:
        return _convert_rig(_opened(source), target, wishes)
    return _convert_points(source, kind, target, wishes)


def _opened(source: Path) -> CalibrationFile:
    """Open a calibration. Raises AirborneError, saying what a file looks like that is none."""
    found = _names_in(source)
    for names, what in _OTHERS:
        if names <= found:
            raise AirborneError(f"{source} looks like {what}; convert takes {_EXPECTED}")
    try:
        return open_calibration(source)
    except CalibrationError as error:
        raise AirborneError(f"{error}; or {_EXPECTED_POINTS}") from None


def _names_in(source: Path) -> set[str]:
    """Return a folder's files, a table's columns, or what stands at the top of a TOML file, but for cameras."""
    if source.is_dir():
        return {path.name for path in source.iterdir()}
    try:
        return {key for key, value in read_toml(source).items() if not (isinstance(value, dict) and "matrix" in value)}
    except OSError:
        return set()
    except tomllib.TOMLDecodeError:
        return set(_first_line(source).split(","))


def _convert_rig(file: CalibrationFile, target: Path, wishes: Wishes) -> Conversion:
    to = wishes.to or format_of_name(target)
    if to in POINT_FORMATS:
        raise AirborneError(
            f"{file.where} holds cameras, which cannot be written as {to}; choose from {', '.join(UNITS)}"
        )
    _check_options(wishes, file.format, to)
    rig = rig_of(file, wishes.source)
    lost = write_rig(target, rig, format=to, unit=wishes.target.unit, pixels=wishes.target.pixels)
    return Conversion(
        read=f"{file.where}, {file.format}, {len(rig)} cameras: {', '.join(rig.names)}",
        written=f"{target}, {to}{_convention(to, wishes.target)}",
        lost=lost,
        notes=tuple(f"{finding.what}; is --unit {wishes.source.unit} right?" for finding in odd_distances(rig)),
    )


def _convert_points(source: Path, kind: str, target: Path, wishes: Wishes) -> Conversion:
    to = wishes.to or _points_format_of_name(target, source)
    if to not in POINT_FORMATS:
        raise AirborneError(f"{source} holds points in pictures, not cameras; write one of {', '.join(POINT_FORMATS)}")
    _check_options(wishes, kind, to)
    rig = read_rig(wishes.calibration) if wishes.calibration else None
    read = _read_points(source, kind, wishes, rig)
    spot = placed(read.points, rig) if rig else read
    if to == "dltdv":
        written, lost = _write_dltdv(target, spot, wishes, rig)
    elif to == "digitised":
        written, lost = _write_digitised(target, read.points), ()
    else:
        write_detections(target, read.points, as_folder=to == "openpose")
        written, lost = str(target), ()
    if to in ("dltdv", "digitised") and kind in ("npz", "openpose"):
        lost = (*lost, "how sure each point is")
    if to != "dltdv" and read.world is not None:
        lost = (*lost, "places in the world and their residuals")
    n_frames, n_points, n_cameras = read.points.visibility.shape
    counts = f"{n_frames} frames, {n_points} points, {n_cameras} cameras: {', '.join(read.points.cameras)}"
    notes = "".join(f"; {note}" for note in read.points.notes)
    return Conversion(
        read=f"{source}, {kind}, {counts}{notes}",
        written=f"{written}, {to}{_convention(to, wishes.target)}",
        lost=lost,
        notes=_residual(spot, rig) if rig else (),
    )


def _residual(digitisation: Digitisation, rig: Rig) -> tuple[str, ...]:
    """Say how well the places that cameras give to points explain their pixels, where two cameras or more see any."""
    if digitisation.residual_px is None or not np.isfinite(digitisation.residual_px).any():
        return ()
    median_px = float(np.nanmedian(digitisation.residual_px))
    is_large = median_px > LARGE * max(max(camera.size) for camera in rig)
    doubt = "; this is large: are --origin, the order of --cameras and the frames right?" if is_large else ""
    return (f"the points' places leave a median residual of {median_px:.2f} px{doubt}",)


def _points_kind(source: Path) -> str | None:
    """Tell which kind of points a file holds; None for anything else."""
    if source.is_dir():
        return "openpose" if any(source.glob("*/*.json")) and not any(source.glob("*.y*ml")) else None
    first = _first_line(source)
    if first.startswith("PK"):
        return "npz"
    if is_xypts(first):
        return "dltdv"
    names = first.split(",")
    return "digitised" if names[0] in ("frame", "field") and any(name.endswith("_u") for name in names) else None


def _first_line(source: Path) -> str:
    try:
        with source.open("rb") as file:
            head = file.read(100_000)
    except OSError as error:
        raise AirborneError(f"{source} cannot be read ({error.strerror}); give a file to convert") from None
    return head.decode("utf-8-sig", errors="replace").split("\n", 1)[0].strip()


def _points_format_of_name(target: Path, source: Path) -> str:
    for ending, kind in {"xypts.csv": "dltdv", ".csv": "digitised", ".npz": "npz"}.items():
        if target.name.endswith(ending):
            return kind
    if not target.suffix:
        return "openpose"
    raise AirborneError(
        f"{source} holds points in pictures, not cameras; for {target} give a name ending in xypts.csv, .csv or .npz, "
        "or a folder"
    )


def _check_options(wishes: Wishes, kind: str, to: str) -> None:
    idle = sorted(wishes.said - _FROM[kind] - _TO.get(to, frozenset()))
    if idle:
        about = f"a {to} file to write" if idle[0].startswith("--to-") else f"a {kind} file to read"
        raise AirborneError(f"{idle[0]} says nothing about {about}; leave it out")


def _read_points(source: Path, kind: str, wishes: Wishes, rig: Rig | None) -> Digitisation:
    names = wishes.cameras or (rig.names if rig else ())
    if kind == "dltdv":
        return read_digitisation(source, _with_sizes(wishes.source, rig), names)
    if kind == "digitised":
        if not names:
            raise AirborneError(f"{source}: say which cameras its columns are of: --cameras cam1,cam2,...")
        return Digitisation(points=_by_frame(read_clicked_frames(source, names), names))
    return Digitisation(points=read_detections(source, names or cameras_in(source), person=wishes.person))


def _by_frame(digitised: Digitised, cameras: tuple[str, ...]) -> Detections:
    """Put clicked points at their own frames, from 0."""
    index = digitised.index
    is_huge = int(index.max()) * digitised.px[0].size > _MOST_NUMBERS
    if len(set(index.tolist())) < len(index) or index.min() < 0 or is_huge:
        raise AirborneError(f"the frames of the clicked points go from {index.min()} to {index.max()}; mend them")
    px = np.full((index.max() + 1, *digitised.px.shape[1:]), np.nan)
    px[index] = digitised.px
    return Detections.of_clicks(cameras, digitised.points, px)


def _write_digitised(target: Path, points: Detections) -> str:
    rows = np.flatnonzero(points.visibility.any(axis=(1, 2)))
    write_clicked_frames(target, Digitised(index=rows, points=points.points, px=points.px[rows]), points.cameras)
    return str(target)


def _write_dltdv(target: Path, read: Digitisation, wishes: Wishes, rig: Rig | None) -> tuple[str, tuple[str, ...]]:
    given = _with_sizes(replace(wishes.target, size=wishes.source.size), rig)
    files = write_digitisation(target, read, given)
    return ", ".join(map(str, files)), (*_renamed("pt", read.points.points), *_renamed("cam", read.points.cameras))


def _renamed(stem: str, names: tuple[str, ...]) -> tuple[str, ...]:
    """Say that names become numbers."""
    if names == tuple(f"{stem}{k}" for k in range(1, len(names) + 1)):
        return ()
    listed = ", ".join(names if len(names) < 6 else (*names[:3], "...", names[-1]))
    return (f"names: {stem}1 to {stem}{len(names)} for {listed}",)


def _with_sizes(given: Given, rig: Rig | None) -> Given:
    """Add the sizes of the rig's pictures where none were given."""
    return replace(given, size={camera.name: camera.size for camera in rig}) if rig and given.size is None else given


def _convention(to: str, given: Given) -> str:
    """Say in which unit and from where pixels are counted, where the format leaves a choice."""
    if to not in ("dlt", "dltdv"):
        units = UNITS.get(to, ())
        return f", lengths in {given.unit or units[0]}" if len(units) > 1 else ""
    return f", lengths in {given.unit or 'm'}, pixels from the {given.pixels.corner}, the first is {given.pixels.base}"
