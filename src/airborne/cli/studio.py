"""`airborne studio`: a trial's folder in the browser."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

import typer


def studio_command(
    path: Annotated[Path, typer.Argument(help="A folder of videos, or a trial's TOML file.")] = Path(),
    demo: Annotated[
        bool, typer.Option("--demo", help="A guided walk through a copy of the bundled example, airborne-studio-demo.")
    ] = False,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this computer; 0 takes a free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the browser.")] = True,
) -> None:
    """Open the studio in the browser: from a folder of videos to a report, by clicks and keys. Ctrl-C ends it.

    Example: airborne studio my-recording
    """
    from airborne.studio import open_studio

    folder = _copy_example(Path("airborne-studio-demo")) if demo else path
    open_studio(folder, port=port, browser=browser, is_guided=demo)


def _copy_example(folder: Path) -> Path:
    """Copy the thrown cross, without its calibration, start and truth, where there is no copy yet."""
    from airborne.studio.folder import require_writable
    from airborne.trial.examples import example_trial

    source = example_trial("thrown_cross").parent
    if not folder.exists():
        require_writable(Path.cwd())
        folder.mkdir()
        for name in ("cam1.mp4", "cam2.mp4", "cam3.mp4", "control_points.csv", "cross.toml"):
            shutil.copyfile(source / name, folder / name)
    return folder
