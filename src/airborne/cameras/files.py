"""Calibration files: recognised by their content, not by their names; each format has its module in `formats/`."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from airborne.cameras.camera import Rig
from airborne.cameras.formats.aniposelib import aniposelib_text
from airborne.cameras.formats.caliscope import caliscope_losses, caliscope_text, rig_from_caliscope
from airborne.cameras.formats.dlt import dlt_losses, dlt_text, is_dlt, rig_from_dlt
from airborne.cameras.formats.opencv import easymocap_texts, halves_in, opencv_text, parse_opencv, rig_from_opencv
from airborne.cameras.formats.options import FileOptions, PixelConvention, Unit
from airborne.cameras.formats.pose2sim import pose2sim_text, rig_from_tables
from airborne.cameras.formats.qualisys import qualisys_text, rig_from_qualisys
from airborne.cameras.formats.vicon import rig_from_vicon, vicon_losses, vicon_text
from airborne.cameras.formats.xml import parse_xml
from airborne.cameras.units import FARTHEST_M, check_baselines, longest_baseline_m
from airborne.errors import CalibrationError
from airborne.io.names import to_path
from airborne.io.text import parse_toml, read_bytes, read_text
from airborne.io.writing import missing_folder, write_text
from airborne.types import Size

_LARGEST_FILE_BYTES = 2_000_000  # a hundred cameras take a tenth of it

_EXPECTED = (
    "expected Pose2Sim, aniposelib or Caliscope TOML, Qualisys .qca.txt, Vicon .xcp, OpenCV YAML or DLT coefficients"
)
_SUFFIXES = {
    **{".toml": "pose2sim", ".qca.txt": "qualisys", ".xcp": "vicon"},
    **{".yml": "opencv", ".yaml": "opencv", ".csv": "dlt"},
}
FORMATS_WITH_ERRORS = frozenset({"pose2sim", "caliscope"})
FORMAT_UNITS: dict[str, tuple[Unit, ...]] = {
    **{"pose2sim": ("m",), "aniposelib": ("m", "mm"), "caliscope": ("m",), "qualisys": ("mm",)},
    **{"vicon": ("mm",), "opencv": ("m", "mm"), "easymocap": ("m", "mm"), "dlt": ("m", "mm")},
}  # of lengths as a format is written, the usual one first
_XML_ROOTS = {"calibration": ("qualisys", rig_from_qualisys), "Cameras": ("vicon", rig_from_vicon)}


@dataclass(frozen=True, slots=True)
class CalibrationFile:
    """A calibration file of a recognised format; `build` makes the rig."""

    format: str  # one of FORMAT_UNITS; pose2sim also for aniposelib, which has the same layout
    where: str
    build: Callable[[FileOptions], Rig]
    errors_px: Mapping[str, float] = field(default_factory=dict)  # reprojection RMS by camera, where it says them


def read_rig(
    path: str | Path,
    *,
    unit: Unit | None = None,
    size: Size | Mapping[str, Size] | None = None,
    pixels: PixelConvention | None = None,
) -> Rig:
    """Read a calibration of any known format, in the file's order of cameras; a folder of OpenCV YAML counts as one.

    unit: of the file's lengths; None takes what the format defines (Pose2Sim's layout: metres). size: of the images,
    (width, height) [px], for formats that do not hold it: DLT coefficients, some OpenCV files. pixels: the pixel
    convention of DLT coefficients; None is DLTdv 8's. Raises CalibrationError for a file of no known format, and where
    no unit is given and the cameras stand more than 200 m apart or all within 5 cm of each other.
    """
    return build_rig(open_calibration(path), FileOptions(unit=unit, size=size, pixels=pixels or PixelConvention()))


def build_rig(file: CalibrationFile, options: FileOptions) -> Rig:
    """Build the rig of a calibration file and check it against the options (see `read_rig`)."""
    rig = file.build(options)
    for camera in rig:
        size = options.size.get(camera.name) if isinstance(options.size, Mapping) else options.size
        if size not in (None, camera.size):
            size_text = f"{camera.size[0]}x{camera.size[1]}"
            raise CalibrationError(
                f"{file.where} says that '{camera.name}' has images of {size_text}; leave --size out"
            )
    if options.unit is None and check_baselines(rig):
        farthest_m = longest_baseline_m(rig)
        is_far = farthest_m > FARTHEST_M
        question, distance = (
            ("millimetres? Then say --unit mm", ".0f") if is_far else ("metres? Then say --unit m", ".3g")
        )
        raise CalibrationError(
            f"{file.where}: the cameras lie up to {farthest_m:{distance}} m from each other; are its lengths in "
            f"{question} to `airborne convert`, which writes the file anew, in metres"
        )
    return rig


def open_calibration(path: str | Path) -> CalibrationFile:
    """Recognise the format of a calibration file. Raises CalibrationError for a file of no known format."""
    path = to_path(path)
    where = str(path)
    if path.is_dir():
        return _opencv_calibration(path, where, _opencv_folder(path))
    text = _read_text(path)
    if not text.strip():
        raise CalibrationError(f"{where} is empty; {_EXPECTED}")
    if text.lstrip().startswith("<"):
        root = parse_xml(text, where)
        if root.tag not in _XML_ROOTS:
            raise CalibrationError(f"{where} is XML with the root <{root.tag[:60]}>; {_EXPECTED}")
        name, build = _XML_ROOTS[root.tag]
        return CalibrationFile(name, where, partial(build, root, where))
    if text.startswith("%YAML"):
        return _opencv_calibration(path, where, parse_opencv(text, where))
    if is_dlt(text):
        return CalibrationFile("dlt", where, partial(rig_from_dlt, text, where))
    try:
        document = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        first = text.strip().splitlines()[0][:40]
        content = f"as TOML, {_short(error)}" if path.suffix.lower() == ".toml" else f"it begins with {first!r}"
        is_points = {"point", "x_m"} <= set(text.strip().splitlines()[0].split(","))
        mend = f'; in a trial say control_points = "{path.name}", in Python calibrate with it' if is_points else ""
        raise CalibrationError(f"{where} is not a calibration ({content}); {_EXPECTED}{mend}") from None
    if isinstance(document.get("cameras"), dict):
        named = {f"cam_{key}": table for key, table in document["cameras"].items()}
        return CalibrationFile("caliscope", where, partial(rig_from_caliscope, document, where), _errors_px(named))
    tables = {key: table for key, table in document.items() if isinstance(table, dict)}
    named = {str(table.get("name", key)): table for key, table in tables.items()}
    return CalibrationFile("pose2sim", where, partial(rig_from_tables, document, where), _errors_px(named))


def _errors_px(tables: Mapping[str, Any]) -> dict[str, float]:
    """Return the errors that tables of cameras state, by name; 0 stands for unknown."""
    errors = {name: table.get("error") for name, table in tables.items() if isinstance(table, dict)}
    return {name: error for name, error in errors.items() if isinstance(error, float) and 0 < error < math.inf}


def write_rig(
    path: str | Path,
    rig: Rig,
    *,
    format: str | None = None,
    unit: Unit | None = None,
    pixels: PixelConvention | None = None,
    errors_px: Mapping[str, float] | None = None,
) -> tuple[str, ...]:
    """Write a calibration and return what the format cannot hold, a phrase each; `read_rig` restores the rest.

    format: a key of `FORMAT_UNITS`; None goes by the file's name. easymocap makes a folder with two files. unit: of
    lengths, where the format leaves a choice. pixels: the pixel convention of DLT coefficients; None is DLTdv 8's.
    errors_px: reprojection RMS by camera, written by pose2sim and caliscope. Raises CalibrationError.
    """
    path = to_path(path)
    if not isinstance(rig, Rig):
        raise CalibrationError(f"write_rig writes a Rig (found {str(rig)[:100]}); give Rig((camera, ...)) for cameras")
    kind = format or format_of_name(path)
    file_unit = _unit(kind, unit)
    texts, notes = _texts(kind, rig, file_unit, pixels=pixels or PixelConvention(), errors_px=errors_px)
    if kind == "easymocap":
        path.mkdir(parents=True, exist_ok=True)
    if not path.parent.is_dir():
        raise CalibrationError(missing_folder(path))
    for name, text in texts.items():
        write_text(path / name, text)  # path / "" is path itself
    return (*notes, "how well the cameras are known") if kind != "pose2sim" and rig.states_errors else notes


def write_pose2sim(path: str | Path, rig: Rig, *, errors_px: Mapping[str, float] | None = None) -> None:
    """Write a Pose2Sim `Calib.toml`; `read_rig` restores the numbers, the rotation up to rounding.

    A fifth distortion term is written where there is one. errors_px: reprojection RMS by camera; each stands in its
    camera's table as `error`, their RMS in `[metadata]`.
    """
    write_rig(path, rig, format="pose2sim", errors_px=errors_px)


def format_of_name(path: Path) -> str:
    """Return the format that a file's name asks for. Raises CalibrationError."""
    for suffix, kind in _SUFFIXES.items():
        if path.name.lower().endswith(suffix):
            return kind
    raise CalibrationError(
        f"{path}: the file name does not tell the format; end it in {', '.join(_SUFFIXES)}, or name the format "
        "(format=..., --to)"
    )


