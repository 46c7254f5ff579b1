"""A thing that is described in the studio: solids in one piece, as a body file holds them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from airborne.body.files import read_body
from airborne.body.model import LONGEST_M
from airborne.errors import BodyError
from airborne.io.names import check_name
from airborne.io.text import parse_toml
from airborne.io.writing import replace_text
from airborne.types import Image

MESHES = (".obj", ".ply", ".stl")
_AROUND_PX = 2  # of a click, to either side: noise and the codec's blocks go into a median
_MM = 0.001  # the unit that most meshes have [m]
_MOST_MM = 1000 * LONGEST_M
LABELS = {  # of the form
    "size_mm": "lengths [mm]",
    "centre_mm": "centre [mm]",
    "turn_deg": "turned about [°]",
    "scale": "its unit [m]",
}
_SIZES = {"box": "size_m", "ellipsoid": "semi_axes_m"}


@dataclass(frozen=True, slots=True)
class Solid:
    """One coloured solid of a thing; a number that is not given is NaN."""

    name: str
    shape: str = "box"  # "ellipsoid", or the file of a mesh
    size_mm: tuple[float, ...] = (100.0, 100.0, 100.0)  # full lengths along its axes; of a mesh unread
    centre_mm: tuple[float, ...] = (0.0, 0.0, 0.0)  # in the thing's axes
    turn_deg: tuple[float, ...] = (0.0, 0.0, 0.0)  # about x, then the new y, then the new z
    scale: float = _MM  # of a mesh: its unit in metres
    colour: tuple[int, ...] | None = None  # red, green, blue, 0 to 255; None: taken at the first pose


def check_thing(folder: Path, file: str, name: str, solids: Sequence[Solid]) -> str:
    """Return the body file of a thing that can be used in a folder. Raises BodyError, in the words of its form."""
    for solid in solids:
        _check_numbers(solid)
        try:
            check_name(solid.name)
        except ValueError as error:
            raise BodyError(f"{error}") from None
    if len({solid.name for solid in solids}) < len(solids):
        raise BodyError("two solids have the same name; give each its own")
    text, trial = thing_text(name, solids), folder / f"unchecked_{file}"
    try:
        replace_text(trial, text, is_durable=False)
        read_body(trial)
    except BodyError as error:
        raise BodyError(str(error).removeprefix(f"{trial.name}: ").replace(trial.name, file)) from None
    finally:
        trial.unlink(missing_ok=True)
    return text


def _check_numbers(solid: Solid) -> None:
    """Raise BodyError for a number of the form that is missing or out of range."""
    is_mesh = solid.shape not in _SIZES
    fields = {"centre_mm": solid.centre_mm, "turn_deg": solid.turn_deg}
    fields |= {"scale": (solid.scale,)} if is_mesh else {"size_mm": solid.size_mm}
    for key, values in fields.items():
        for axis, value in zip("xyz", values, strict=False):
            what = f"{solid.name}: {LABELS[key]}{'' if key == 'scale' else f' {axis}'}"
            if math.isnan(value):
                raise BodyError(f"{what} is missing; give a number")
            if key in ("size_mm", "scale") and value <= 0:
                raise BodyError(f"{what} is {value:g}; expected more than 0")
            if key.endswith("_mm") and abs(value) > _MOST_MM:
                raise BodyError(f"{what} is {value:g}; expected at most {_MOST_MM:g} mm")


def thing_text(name: str, solids: Sequence[Solid]) -> str:
    """Return a body file of one segment."""
    document, segment, parts = tomlkit.document(), tomlkit.table(), tomlkit.aot()
    document.add("name", name)
    for solid in solids:
        part = tomlkit.table()
        part.update(_part(solid))
        parts.append(part)
    segment.update({"name": "thing", "part": parts})
    segments = tomlkit.aot()
    segments.append(segment)
    document.add("segment", segments)
    return tomlkit.dumps(document)


def _part(solid: Solid) -> dict[str, Any]:
    metres = [round(mm / 1000, 6) for mm in solid.size_mm]
    shape = {
        "box": {"shape": "box", "size_m": metres},
        "ellipsoid": {"shape": "ellipsoid", "semi_axes_m": [round(length / 2, 6) for length in metres]},
    }.get(solid.shape, {"shape": "mesh", "file": solid.shape, "scale": solid.scale})
    place = {"centre_m": [round(mm / 1000, 6) for mm in solid.centre_mm], "rotation_deg": list(solid.turn_deg)}
    colour = {"colour": "sample"} if solid.colour is None else {"colour_srgb": list(solid.colour)}
    return {"name": solid.name, **shape, **place, **colour}


def parse_thing(text: str, file: str) -> tuple[str, list[Solid]]:
    """Read a thing back from its body file's text. Raises BodyError for what is more than solids in one piece."""
    try:
        document = parse_toml(text)
        (segment,) = document["segment"]
        solids = [_solid(part) for part in segment["part"]]
        return str(document["name"]), solids
    except (ValueError, KeyError, TypeError):
        raise BodyError(f"{file} is more than solids in one piece; change it with an editor") from None


def _solid(part: dict[str, Any]) -> Solid:
    if part.keys() & {"slab_m"}:
        raise ValueError("a slab")
    shape, twice = part["shape"], 2 if part["shape"] == "ellipsoid" else 1
    return Solid(
        name=part["name"],
        shape=part["file"] if shape == "mesh" else shape,
        size_mm=tuple(1000 * twice * float(m) for m in part.get(_SIZES.get(shape, ""), (0.1, 0.1, 0.1))),
        centre_mm=tuple(1000 * float(m) for m in part.get("centre_m", (0, 0, 0))),
        turn_deg=tuple(float(deg) for deg in part.get("rotation_deg", (0, 0, 0))),
        scale=float(part.get("scale", 1.0)) if shape == "mesh" else _MM,
        colour=tuple(int(level) for level in part["colour_srgb"]) if "colour_srgb" in part else None,
    )


def colour_at(image: Image, u: float, v: float) -> tuple[int, ...]:
    """Return the colour of an image (h, w, 3) about a pixel: red, green, blue, 0 to 255."""
    x, y = round(u), round(v)
    near = image[max(0, y - _AROUND_PX) : y + _AROUND_PX + 1, max(0, x - _AROUND_PX) : x + _AROUND_PX + 1]
    return tuple(int(level) for level in np.median(near.reshape(-1, 3), axis=0).round())
