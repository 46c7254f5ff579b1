"""Whether runs that are compared say anything: of one that is hardly tracked, or that is another, nothing."""

from __future__ import annotations

import filecmp
from collections.abc import Iterator, Sequence
from pathlib import Path

from airborne.errors import count_of
from airborne.export.summary import is_mostly_untracked
from airborne.motion.run_folder import JOINTS, MOTION, SUMMARY, read_summary


def doubt_runs(folder: Path, repeats: Sequence[Path]) -> tuple[str, ...]:
    """Say of which runs less than half is tracked, and which repeat is the run itself, one line each."""
    doubts = [doubt for each in (folder, *repeats) for doubt in _doubt_run(each)]
    same = [each for each in repeats if any(_are_same(folder / name, each / name) for name in (MOTION, JOINTS))]
    doubts += [
        f"{each} is {folder} to the last digit, as a run of the same input is: that says nothing of repeatability"
        for each in same
    ]
    return tuple(doubts)


def _doubt_run(folder: Path) -> Iterator[str]:
    """Say of whom less than half of the run in a folder is tracked: of the body, or of which players."""
    if not (folder / SUMMARY).is_file():
        return
    summary = read_summary(folder)
    n = summary["n_frames"]
    of_whom = {f", {name}": player for name, player in summary.get("players", {}).items()} or {"": summary}
    for whose, each in of_whom.items():
        if is_mostly_untracked({"n_frames": n, "n_tracked": each["n_tracked"]}):
            tracked = count_of(each["n_tracked"], n, "frame")
            yield f"{folder}{whose}: {tracked} tracked: how well it agrees says nothing"


def _are_same(one: Path, other: Path) -> bool:
    return one.is_file() and other.is_file() and filecmp.cmp(one, other, shallow=False)
