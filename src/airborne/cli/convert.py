"""The command that converts file formats."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from airborne.cli.console import sizes_px
from airborne.errors import AirborneError

_Unit = Literal["m", "mm"]
_Corner = Literal["upper-left", "lower-left"]


def convert_command(
    source: Annotated[Path, typer.Argument(metavar="IN", help="Cameras, clicked points or detections; any format.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="File to write; its name tells the format.")],
    *,
    to: Annotated[str | None, typer.Option(help="Format of OUT, if its name does not tell.")] = None,
    size: Annotated[
        str | None, typer.Option(help="Image size WIDTHxHEIGHT, or name=WIDTHxHEIGHT,..., if IN does not hold it.")
    ] = None,
    unit: Annotated[_Unit | None, typer.Option(help="Unit of the lengths in IN.")] = None,
    origin: Annotated[_Corner | None, typer.Option(help="The corner from which IN counts pixels.")] = None,
    pixel_base: Annotated[int | None, typer.Option(min=0, max=1, help="Number of IN's first pixel.")] = None,
    to_unit: Annotated[_Unit | None, typer.Option(help="Unit of the lengths in OUT.")] = None,
    to_origin: Annotated[_Corner | None, typer.Option(help="The corner from which OUT counts pixels.")] = None,
    to_pixel_base: Annotated[int | None, typer.Option(min=0, max=1, help="Number of OUT's first pixel.")] = None,
    cameras: Annotated[str | None, typer.Option(help="Names of the cameras of points, in order: left,right.")] = None,
    calibration: Annotated[
        Path | None, typer.Option(help="Cameras of points: their names, sizes, and positions for DLTdv's xyzpts.")
    ] = None,
    person: Annotated[int | None, typer.Option(min=0, help="Which of several people in OpenPose's files.")] = None,
    skeleton: Annotated[
        str | None, typer.Option(help="Whose points detections are, if IN does not say: BODY_25, BODY_25B, ...")
    ] = None,
) -> None:
    """Convert cameras, clicked points or detections; the format of IN follows from its content. DLT defaults: DLTdv 8.

    Example: airborne convert dltCoefs.csv calib.toml --size 1920x1080 --origin lower-left
    """
    from airborne.cameras.formats import FileOptions, PixelConvention
    from airborne.export.conversion import FORMATS, ConversionOptions
    from airborne.export.conversion import convert as convert_file

    if to is not None and to not in FORMATS:
        raise AirborneError(f"--to {to}: no such format; choose from {', '.join(FORMATS)}")
    options = {
        **{"--size": size, "--unit": unit, "--origin": origin, "--pixel-base": pixel_base, "--to-unit": to_unit},
        **{"--to-origin": to_origin, "--to-pixel-base": to_pixel_base, "--cameras": cameras},
        **{"--calibration": calibration, "--person": person, "--skeleton": skeleton},
    }
    conversion = ConversionOptions(
        to=to,
        source=FileOptions(
            unit=unit, size=_size(size), pixels=PixelConvention(origin or "upper-left", _base(pixel_base))
        ),
        target=FileOptions(unit=to_unit, pixels=PixelConvention(to_origin or "upper-left", _base(to_pixel_base))),
        cameras=tuple(name.strip() for name in (cameras or "").split(",") if name.strip()),
        calibration=calibration,
        person=person,
        skeleton=skeleton,
        given_options=frozenset(name for name, value in options.items() if value is not None),
    )
    print(convert_file(source, target, conversion).describe())


def _base(given: int | None) -> int:
    return 1 if given is None else given


def _size(text: str | None) -> tuple[int, int] | dict[str, tuple[int, int]] | None:
    """Return the image size of all cameras, or the sizes by camera."""
    sizes = {} if text is None else sizes_px(text)
    return sizes[""] if set(sizes) == {""} else sizes or None
