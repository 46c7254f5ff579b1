"""report.html of a run of players: every player's numbers, heights over time, warnings and method on one page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from airborne.export import panels
from airborne.export.page import UNKNOWN_TEXT, render_report
from airborne.export.palette import BLUE, GREEN, PURPLE, STATUS_RGB, hex_colour
from airborne.export.players_notes import (
    drop_notes,
    is_known,
    jump_notes,
    notes_of_jumps,
    notes_of_players,
    player_notes,
)
from airborne.export.report import DEFINITIONS
from airborne.export.summary import json_ready
from airborne.export.viewer import players_viewer
from airborne.io.figures import save_png
from airborne.io.writing import write_text
from airborne.motion import PlayersMotion
from airborne.motion.run_folder import REPORT, figures_of
from airborne.tracking import Status

HEIGHTS_FIGURE = "heights.png"
_JOINT_COLOURS = {"hip": BLUE, "knee": PURPLE, "ankle": GREEN}
_UNCERTAIN_STYLE = {"facecolor": hex_colour(STATUS_RGB[Status.UNCERTAIN]), "edgecolor": "none", "alpha": 0.25}

_JUMP_QUANTITIES = {  # columns of jumps.csv that the report shows: name, factor, digits
    "hips": ("hip_height_m", 100.0, 1),  # the height to quote: docs/jumps.md says why
    "feet": ("foot_height_m", 100.0, 1),
    "flight time": ("flight_time_height_m", 100.0, 1),
    "take-off speed": ("takeoff_speed_height_m", 100.0, 1),
    "take-off [frame]": ("takeoff_frame", 1.0, 1),
    "landing [frame]": ("landing_frame", 1.0, 1),
    "flight [ms]": ("flight_s", 1000.0, 0),
}
_HEIGHTS = ("hips", "feet", "flight time", "take-off speed")
_JUMPS_CAPTION = (
    "Heights are in cm, each with its 95 % interval. Quote that of the hips over standing: it needs neither the moment "
    "of take-off nor that of landing, and tucked legs do not add to it. Never compare it with a height of another "
    "definition: of the feet over standing, or what flight time and take-off speed come to. jumps.csv has more."
)
_FIGURE_CAPTION = (
    "Height of the middle of both hips, knees and ankles over time, with two standard deviations; amber where "
    "uncertain, grey where lost."
)
_DEFINITIONS = {
    "World": DEFINITIONS["World"],
    "Status": DEFINITIONS["Status"],
    "Score": "Mean log-likelihood of the estimate, in nats; larger is better; for frames of a run, not methods.",
    "Uncertainty": (
        "One standard deviation, the root mean square of the three axes', of each joint for itself; bands in figures "
        "are two. An infinite one means that the images do not show that direction."
    ),
}


def write_players_report(folder: Path, summary: Mapping[str, Any], motion: PlayersMotion) -> Path:
    """Write heights.png and report.html into the folder of a run, and return the page's path.

    `summary` is the content of summary.json.
    """
    save_png(heights_figure(motion), figures_of(folder) / HEIGHTS_FIGURE)
    path = folder / REPORT
    summary = json_ready(summary)
    uncertainty = f"{_DEFINITIONS['Uncertainty']} {summary['uncertainty']}"
    html = render_report(
        "players_report.html.j2",
        summary,
        alarms=[*summary["warnings"], *drop_notes(summary)],
        fine_text="Every player was tracked in every frame.",
        definitions={**_DEFINITIONS, "Uncertainty": uncertainty},
        players=[_player_record(name, player) for name, player in summary["players"].items()],
        notes_of_players=list(notes_of_players(summary)),
        jumps=[_jump_record(row) for row in summary["jumps"]],
        heights_to_quote=[
            (_interval_cm(row, "hips"), f"{row['player']}, jump {row['jump']}: hips") for row in summary["jumps"]
        ],
        viewer=players_viewer(folder, motion),
        notes_of_jumps=[*notes_of_jumps(summary), _JUMPS_CAPTION],
        heights=figures_of(folder) / HEIGHTS_FIGURE,
        heights_caption=_FIGURE_CAPTION,
    )
    write_text(path, html)
    return path


def players_summary(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line for each player and jump, each with its notes below, and the frames that live tracking dropped."""
    for name, player in summary["players"].items():
        counts = ", ".join(f"{player[f'n_{status}']} {status}" for status in Status)
        sd_mm = player["median_sd_mm"]
        yield f"{name}: {counts}; median sd of a joint {UNKNOWN_TEXT if sd_mm is None else f'{sd_mm:.0f} mm'}"
        yield from (f"  {note}" for note in player_notes(player, summary))
    if not summary["jumps"] and summary["n_frames"] > 1:
        yield "no jump was found"
    for jump in summary["jumps"]:
        yield describe_jump(jump)
        pairs = ((what, _interval_cm(jump, what)) for what in _HEIGHTS[1:])
        yield "  by other definitions: " + ", ".join(f"{what} {height}" for what, height in pairs)
        yield from (f"  {note}" for note in jump_notes(jump))
    yield from drop_notes(summary)