def _texts(
    kind: str, rig: Rig, unit: Unit, *, pixels: PixelConvention, errors_px: Mapping[str, float] | None
) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the texts by file name, and what they cannot hold."""
    if kind == "easymocap":
        return easymocap_texts(rig, unit), ()
    write = {
        "pose2sim": lambda: (pose2sim_text(rig, errors_px), ()),
        "aniposelib": lambda: (aniposelib_text(rig, unit), ()),
        "caliscope": lambda: (caliscope_text(rig, errors_px), caliscope_losses(rig)),
        "qualisys": lambda: (qualisys_text(rig), ()),
        "vicon": lambda: (vicon_text(rig), vicon_losses(rig)),
        "opencv": lambda: (opencv_text(rig, unit), ()),
        "dlt": lambda: (dlt_text(rig, pixels, unit), dlt_losses(rig)),
    }
    text, notes = write[kind]()
    return {"": text}, notes


def _unit(kind: str, unit: Unit | None) -> Unit:
    if kind not in FORMAT_UNITS:
        raise CalibrationError(f"no calibration format '{kind}'; choose from {', '.join(FORMAT_UNITS)}")
    if unit not in (None, *FORMAT_UNITS[kind]):
        raise CalibrationError(f"{kind} files are always in {FORMAT_UNITS[kind][0]}; leave the unit out")
    return unit or FORMAT_UNITS[kind][0]


def _read_text(path: Path) -> str:
    try:
        return read_text(path, _LARGEST_FILE_BYTES)
    except OSError as error:
        raise CalibrationError(f"{path} cannot be read ({error.strerror}); give a calibration file") from None
    except ValueError as error:
        raise CalibrationError(f"{path}: {error}; {_EXPECTED}") from None


def _opencv_calibration(path: Path, where: str, document: dict[str, Any]) -> CalibrationFile:
    """Return an OpenCV calibration; if the file holds intrinsics or extrinsics only, look for the others beside it."""
    if path.is_file() and len(halves_in(document)) == 1:
        beside = [_opencv_file(other) for other in files_beside(path)]
        others = [other for other in beside if len(halves_in(other) | halves_in(document)) == 2]
        if len(others) == 1:
            document = others[0] | document
    return CalibrationFile("opencv", where, partial(rig_from_opencv, document, where))


def _opencv_folder(folder: Path) -> dict[str, Any]:
    documents = [_opencv_file(path) for path in _yaml_files(folder)]
    if not documents:
        raise CalibrationError(f"{folder} is a folder without OpenCV YAML (intri.yml, extri.yml); {_EXPECTED}")
    return {key: node for document in documents for key, node in document.items()}


def _opencv_file(path: Path) -> dict[str, Any]:
    return parse_opencv(_read_text(path), str(path))


def files_beside(path: Path) -> list[Path]:
    """Return the files beside an OpenCV calibration among which its other half is looked for."""
    if _begin(path) != b"%YAML":
        return []
    return [other for other in _yaml_files(path.parent) if other != path]


def _yaml_files(folder: Path) -> list[Path]:
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in (".yml", ".yaml") and path.is_file())
    return [path for path in paths if _begin(path) == b"%YAML"]


def _begin(path: Path) -> bytes:
    try:
        return read_bytes(path, _LARGEST_FILE_BYTES)[:5]
    except ValueError:
        return b""


def _short(error: Exception) -> str:
    return " ".join(str(error).lower().split())[:120]
