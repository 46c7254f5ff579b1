"""The command that calibrates cameras."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from airborne.cli.console import Json, errors, sizes_px
from airborne.errors import AirborneError, count
from airborne.io.files import find_copies
from airborne.io.terminal import Stages
from airborne.io.writing import missing_folder, write_text

_TABLES = (".csv", ".tsv", ".txt")  # other files are videos


def calibrate_command(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="A file of sources (.toml); or a table of points (.csv); or each camera's video of a board or a wand."
        ),
    ],
    *,
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file to write (Pose2Sim TOML).")],
    size: Annotated[
        str | None,
        typer.Option(help="Tables: image size in pixels, WIDTHxHEIGHT, or name=WIDTHxHEIGHT,..."),
    ] = None,
    method: Annotated[
        Literal["lm", "annealing"], typer.Option(help="Control points: least squares, or simulated annealing.")
    ] = "lm",
    board: Annotated[Path | None, typer.Option(help="The board's file: columns, rows, square_m, dictionary.")] = None,
    timestamps: Annotated[
        Path | None, typer.Option(help="Which frames are simultaneous: sync_index,cam_id,frame_time.")
    ] = None,
    court: Annotated[
        str | None, typer.Option(help="The file holds clicked points of a court; its net: men, women, or metres.")
    ] = None,
    wand: Annotated[
        float | None,
        typer.Option(
            help="The videos show a wand, or the table holds its tracks; its two markers' distance in metres."
        ),
    ] = None,
    fisheye: Annotated[bool, typer.Option("--fisheye", help="With --board: the lenses are fisheyes.")] = False,
    report: Annotated[
        Path | None,
        typer.Option(help="Folder for report.json and a figure of each camera; <output>_report by default."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Calibrate cameras from control points, boards, wands, courts or detections, alone or together.

    Example: airborne calibrate --board charuco.toml cam_0.mp4 cam_1.mp4 -o calib.toml
    """
    for path in (*files, board, timestamps):
        if path is not None and not path.exists():
            raise AirborneError(f"{path} does not exist; check the path")
        if path is not None and output.exists() and output.samefile(path):
            raise AirborneError(f"-o {output} is what the cameras are calibrated from; give the result another name")
    if output.suffix.lower() != ".toml":
        raise AirborneError(f"-o {output}: give a name that ends with .toml; `airborne convert` writes other formats")
    if not output.parent.is_dir():
        raise AirborneError(f"-o {missing_folder(output)}")
    if output.exists() and not _is_calibration(output):
        raise AirborneError(f"-o {output} exists and is not a calibration; give the result another name")
    for option, is_given in (("--fisheye", fisheye), ("--timestamps", timestamps is not None)):
        if is_given and board is None:
            raise AirborneError(f"{option} goes with --board; a file of sources says both for each camera or board")
    if board is None and files[0].is_dir():
        raise AirborneError(f"{files[0]} is a folder; give a table or a file of sources, or --board for its images")
    is_table = board is None and len(files) == 1 and files[0].suffix.lower() in _TABLES
    if method != "lm" and (court is not None or wand is not None or not is_table):
        raise AirborneError(f"--method {method} goes with a table of control points")
    if court is not None or wand is not None:
        is_filmed = court is None and (len(files) > 1 or files[0].suffix.lower() not in _TABLES)
        sources = _wand_sources(files, wand, size) if is_filmed else _table_sources(files, court, wand, size)
        _from_sources(sources, output, report or output.with_name(f"{output.stem}_report"), as_json)
        return
    if board is None and files[0].suffix.lower() not in (*_TABLES, ".toml"):
        raise AirborneError(
            f"{files[0]} is neither a table nor a file of sources; videos and images need --board or --wand"
        )
    if is_table:
        if report is not None:
            raise AirborneError("--report goes with sources; the result of a table of control points alone is printed")
        _from_control_points(files[0], size, output, method=method, as_json=as_json)
        return
    if size is not None:
        raise AirborneError("--size goes with a table of control points; a file of sources has size = [width, height]")
    if board is not None:
        sources = _board_sources(files, board, timestamps, fisheye)
    elif len(files) == 1:
        sources = _read_sources(files[0])
    else:
        raise AirborneError(f"{len(files)} files are given without --board; give one file of sources, or the board's")
    _from_sources(sources, output, report or output.with_name(f"{output.stem}_report"), as_json)


def _from_control_points(
    points: Path, size: str | None, output: Path, *, method: Literal["lm", "annealing"], as_json: bool
) -> None:
    from airborne.calibration import calibrate as calibrate_cameras
    from airborne.calibration import read_control_points
    from airborne.calibration.acceptance import CalibrationErrors, write_accepted
    from airborne.calibration.points_report import describe_points_calibration, points_calibration_to_dict

    if size is None:
        raise AirborneError("--size is missing: give the image size in pixels, such as 768x576")
    table = read_control_points(points)
    calibration = calibrate_cameras(table, _sizes(size, table.cameras), method=method)
    written, reasons = write_accepted(output, calibration.rig, CalibrationErrors.of(calibration, table.names))
    report = (
        json.dumps(points_calibration_to_dict(calibration)) if as_json else describe_points_calibration(calibration)
    )
    _print_result(report, written, reasons, as_json=as_json)


def _read_sources(path: Path) -> Any:
    from airborne.calibration import read_sources

    return read_sources(path)


