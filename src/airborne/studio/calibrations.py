"""Which files of a folder hold a calibration of the trial's cameras, and why the others do not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from airborne.body import read_measurements
from airborne.body.files import read_body
from airborne.calibration.sources.boards import read_board
from airborne.cameras import read_rig
from airborne.cameras.formats.openpose import number_at_end
from airborne.errors import AirborneError, count
from airborne.studio.calibrating import SOURCES
from airborne.studio.clicks import list_surveys, read_clicked
from airborne.studio.digitising import list_repetitions
from airborne.studio.folder import files_inside, readable_files

ENDINGS = (".toml", ".txt", ".xcp", ".yml", ".yaml", ".csv")
_OTHERS = {  # what else the folder may hold, and its readers
    ".toml": (read_body, read_board),
    ".txt": (read_measurements,),
    ".yml": (read_measurements,),
    ".yaml": (read_measurements,),
    ".csv": (read_clicked,),
}


@dataclass(frozen=True, slots=True)
class Calibrations:
    """The files of a folder that may be a calibration."""

    usable: Sequence[str]  # they hold the trial's cameras by their names
    renamed: Mapping[str, Sequence[str]]  # the names of the cameras in files where they differ
    refused: Mapping[str, str]  # why the others hold none


def list_calibrations(folder: Path, wanted: set[str]) -> Calibrations:
    """Look through the files of a folder for cameras of these names; what is known to be another thing is left out."""
    usable, renamed, refused = [], {}, {}
    others = {SOURCES, *(each.file for each in list_repetitions(folder)), *list_surveys(folder).refused}
    for path in files_inside(folder, *ENDINGS):
        try:
            names = read_rig(path).names
        except (AirborneError, OSError) as error:
            reason = str(error) if isinstance(error, AirborneError) else f"{path} cannot be read"
            refused[path.name] = reason.replace(str(path), path.name)
            continue
        if wanted <= set(names):
            usable.append(path.name)
        elif len(names) >= len(wanted):
            renamed[path.name] = names
        else:
            found = f"{path.name} holds {count(len(names), 'camera')}, {', '.join(names)}"
            refused[path.name] = f"{found}; expected one for each of the trial's {len(wanted)}"
    others |= {
        name for ending, readers in _OTHERS.items() for read in readers for name in readable_files(folder, read, ending)
    }
    return Calibrations(usable, renamed, {name: why for name, why in refused.items() if name not in others})


def guess_name(camera: str, names: Sequence[str]) -> str | None:
    """Return which camera of a file may be meant: that of the same name, or the only one of the same number."""
    number = number_at_end(camera)
    alike = [name for name in names if number is not None and number_at_end(name) == number]
    return camera if camera in names else alike[0] if len(alike) == 1 else None
