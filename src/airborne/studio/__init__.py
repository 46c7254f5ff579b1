"""The studio: a folder of videos in the browser, from choosing cameras to the report.

A folder or a trial's file comes in; the trial's files, as the command line reads them, go out. It sits above `run/` and
knows nothing of how bodies are tracked: what it does, commands repeat. Nothing but the command `studio` imports it.
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["open_studio"]


def open_studio(path: Path, *, port: int = 0, browser: bool = True, is_guided: bool = False) -> None:
    """Serve the studio of a folder, or of one of its trials, to this computer until it is stopped.

    `port` 0 takes a free one; `is_guided` says at each step what to do with the thrown cross.
    Raises AirborneError for a path without a folder.
    """
    from airborne.studio.server import serve

    serve(path, port=port, browser=browser, is_guided=is_guided)
