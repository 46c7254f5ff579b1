"""Drafts: what is made on a page and not in a file of the trial yet, kept in the folder with every change."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from airborne.io.text import read_json
from airborne.studio.writing import FOLDER

DRAFTS = f"{FOLDER}/draft.json"  # trial file -> name of the draft -> the draft


def read_draft(folder: Path, trial: str, name: str) -> Any:
    """Return a draft of a trial; None where nothing, or nothing sensible, is kept."""
    own = _read(folder).get(trial)
    return own.get(name) if isinstance(own, dict) else None


def drafts_text(folder: Path, trial: str, name: str, draft: Any) -> str:
    """Return what the file of drafts holds with this one in it."""
    known = _read(folder)
    own = known.get(trial)
    own = own if isinstance(own, dict) else {}
    return json.dumps({**known, trial: {**own, name: draft}}, indent=1, default=str) + "\n"


def _read(folder: Path) -> dict[str, Any]:
    try:
        known = read_json(folder / DRAFTS)
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}
