"""A thing that is described in the studio: solids in one piece, as a body file holds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import tomlkit

from airborne.errors import BodyError
from airborne.io.text import parse_toml
from airborne.types import Image

MESHES = (".obj", ".ply", ".stl")
_AROUND_PX = 2  # of a click, to either side: noise and the codec's blocks go into a median
_MM = 0.001  # the unit that most meshes have [m]
_SIZES = {"box": "size_m", "ellipsoid": "semi_axes_m"}


@dataclass(frozen=True, slots=True)
class Solid:
    """One coloured solid of a thing."""

    name: str
    shape: str = "box"  # "ellipsoid", or the file of a mesh
    size_mm: tuple[float, ...] = (100.0, 100.0, 100.0)  # full lengths along its axes; of a mesh unread
    centre_mm: tuple[float, ...] = (0.0, 0.0, 0.0)  # in the thing's axes
    turn_deg: tuple[float, ...] = (0.0, 0.0, 0.0)  # about x, then the new y, then the new z
    scale: float = _MM  # of a mesh: its unit in metres
    colour: tuple[int, ...] | None = None  # red, green, blue, 0 to 255; None: taken at the first pose


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
