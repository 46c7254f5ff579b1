"""report.html of a run of players: every player's numbers, heights over time, warnings and method on one page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from airborne.errors import count_of
from airborne.export import panels
from airborne.export.page import UNKNOWN_TEXT, render_report
from airborne.export.palette import STATUS_RGB, hex_colour
from airborne.export.report import DEFINITIONS
from airborne.export.summary import json_ready
from airborne.export.viewer import players_viewer
from airborne.io.figures import save_png
from airborne.io.writing import write_text
from airborne.motion import PlayersMotion
from airborne.motion.run_folder import REPORT, figures_of
from airborne.tracking import Status

HEIGHTS_FIGURE = "heights.png"
_JOINT_COLOURS = {"hip": "#0072b2", "knee": "#cc79a7", "ankle": "#009e73"}
_UNCERTAIN_STYLE = {"facecolor": hex_colour(STATUS_RGB[Status.UNCERTAIN]), "edgecolor": "none", "alpha": 0.25}

# of the variances, chosen: errors in flight twice those stated; block_jump has 1, with a clock 0.1 s off 2, at a wrong
# frame rate 8, with exchanged videos 12
_NOISY = 4.0

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
_PEAK_TAKES = "a peak takes five known frames around it, seen by two cameras or more, of a player who was tracked"
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
        alarms=[*players_warnings(summary), *summary["warnings"]],
        fine_text="Every player was tracked in every frame.",
        definitions={**_DEFINITIONS, "Uncertainty": uncertainty},
        players=[{"player": name, **player} for name, player in summary["players"].items()],
        jumps=[_jump_record(row) for row in summary["jumps"]],
        heights_to_quote=[
            (_interval_cm(row, "hips"), f"{row['player']}, jump {row['jump']}: hips") for row in summary["jumps"]
        ],
        viewer=players_viewer(folder, motion),
        jumps_caption=_JUMPS_CAPTION,
        heights=figures_of(folder) / HEIGHTS_FIGURE,
        heights_caption=_FIGURE_CAPTION,
    )
    write_text(path, html)
    return path


def players_warnings(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield, in plain sentences, what the reader of a run of players must not miss."""
    n = summary["n_frames"]
    for name, player in summary["players"].items():
        if player["n_lost"] == n:
            yield f"{name} was found in no frame: nothing was measured."
            continue
        if player["n_lost"]:
            yield f"{name}: {count_of(player['n_lost'], n, 'frame')} lost; they hold no numbers."
        if player["n_uncertain"]:
            yield f"{name}: {count_of(player['n_uncertain'], n, 'frame')} uncertain; look at them before use."
        if player["n_below_two_cameras"]:
            yield (
                f"{name}: {player['n_below_two_cameras']} of {n} frames rest on fewer than two cameras, so that depth "
                "is a guess."
            )
    for jump in summary["jumps"]:
        if _interval_cm(jump, "hips") == UNKNOWN_TEXT:
            yield f"{jump['player']}, jump {jump['jump']}: how high the hips rose is not known: {_PEAK_TAKES}."
    yield from _drop_notes(summary)


def players_summary(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line for each player and jump, and the frames that live tracking dropped."""
    for name, player in summary["players"].items():
        counts = ", ".join(f"{player[f'n_{status}']} {status}" for status in Status)
        sd_mm = player["median_sd_mm"]
        yield f"{name}: {counts}; median sd of a joint {UNKNOWN_TEXT if sd_mm is None else f'{sd_mm:.0f} mm'}"
        n_posed = player["n_tracked"] + player["n_uncertain"]
        if n_posed and not player["n_tracked"]:
            yield f"  no frame of {name} was tracked, so none of these numbers can be relied on"
        n_alone = min(player["n_below_two_cameras"] - player["n_lost"], player["n_fewer_cameras"])
        if n_alone > n_posed / 2:
            yield (
                f"  in most frames fewer than two cameras agree on {name}: are videos exchanged, clocks off (`airborne "
                "sync`), or is the calibration another's?"
            )
    if not summary["jumps"] and summary["n_frames"] > 1:
        yield "no jump was found"
    for jump in summary["jumps"]:
        hips, *others = (_interval_cm(jump, what) for what in _HEIGHTS)
        n = jump["n_uncertain"]
        warning = f"; {n} of its frames {'is' if n == 1 else 'are'} uncertain" if n else ""
        said = f"{hips}, hips over standing (95 % interval)"
        if hips == UNKNOWN_TEXT:
            said = f"how high the hips rose is not known ({_PEAK_TAKES})"
        yield f"{jump['player']}, jump {jump['jump']}: {said}{warning}"
        if (jump["noise_scale"] or 0.0) > _NOISY:
            off = float(np.sqrt(jump["noise_scale"]))
            yield (
                f"  its flight differs from a fall at 9.81 m/s² {off:.1f} times as much as stated errors explain: "
                "check the frame rate, the clocks and the calibration"
            )
        pairs = zip(_HEIGHTS[1:], others, strict=True)
        yield "  by other definitions: " + ", ".join(f"{what} {height}" for what, height in pairs)
    yield from _drop_notes(summary)


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
    if any(number is None or not np.isfinite(number) for number in numbers):
        return UNKNOWN_TEXT
    middle, low, high = (f"{scale * number:.{digits}f}" for number in numbers)
    return f"{middle} ({low} to {high})"


def _interval_cm(row: Mapping[str, Any], what: str) -> str:
    text = _with_interval(row, *_JUMP_QUANTITIES[what])
    return text if text == UNKNOWN_TEXT else f"{text} cm"


def _drop_notes(summary: Mapping[str, Any]) -> Iterator[str]:
    if live := summary.get("live"):
        counts = ", ".join(f"{c['name']} {c['n_dropped']} of {c['n_received']}" for c in live["cameras"])
        yield f"live: frames dropped to keep up: {counts}; delay {1e3 * live['median_delay_s']:.0f} ms (median)"


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
