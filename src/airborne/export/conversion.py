"""Conversion of files of cameras or of image points: formats recognised by content, losses reported."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from airborne.cameras import Detections, Rig, read_detections, read_rig
from airborne.cameras.detections import camera_names, write_detections
from airborne.cameras.files import (
    FORMAT_UNITS,
    FORMATS_WITH_ERRORS,
    CalibrationFile,
    build_rig,
    format_of_name,
    open_calibration,
    write_rig,
)
from airborne.cameras.formats.dltdv import (
    Digitisation,
    is_xypts,
    read_digitisation,
    triangulate_digitisation,
    write_digitisation,
)
from airborne.cameras.formats.options import FileOptions
from airborne.cameras.units import check_baselines
from airborne.errors import AirborneError, CalibrationError, count
from airborne.evaluation import DigitisedPoints, read_clicked_frames, write_clicked_frames
from airborne.io.text import read_toml

_POINT_FORMATS = ("digitised", "dltdv", "npz", "openpose")
FORMATS = (*FORMAT_UNITS, *_POINT_FORMATS)
_LARGE_RESIDUAL = 0.01  # of an image's longer side: a larger median residual has other causes than inexact clicks
_MOST_NUMBERS = 20_000_000  # of a table of clicked points
_PIXELS = frozenset({"--origin", "--pixel-base"})
_NAMES = frozenset({"--cameras", "--calibration"})
_EXPECTED_POINTS = "points in images: tables frame,<point>_<camera>_u,..., DLTdv's xypts, .npz, OpenPose's folders"
_EXPECTED = f"calibrations, or {_EXPECTED_POINTS}"
_OTHERS = (
    ({"run.json"}, "a run's folder, which `airborne export` hands on"),
    ({"point"}, "control points or a court's points, by which `airborne calibrate` finds cameras"),
    ({"time_s"}, "a table of motion"),
    ({"segment"}, "a body file"),
    ({"camera", "body"}, "a trial file, which names its calibration"),
    ({"camera"}, "a file of sources, by which `airborne calibrate` finds cameras"),
)  # contents of files and folders that hold neither cameras nor image points
_FROM: Mapping[str, frozenset[str]] = {
    **dict.fromkeys(FORMAT_UNITS, frozenset({"--unit"})),
    "opencv": frozenset({"--unit", "--size"}),
    "dlt": frozenset({"--unit", "--size"}) | _PIXELS,
    "dltdv": frozenset({"--unit", "--size"}) | _PIXELS | _NAMES,
    "digitised": _NAMES,
    "npz": _NAMES | {"--skeleton"},
    "openpose": _NAMES | {"--person", "--skeleton"},
}  # the options that apply to a file that is read
_TO: Mapping[str, frozenset[str]] = {
    **dict.fromkeys(FORMATS, frozenset()),
    **{name: frozenset({"--to-unit"}) for name in ("aniposelib", "opencv", "easymocap")},
    "dlt": frozenset({"--to-unit", "--to-origin", "--to-pixel-base"}),
    "dltdv": frozenset({"--to-unit", "--to-origin", "--to-pixel-base", "--size", "--calibration"}),
}  # and to a file that is written


@dataclass(frozen=True, slots=True, kw_only=True)
class ConversionOptions:
    """What the user specifies about the two files."""

    to: str | None = None  # one of FORMATS; None: from the name of the file to write
    source: FileOptions = field(default_factory=FileOptions)
    target: FileOptions = field(default_factory=FileOptions)
    cameras: tuple[str, ...] = ()  # the names of the cameras of points
    calibration: Path | None = None  # cameras that triangulate the points
    person: int | None = None  # of OpenPose's people
    skeleton: str | None = None  # of detections
    given_options: frozenset[str] = frozenset()  # the options that were given


@dataclass(frozen=True, slots=True, kw_only=True)
class Conversion:
    """What was done: what was read, what was written, what the new file does not hold, and warnings, a line each."""

    read: str
    written: str
    lost: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def describe(self) -> str:
        """Return the lines."""
        lost = [f"not in the new file: {'; '.join(self.lost)}"] if self.lost else []
        notes = [f"note: {note}" for note in self.notes]
        return "\n".join([f"read: {self.read}", f"written: {self.written}", *lost, *notes])


def convert(source: Path, target: Path, options: ConversionOptions) -> Conversion:
    """Read one file and write the other. Raises AirborneError where one cannot be, or an option does not apply."""
    if source.exists() and target.exists() and source.samefile(target):
        raise AirborneError(f"{target} is the file that is read; give another name for what is written")
    kind = _point_format(source)
    if kind is None:
        return _convert_rig(_open_calibration(source), target, options)
    return _convert_points(source, kind, target, options)


def _open_calibration(source: Path) -> CalibrationFile:
    """Open a calibration. Raises AirborneError, saying what another file looks like."""
    present = _names_in(source)
    for names, what in _OTHERS:
        if names <= present:
            raise AirborneError(f"{source} looks like {what}; convert takes {_EXPECTED}")
    try:
        return open_calibration(source)
    except CalibrationError as error:
        raise AirborneError(f"{error}; or {_EXPECTED_POINTS}") from None


def _names_in(source: Path) -> set[str]:
    """Return a folder's files, a table's columns, or the top-level keys of a TOML file, except cameras."""
    if source.is_dir():
        return {path.name for path in source.iterdir()}
    try:
        return {key for key, value in read_toml(source).items() if not (isinstance(value, dict) and "matrix" in value)}
    except OSError:
        return set()
    except tomllib.TOMLDecodeError:
        return set(_first_line(source).split(","))


def _convert_rig(file: CalibrationFile, target: Path, options: ConversionOptions) -> Conversion:
    to = options.to or format_of_name(target)
    if to in _POINT_FORMATS:
        raise AirborneError(
            f"{file.where} holds cameras, which cannot be written as {to}; choose from {', '.join(FORMAT_UNITS)}"
        )
    _check_options(options, file.format, to)
    rig = build_rig(file, options.source)
    errors_px = file.errors_px if file.errors_px.keys() >= set(rig.names) else None
    lost = write_rig(
        target, rig, format=to, unit=options.target.unit, pixels=options.target.pixels, errors_px=errors_px
    )
    if errors_px and to not in FORMATS_WITH_ERRORS:
        lost = (*lost, "the cameras' reprojection errors")
    return Conversion(
        read=f"{file.where}, {file.format}, {count(len(rig), 'camera')}: {', '.join(rig.names)}",
        written=f"{target}, {to}{_convention(to, options.target)}",
        lost=lost,
        notes=tuple(f"{finding.what}; is --unit {options.source.unit} right?" for finding in check_baselines(rig)),
    )


def _convert_points(source: Path, kind: str, target: Path, options: ConversionOptions) -> Conversion:
    to = options.to or _points_format_of_name(target, source)
    if to not in _POINT_FORMATS:
        raise AirborneError(f"{source} holds points in images, not cameras; write one of {', '.join(_POINT_FORMATS)}")
    _check_options(options, kind, to)
    rig = read_rig(options.calibration) if options.calibration else None
    read = _read_points(source, kind, options, rig)
    triangulated = triangulate_digitisation(read.points, rig) if rig else read
    if to == "dltdv":
        written, lost = _write_dltdv(target, triangulated, options, rig)
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
    sizes = ", ".join([count(n_frames, "frame"), count(n_points, "point"), count(n_cameras, "camera")])
    counts = f"{sizes}: {', '.join(read.points.cameras)}"
    notes = "".join(f"; {note}" for note in read.points.notes)
    return Conversion(
        read=f"{source}, {kind}, {counts}{notes}",
        written=f"{written}, {to}{_convention(to, options.target)}",
        lost=lost,
        notes=_residual_note(triangulated, rig) if rig else (),
    )


def _residual_note(digitisation: Digitisation, rig: Rig) -> tuple[str, ...]:
    """Report the median reprojection residual of the triangulated points, where two cameras or more see any."""
    if digitisation.residual_px is None or not np.isfinite(digitisation.residual_px).any():
        return ()
    median_px = float(np.nanmedian(digitisation.residual_px))
    is_large = median_px > _LARGE_RESIDUAL * max(max(camera.size) for camera in rig)
    question = "; this is large: are --origin, the order of --cameras and the frames right?" if is_large else ""
    return (f"the points' places leave a median residual of {median_px:.2f} px{question}",)


def _point_format(source: Path) -> str | None:
    """Recognise the format of image points in a file; None for anything else."""
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
        f"{source} holds points in images, not cameras; for {target} give a name ending in xypts.csv, .csv or .npz, "
        "or a folder"
    )


def _check_options(options: ConversionOptions, kind: str, to: str) -> None:
    unused = sorted(options.given_options - _FROM[kind] - _TO.get(to, frozenset()))
    if unused:
        about = f"a {to} file to write" if unused[0].startswith("--to-") else f"a {kind} file to read"
        raise AirborneError(f"{unused[0]} does not apply to {about}; leave it out")


def _read_points(source: Path, kind: str, options: ConversionOptions, rig: Rig | None) -> Digitisation:
    names = options.cameras or (rig.names if rig else ())
    if kind == "dltdv":
        return read_digitisation(source, _with_sizes(options.source, rig), names)
    if kind == "digitised":
        if not names:
            raise AirborneError(f"{source}: say which cameras its columns are of: --cameras cam1,cam2,...")
        return Digitisation(points=_by_frame(read_clicked_frames(source, names), names))
    return Digitisation(
        points=read_detections(source, names or camera_names(source), person=options.person, skeleton=options.skeleton)
    )


def _by_frame(digitised: DigitisedPoints, cameras: tuple[str, ...]) -> Detections:
    """Put clicked points into an array by frame number, from 0."""
    index = digitised.index
    is_huge = int(index.max()) * digitised.px[0].size > _MOST_NUMBERS
    if len(set(index.tolist())) < len(index) or index.min() < 0 or is_huge:
        raise AirborneError(f"the frames of the clicked points go from {index.min()} to {index.max()}; correct them")
    px = np.full((index.max() + 1, *digitised.px.shape[1:]), np.nan)
    px[index] = digitised.px
    return Detections.from_clicks(cameras, digitised.points, px)


def _write_digitised(target: Path, points: Detections) -> str:
    rows = np.flatnonzero(points.visibility.any(axis=(1, 2)))
    write_clicked_frames(target, DigitisedPoints(index=rows, points=points.points, px=points.px[rows]), points.cameras)
    return str(target)


def _write_dltdv(
    target: Path, read: Digitisation, options: ConversionOptions, rig: Rig | None
) -> tuple[str, tuple[str, ...]]:
    given = _with_sizes(replace(options.target, size=options.source.size), rig)
    files = write_digitisation(target, read, given)
    return ", ".join(map(str, files)), (
        *_name_changes("pt", read.points.points),
        *_name_changes("cam", read.points.cameras),
    )


def _name_changes(stem: str, names: tuple[str, ...]) -> tuple[str, ...]:
    """Report that names become numbers."""
    if names == tuple(f"{stem}{k}" for k in range(1, len(names) + 1)):
        return ()
    listed = ", ".join(names if len(names) < 6 else (*names[:3], "...", names[-1]))
    return (f"names: {stem}1 to {stem}{len(names)} for {listed}",)


def _with_sizes(given: FileOptions, rig: Rig | None) -> FileOptions:
    """Add the image sizes of the rig where none are given."""
    return replace(given, size={camera.name: camera.size for camera in rig}) if rig and given.size is None else given


def _convention(to: str, given: FileOptions) -> str:
    """Describe the unit and the pixel origin, where the format leaves a choice."""
    if to not in ("dlt", "dltdv"):
        units = FORMAT_UNITS.get(to, ())
        return f", lengths in {given.unit or units[0]}" if len(units) > 1 else ""
    return f", lengths in {given.unit or 'm'}, pixels from the {given.pixels.corner}, the first is {given.pixels.base}"