def _board_sources(videos: list[Path], board: Path, timestamps: Path | None, fisheye: bool) -> Any:
    """Return the sources of a board in videos, or in folders of images; cameras are named like these."""
    from airborne.calibration import sources_from

    _refuse_copies(videos)
    media = [{"pictures" if path.is_dir() else "video": str(path.resolve())} for path in videos]
    lens = "fisheye" if fisheye else "brown"
    table = {"file": str(board.resolve()), **({"timestamps": str(timestamps.resolve())} if timestamps else {})}
    cameras = [{"name": path.stem, "lens": lens, **medium} for path, medium in zip(videos, media, strict=True)]
    return sources_from({"camera": cameras, "board": table}, Path(), "the videos")


def _wand_sources(videos: list[Path], length_m: float | None, size: str | None) -> Any:
    """Return the sources of a wand in videos; cameras are named like these."""
    from airborne.calibration import sources_from

    if size is not None:
        raise AirborneError("--size goes with a table; videos have their own")
    _check_wand(length_m)
    _refuse_copies(videos)
    cameras = [{"name": path.stem, "video": str(path.resolve())} for path in videos]
    return sources_from({"camera": cameras, "wand": {"length_m": length_m}}, Path(), "the videos")


def _refuse_copies(videos: list[Path]) -> None:
    """Raise AirborneError where two cameras' videos have the same content."""
    for first, second, *_ in find_copies([path for path in videos if path.is_file()]):
        raise AirborneError(f"{first} and {second} are the same video; give each camera its own")


def _check_wand(length_m: float | None) -> None:
    from airborne.calibration.sources.wand import LENGTH_RANGE_M

    if length_m is not None and not LENGTH_RANGE_M[0] <= length_m <= LENGTH_RANGE_M[1]:
        raise AirborneError(
            f"--wand {length_m:g}: expected the distance between the two markers, {LENGTH_RANGE_M[0]:g} to "
            f"{LENGTH_RANGE_M[1]:g} metres, not millimetres"
        )


def _table_sources(files: list[Path], court: str | None, wand_m: float | None, size: str | None) -> Any:
    """Return the sources of one table: clicked points of a court, or a wand's tracks (cameras named by --size)."""
    from airborne.calibration import sources_from
    from airborne.calibration.sources.control_points import read_control_points
    from airborne.calibration.sources.court import court_points
    from airborne.cameras.formats.dltdv import read_xypts
    from airborne.cameras.formats.options import FileOptions

    if len(files) != 1 or (court is None) == (wand_m is None):
        raise AirborneError("--court and --wand go with one table each; for several sources write a file of sources")
    if size is None:
        raise AirborneError("--size is missing: give the image size in pixels, such as 1920x1080")
    _check_wand(wand_m)
    path = files[0].resolve()
    if court is not None:
        net = court if court in ("men", "women") else _metres(court)
        names, table = read_control_points(path, court_points(net)).cameras, {"court": {"file": str(path), "net": net}}
    else:
        names_in_size = tuple(item.partition("=")[0] for item in size.split(",") if "=" in item)
        names, table = (
            names_in_size or read_xypts(path, FileOptions()).cameras,
            {"wand": {"file": str(path), "length_m": wand_m}},
        )
    cameras = [{"name": name, "size": list(own)} for name, own in _sizes(size, names).items()]
    return sources_from({"camera": cameras, **table}, Path(), str(path))


def _is_calibration(path: Path) -> bool:
    from airborne.cameras import read_rig

    try:
        read_rig(path, unit="m")
    except AirborneError:
        return False
    return True


def _metres(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise AirborneError(f"--court {text}: expected men, women, or the net's height in metres") from None


def _from_sources(sources: Any, output: Path, folder: Path, as_json: bool) -> None:
    from airborne.calibration import calibrate_from
    from airborne.calibration.acceptance import CalibrationErrors, write_accepted
    from airborne.calibration.report import calibration_to_dict, describe_calibration
    from airborne.calibration.residual_figures import write_residual_figures

    with Stages() as stages:
        calibration = calibrate_from(sources, stages)
    report = calibration_to_dict(calibration)
    written, reasons = write_accepted(output, calibration.rig, CalibrationErrors.of(calibration))
    pictures = write_residual_figures(folder, calibration)
    write_text(folder / "report.json", json.dumps(report, indent=1))
    beside = f"report: {folder / 'report.json'} and {count(len(pictures), 'image')} beside it"
    text = json.dumps(report) if as_json else f"{describe_calibration(calibration)}\n{beside}"
    _print_result(text, written, reasons, as_json=as_json)


def _print_result(text: str, written: Path, reasons: tuple[str, ...], *, as_json: bool) -> None:
    """Print a calibration; before it why it was rejected, and then end with exit code 1."""
    if reasons:
        reasons = (*reasons, f"do not measure with this calibration; to look at it: {written}")
    for reason in reasons:
        errors.print(f"airborne: {reason}", style="red", markup=False)
    print(text)
    if reasons:
        raise typer.Exit(1)
    if not as_json:
        print(f"written: {written}")


def _sizes(text: str, names: tuple[str, ...]) -> dict[str, tuple[int, int]]:
    """Return the image size of every camera."""
    sizes = sizes_px(text)
    sizes = (dict.fromkeys(names, sizes.pop("")) if "" in sizes else {}) | sizes
    missing = [name for name in names if name not in sizes]
    if missing:
        raise AirborneError(f"--size gives no size for {', '.join(missing)}; add {missing[0]}=WIDTHxHEIGHT")
    return sizes
