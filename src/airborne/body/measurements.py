"""Yeadon's 95 measurements of a person: read from a file, written, and our own set for a stature and a mass."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from airborne.errors import BodyError
from airborne.io.text import read_flat_yaml

# Shares of stature. Levels of the trunk are measured from the hip joint centres, of the head from the acromion, of the
# arm from the shoulder, of the hand from the wrist, of the leg from the hip, of the foot from the ankle: L length,
# p perimeter, w width, d depth (Yeadon 1990-II). Lengths follow Drillis and Contini; the girths are a lean man's.
_TRUNK = {
    "Ls1L": 0.075,
    "Ls2L": 0.115,
    "Ls3L": 0.195,
    "Ls4L": 0.288,
    "Ls5L": 0.315,
    "Ls6L": 0.065,
    "Ls7L": 0.100,
    "Ls8L": 0.155,
    "Ls0p": 0.545,
    "Ls1p": 0.455,
    "Ls2p": 0.462,
    "Ls3p": 0.535,
    "Ls5p": 0.215,
    "Ls6p": 0.290,
    "Ls7p": 0.318,
    "Ls0w": 0.200,
    "Ls1w": 0.170,
    "Ls2w": 0.170,
    "Ls3w": 0.185,
    "Ls4w": 0.200,
    "Ls4d": 0.105,
}
_ARM = {
    "2L": 0.186,
    "3L": 0.221,
    "4L": 0.332,
    "5L": 0.030,
    "6L": 0.053,
    "7L": 0.108,
    "0p": 0.175,
    "1p": 0.158,
    "2p": 0.140,
    "3p": 0.152,
    "4p": 0.095,
    "5p": 0.135,
    "6p": 0.119,
    "7p": 0.065,
    "4w": 0.033,
    "5w": 0.052,
    "6w": 0.047,
    "7w": 0.028,
}
_LEG = {
    "1L": 0.045,
    "3L": 0.245,
    "4L": 0.320,
    "5L": 0.491,
    "6L": 0.018,
    "8L": 0.0735,
    "9L": 0.1155,
    "1p": 0.330,
    "2p": 0.298,
    "3p": 0.205,
    "4p": 0.196,
    "5p": 0.122,
    "6p": 0.185,
    "7p": 0.140,
    "8p": 0.138,
    "9p": 0.100,
    "8w": 0.055,
    "9w": 0.044,
    "6d": 0.067,
}
STATURE_SHARES = {
    **_TRUNK,
    **{f"L{side}{key}": share for side in "ab" for key, share in _ARM.items()},
    **{f"L{side}{key}": share for side in "jk" for key, share in _LEG.items()},
}  # every key, and what it is of the stature

_WIDTHS = {key: key[:-1] + "p" for key in STATURE_SHARES if key[-1] in "wd" and key[:3] != "Ls4"}  # a width's perimeter
_ASCENDING = (  # levels along one axis, from the joint outward
    *(("Ls1L", "Ls2L", "Ls3L", "Ls4L", "Ls5L"), ("Ls6L", "Ls7L", "Ls8L")),
    *(tuple(f"L{side}{level}L" for level in levels) for side in "ab" for levels in ("234", "567")),
    *(tuple(f"L{side}{level}L" for level in levels) for side in "jk" for levels in ("1345", "689")),
)
_TYPICAL_STATURE_M = 1.7  # only for the range in which a measurement is plausible
_LEAST_RATIO, _GREATEST_RATIO = 0.125, 4.0  # to the typical value; beyond, the unit is wrong
_FLATTEST, _DEEPEST = 2.0, 4.0  # a section's perimeter over its width; above pi it is deeper than wide
_UNITS = "measurementconversionfactor = 1 for metres, 0.01 for centimetres, 0.001 for millimetres"


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """The 95 measurements of one person after Yeadon (1990-II)."""

    name: str
    values_m: Mapping[str, float]  # every key of STATURE_SHARES [m]
    mass_kg: float | None = None  # as weighed; None: by the densities

    def mirror(self) -> Measurements:
        """Return the mirrored person: left and right measurements exchanged."""
        other = dict(zip("abjk", "bakj", strict=True))
        values = {key: self.values_m[key[0] + other.get(key[1], key[1]) + key[2:]] for key in self.values_m}
        return replace(self, values_m=values)

    def symmetrise(self) -> Measurements:
        """Return the person with both arms and both legs the mean of left and right."""
        mirrored = self.mirror().values_m
        return replace(self, values_m={key: (value + mirrored[key]) / 2 for key, value in self.values_m.items()})


def read_measurements(path: Path) -> Measurements:
    """Read a Yeadon measurement file: YAML with `measurementconversionfactor`, 95 keys, and `totalmass` [kg] if known.

    Raises BodyError, naming the file, the key and what was expected, for a value that is missing, not a number, zero or
    negative, in a unit that the conversion factor does not give, out of order along its limb, or no possible section.
    """
    try:
        lines = read_flat_yaml(path)
    except OSError as error:
        raise BodyError(f"{path.name}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise BodyError(f"{path.name}: not a YAML file of measurements: {error}") from error
    if not lines:
        raise BodyError(f"{path.name}: holds no measurements; expected lines such as 'Ls1L: 0.135'")
    allowed = {"measurementconversionfactor", "totalmass", *STATURE_SHARES}
    keys, table = [key for key, _ in lines], dict(lines)
    for key in keys:
        if key not in allowed:
            raise BodyError(f"{path.name}: {key:.40} is no measurement; expected Yeadon's 95 names, such as Ls1L")
        if keys.count(key) > 1:
            raise BodyError(f"{path.name}: {key} is given twice; expected each measurement once")
    factor = _number(table, "measurementconversionfactor", path, f"give {_UNITS}")
    if factor <= 0:
        raise BodyError(f"{path.name}: measurementconversionfactor is {factor:g}; give {_UNITS}")
    values = {key: factor * _number(table, key, path, "expected a length above zero") for key in STATURE_SHARES}
    mass_kg = _number(table, "totalmass", path, "expected kilograms") if "totalmass" in table else -1.0
    if "totalmass" in table and mass_kg != -1 and not 10 <= mass_kg <= 300:
        raise BodyError(
            f"{path.name}: totalmass is {mass_kg:g}; expected 10 to 300 kilograms; leave it out where not weighed"
        )
    try:
        return check_measurements(Measurements(path.stem, values, mass_kg if mass_kg > 0 else None))
    except BodyError as error:
        raise BodyError(f"{path.name}: {error}") from error


def check_measurements(measurements: Measurements) -> Measurements:
    """Return the measurements if a body can be made of them; else raises BodyError, naming the key."""
    values = measurements.values_m
    for key, share in STATURE_SHARES.items():
        if key not in values:
            raise BodyError(f"{key} is missing; expected all 95 measurements")
        mean = share * _TYPICAL_STATURE_M
        if not values[key] > 0:
            raise BodyError(f"{key} is {values[key]:g} m; expected a length above zero, usually about {mean:.3f} m")
        if not mean * _LEAST_RATIO < values[key] < mean * _GREATEST_RATIO:
            raise BodyError(
                f"{key} is {values[key]:g} m after conversion; expected about {mean:.3f} m: check its unit ({_UNITS})"
            )
    for levels in _ASCENDING:
        for near, far in pairwise(levels):
            if not values[near] < values[far]:
                raise BodyError(
                    f"{far} is {values[far]:g} m, {near} {values[near]:g} m; both are measured from the same joint, "
                    f"so {far} must be the longer"
                )
    for width, perimeter in _WIDTHS.items():
        ratio = values[perimeter] / values[width]
        if not _FLATTEST < ratio < _DEEPEST:
            raise BodyError(
                f"{perimeter} is {values[perimeter]:g} m round a section {values[width]:g} m wide ({width}); "
                f"expected {_FLATTEST:g} to {_DEEPEST:g} times the width"
            )
    if not values["Ls4d"] < values["Ls4w"]:
        raise BodyError(
            f"Ls4d is {values['Ls4d']:g} m, Ls4w {values['Ls4w']:g} m; the trunk must be wider than deep there"
        )
    return measurements


def _number(table: Mapping[str, str], key: str, path: Path, hint: str) -> float:
    value = table.get(key)
    if not value:
        raise BodyError(f"{path.name}: {key} is missing; {hint}")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise BodyError(f"{path.name}: {key} is {value!r:.40}; {hint}, a number")
    return number
