"""What the reader of a run of players must not miss: the sentences of terminal, summary.json and report.html."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from airborne.errors import count_of
from airborne.export.summary import describe_lost
from airborne.motion.jumps.jump import are_legs_lost, is_no_fall
from airborne.motion.jumps.standing_posture import NEAR_S, WINDOW_S
from airborne.motion.players_doubts import are_of_single_joints

_PEAK_TAKES = "a peak needs five known frames around it, in each of which two cameras or more see the tracked player"

_EVENT_TAKES = "each needs frames with a foot on the floor beside it, and a tracked ankle close to it"
_UNKNOWN_EVENTS = {"no take-off": "take-off is", "no landing": "landing is", "neither": "take-off and landing are"}


def players_warnings(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield what speaks against the players and jumps of a summary; of a body nothing."""
    yield from notes_of_players(summary)
    yield from notes_of_jumps(summary)


def notes_of_players(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield `player_notes` of all players, each with its name."""
    for name, player in summary.get("players", {}).items():
        yield from (f"{name}: {note}" for note in player_notes(player, summary))


def notes_of_jumps(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield `jump_notes` of all jumps, each with its name."""
    for jump in summary.get("jumps", ()):
        yield from (f"{jump['player']}, jump {jump['jump']}: {note}" for note in jump_notes(jump))


def player_notes(player: Mapping[str, Any], summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield what speaks against the numbers of a player of a run."""
    n = summary["n_frames"]
    if player["n_lost"] == n:
        yield "found in no frame: nothing was measured"
        return
    if start_doubt := player.get("start_doubt"):
        yield start_doubt
    if player["n_lost"]:
        yield describe_lost(player["n_lost"], n)
    if doubts := player.get("doubts"):
        yield f"uncertain: {'; '.join(doubts)}; check them before use"
    elif player["n_uncertain"]:
        yield f"{count_of(player['n_uncertain'], n, 'frame')} uncertain; check them before use"
    if few := player["n_below_two_cameras"]:
        rest = "rests" if few == 1 else "rest"
        yield f"{few} of {n} frames {rest} on fewer than two cameras, so that depth is a guess"
    n_posed = player["n_tracked"] + player["n_uncertain"]
    if not player["n_tracked"] and not start_doubt and not summary.get("self_check"):  # which say why
        is_by_sd = are_of_single_joints(doubts or ())
        yield "no frame was tracked, so none of these numbers can be relied on: " + (
            "in each some joint is uncertain, as said above"
            if is_by_sd
            else "are the joints of [[start.player]] those of the frame of [start]? `airborne track --first-frame` "
            "draws them there"
        )
    if min(player["n_below_two_cameras"] - player["n_lost"], player["n_fewer_cameras"]) > n_posed / 2:
        yield (
            "in most frames fewer than two cameras agree: are videos exchanged, clocks off (`airborne sync`), or is "
            "the calibration another's?"
        )


def jump_notes(jump: Mapping[str, Any]) -> Iterator[str]:
    """Yield what speaks against a jump's heights, of its row in jumps.csv."""
    noise_scale, tuck_m = jump["noise_scale"] or np.nan, jump.get("tuck_m") or np.nan
    if is_no_fall(noise_scale):
        yield (
            f"its flight differs from a fall at 9.81 m/s² {np.sqrt(noise_scale):.1f} times as much as stated errors "
            "explain: check the frame rate, the clocks and the calibration"
        )
    if are_legs_lost(noise_scale, tuck_m):
        yield (
            f"its feet rose {tuck_m:.2f} m more than its hips, so the legs went astray: their height, take-off and "
            "landing are withheld; look at the overlay videos: was a camera moved?"
        )
    elif jump["status"] != "whole":
        yield f"{_UNKNOWN_EVENTS[jump['status']]} not known: {_EVENT_TAKES}"
    if not is_known(jump["hip_height_m"]) and not is_no_fall(noise_scale):
        yield f"how high the hips rose is not known: {_PEAK_TAKES}"
    elif is_known(jump["hip_height_m"]) and jump["standing_source"] == "lengths":
        yield (
            "standing was not seen, so its height is derived from leg lengths and the intervals are wide: film "
            f"{WINDOW_S:g} s of standing upright and still within {NEAR_S:g} s of the jump"
        )
    n, n_hips = jump["n_uncertain"], jump.get("n_hips_uncertain", jump["n_uncertain"])
    if n_hips:
        yield f"hips are uncertain in {n_hips} of its frames: check them before use"
    elif n:
        yield f"knees or ankles are uncertain in {n} of its frames, hips in none: prefer the height of the hips"


def drop_notes(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield how many frames live tracking dropped, if it was live."""
    if live := summary.get("live"):
        counts = ", ".join(f"{c['name']} {c['n_dropped']} of {c['n_received']}" for c in live["cameras"])
        yield f"live: frames dropped to keep up: {counts}; delay {1e3 * live['median_delay_s']:.0f} ms (median)"


def is_known(value: float | None) -> bool:
    """Say whether a number of a summary is there, which JSON has as null where it is not finite."""
    return value is not None and bool(np.isfinite(value))
