"""An editing session of the studio that is killed: points clicked, the start set, a draft kept, frames turned.

Each is told when it is done.
"""

import random
import time
from contextlib import suppress
from itertools import count
from multiprocessing.connection import Connection
from pathlib import Path

from airborne.studio.clicks import read_clicked
from airborne.studio.project import read_project
from airborne.studio.session import Session
from tests.support.forked_commands import FORKS

TRIAL, TABLE, PAGE = "trial.toml", "control_points.csv", "/cameras"
WIDTH = 700  # of the picture in which points are clicked [px]


def edit_on(folder: Path, told: Connection) -> None:
    """Click, set the start, turn to the next frame, and say so, on and on."""
    session, table = Session(folder, folder / TRIAL), folder / TABLE
    for number in count(session.frame + 1):
        known = read_clicked(table)
        clicked = known.click(known.names[0], "cam1", (number % WIDTH, number // WIDTH))
        session.edit(TABLE, clicked.text(("cam1", "cam2", "cam3")), f"click {number}")
        session.set_table("start", {"frame": number}, f"start {number}")
        session.keep_draft("points", number, f"draft {number}")
        session.go(page=PAGE, frame=number)
        told.send(number)


def kill_while_editing(folder: Path, longest_s: float, rng: random.Random) -> int:
    """Edit a folder's trial in a process that is killed at a random moment; return the last edit that it told of."""
    told, tell = FORKS.Pipe(duplex=False)
    process = FORKS.Process(target=edit_on, args=(folder, tell))
    process.start()
    tell.close()
    last = told.recv()
    time.sleep(rng.uniform(0, longest_s))
    process.kill()
    with told, suppress(EOFError, OSError):  # the last word may be half said
        while True:
            last = told.recv()
    process.join()
    return last


def edits_found(folder: Path) -> tuple[int, int, int, int]:
    """Open the folder again: the click that its table holds, the start's frame, the draft, and the frame in view."""
    session = Session(folder, folder / TRIAL)
    project = read_project(folder, folder / TRIAL)
    assert project.mistake is None, project.mistake
    assert session.place.page == PAGE
    clicked = read_clicked(folder / TABLE)
    u, v = clicked.at(clicked.names[0], "cam1")
    return int(v) * WIDTH + int(u), project.table("start")["frame"], session.draft("points"), session.frame
