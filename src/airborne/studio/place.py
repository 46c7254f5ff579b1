"""Where the user is: the page and the frame in view, kept in the folder, so that the studio opens again there."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from airborne.io.text import read_json
from airborne.io.writing import replace_text
from airborne.studio.writing import FOLDER

_FILE = "place.json"


@dataclass(frozen=True, slots=True)
class LastView:
    """A page of the studio and a frame of the trial."""

    page: str = "/"  # its address
    frame: int = 0


def read_place(folder: Path) -> LastView:
    """Return where the user was in a folder; the beginning where nothing, or nothing sensible, is remembered."""
    try:
        known = read_json(folder / FOLDER / _FILE)
        page, frame = known["page"], known["frame"]
    except (OSError, ValueError, KeyError, TypeError):
        return LastView()
    is_sensible = isinstance(page, str) and isinstance(frame, int) and 0 <= frame < 2**31
    return LastView(page, frame) if is_sensible else LastView()


def write_place(folder: Path, place: LastView) -> None:
    """Remember where the user is."""
    (folder / FOLDER).mkdir(exist_ok=True)
    replace_text(folder / FOLDER / _FILE, json.dumps(asdict(place)) + "\n", is_durable=False)
