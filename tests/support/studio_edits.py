"""An editing session of the studio that is killed: points clicked, the start set, a draft kept, frames turned.

Each is told when it is done.

`python -m tests.support.studio_edits FOLDER` edits the trial of a folder until the process ends.
"""

import random
import subprocess
import sys
import time
from itertools import count
from pathlib import Path

from airborne.studio.clicks import read_clicked
from airborne.studio.project import read_project
from airborne.studio.session import Session

TRIAL, TABLE, PAGE = "trial.toml", "control_points.csv", "/cameras"
WIDTH = 700  # of the picture in which points are clicked [px]


def edit_on(folder: Path) -> None:
    """Click, set the start, turn to the next frame, and say so, on and on."""
    session, table = Session(folder, folder / TRIAL), folder / TABLE
    for number in count(session.frame + 1):
        known = read_clicked(table)
        clicked = known.click(known.names[0], "cam1", (number % WIDTH, number // WIDTH))
        session.edit(TABLE, clicked.text(("cam1", "cam2", "cam3")), f"click {number}")
        session.set_table("start", {"frame": number}, f"start {number}")
        session.keep_draft("points", number, f"draft {number}")
        session.go(page=PAGE, frame=number)
        print(number, flush=True)


def kill_while_editing(folder: Path, longest_s: float, rng: random.Random) -> int:
    """Edit a folder's trial in a process that is killed at a random moment; return the last edit that it told of."""
    command = [sys.executable, "-m", "tests.support.studio_edits", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        first = process.stdout.readline()
        time.sleep(rng.uniform(0, longest_s))
        process.kill()
        told = [first, *process.stdout.read().splitlines(keepends=True)]
    return int([line for line in told if line.endswith("\n")][-1])


def edits_found(folder: Path) -> tuple[int, int, int, int]:
    """Open the folder again: the click that its table holds, the start's frame, the draft, and the frame in view."""
    session = Session(folder, folder / TRIAL)
    project = read_project(folder, folder / TRIAL)
    assert project.mistake is None, project.mistake
    assert session.place.page == PAGE
    clicked = read_clicked(folder / TABLE)
    u, v = clicked.at(clicked.names[0], "cam1")
    return int(v) * WIDTH + int(u), project.table("start")["frame"], session.draft("points"), session.frame


if __name__ == "__main__":
    edit_on(Path(sys.argv[1]))
