"""The command that finds cameras."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from airborne.cli.console import Json
from airborne.errors import AirborneError


def calibrate(
    points: Annotated[Path, typer.Argument(help="Control points: point,x_m,y_m,z_m,<camera>_u,<camera>_v,...")],
    size: Annotated[str, typer.Option(help="Image size in pixels, WIDTHxHEIGHT, or name=WIDTHxHEIGHT,...")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file to write (Pose2Sim TOML).")],
    method: Annotated[
        Literal["lm", "annealing"], typer.Option(help="Fit: least squares, or simulated annealing.")
    ] = "lm",
    as_json: Json = False,
) -> None:
    """Find the cameras from surveyed control points.

    Example: airborne calibrate control_points.csv --size 768x576 -o calib.toml
    """
    from airborne import cameras

    table = cameras.read_control_points(points)
    calibration = cameras.calibrate(table, _sizes(size, table.cameras), method=method)
    cameras.write_pose2sim(output, calibration.rig, errors_px={fit.name: fit.rms_px for fit in calibration.fits})
    print(json.dumps(cameras.to_dict(calibration)) if as_json else cameras.describe(calibration))
    if not as_json:
        print(f"written: {output}")


def _sizes(text: str, names: tuple[str, ...]) -> dict[str, tuple[int, int]]:
    """Parse 768x576 for all cameras, or cam1=768x576,cam2=1920x1080."""
    sizes = {}
    try:
        for item in text.split(","):
            name, _, numbers = item.rpartition("=")
            width, height = (int(number) for number in numbers.lower().split("x"))
            sizes |= {n: (width, height) for n in ([name] if name else names)}
    except ValueError:
        raise AirborneError(f"--size {text}: expected WIDTHxHEIGHT such as 768x576, or cam1=768x576,cam2=...") from None
    missing = [name for name in names if name not in sizes]
    if missing:
        raise AirborneError(f"--size gives no size for {', '.join(missing)}; add {missing[0]}=WIDTHxHEIGHT")
    return sizes