def describe_jump(jump: Mapping[str, Any]) -> str:
    """Say how high the hips rose in a jump of a summary, the height to quote."""
    height = _interval_cm(jump, _HEIGHTS[0])
    is_known = jump["hip_height_m"] is not None
    said = f"{height}, hips over standing (95 % interval)" if is_known else "how high the hips rose is not known"
    return f"{jump['player']}, jump {jump['jump']}: {said}"


def _player_record(name: str, player: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the report's table shows of a player; doubts stand below it."""
    return {"player": name, **{key: value for key, value in player.items() if "doubt" not in key}}


def _jump_record(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the report shows of a jump, each number with its 95 % interval."""
    return {
        "player": row["player"],
        "jump": row["jump"],
        "status": row["status"],
        **{name: _with_interval(row, *quantity) for name, quantity in _JUMP_QUANTITIES.items()},
        "uncertain frames": row["n_uncertain"],
    }


def _with_interval(row: Mapping[str, Any], name: str, scale: float, digits: int) -> str:
    numbers = [row[name + end] for end in ("", "_low", "_high")]
    if not all(map(is_known, numbers)):
        return UNKNOWN_TEXT
    middle, low, high = (f"{scale * number:.{digits}f}" for number in numbers)
    return f"{middle} ({low} to {high})"


def _interval_cm(row: Mapping[str, Any], what: str) -> str:
    text = _with_interval(row, *_JUMP_QUANTITIES[what])
    return text if text == UNKNOWN_TEXT else f"{text} cm"


def heights_figure(motion: PlayersMotion) -> Figure:
    """Draw the height of the middle of each player's hips, knees and ankles."""
    figure, grid = panels.panel_figure(len(motion.players), 1, row_in=2.2)
    status = motion.status
    for k, (player, (axes,)) in enumerate(zip(motion.players, grid, strict=True)):
        for part, colour in _JOINT_COLOURS.items():
            pair = [motion.joints.index(f"{part}_{side}") for side in ("left", "right")]
            middle = motion.points[:, k, pair, 2].mean(axis=1)
            two_sd = 2 * np.sqrt(motion.covariance[:, k, pair, 2, 2].mean(axis=1))
            two_sd = np.where(np.isfinite(two_sd), two_sd, np.nan)
            axes.plot(motion.time_s, middle, color=colour, linewidth=1.2, label=f"{part}s")
            axes.fill_between(motion.time_s, middle - two_sd, middle + two_sd, color=colour, alpha=0.2, linewidth=0)
        panels.shade_spans(axes, motion.time_s, status[:, k] == Status.LOST.value, panels.LOST_STYLE)
        panels.shade_spans(axes, motion.time_s, status[:, k] == Status.UNCERTAIN.value, _UNCERTAIN_STYLE)
        panels.label_panel(axes, f"{player}: height [m]")
        panels.begin_at_zero(axes)
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=len(_JOINT_COLOURS), fontsize=panels.FONT_PT, frameon=False
    )
    figure.align_ylabels()
    return figure
