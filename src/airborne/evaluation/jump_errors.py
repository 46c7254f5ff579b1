"""Errors of measured jumps: each definition of height, take-off and landing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from airborne.evaluation.compare import or_dash
from airborne.motion.jumps.heights import measure_jumps
from airborne.motion.jumps.jump import Jump
from airborne.motion.players import PlayersMotion

HEIGHTS = ("foot_height_m", "hip_height_m", "flight_time_height_m", "takeoff_speed_height_m", "hip_rise_m")
EVENTS = ("takeoff_frame", "landing_frame")
_TITLES = ("feet", "hips", "flight time", "take-off speed", "hips from take-off")


@dataclass(frozen=True, slots=True, kw_only=True)
class JumpErrors:
    """One true jump against the measured one, measured minus true; NaN where either is unknown.

    Two references: the same functions applied to the true paths, and the numbers that the truth's file states.
    """

    player: str
    number: int  # of the true jump
    is_found: bool
    height_error_m: dict[str, float]  # by definition, as `Jump` names them; against the true paths
    event_error_frames: dict[str, float]
    stated_height_error_m: dict[str, float]  # against the file, where it states a number
    stated_event_error_frames: dict[str, float]
    within_95: dict[str, bool]  # whether the interval contains the number of the true paths

    def describe(self) -> str:
        """Return the errors as two lines at most."""
        if not self.is_found:
            return f"{self.player}: jump {self.number} not found"
        heights = self._line(self.height_error_m, self.event_error_frames)
        lines = [f"{self.player}: jump {self.number}, minus that of the true paths: {heights}"]
        if self.stated_height_error_m or self.stated_event_error_frames:
            stated = self._line(self.stated_height_error_m, self.stated_event_error_frames)
            lines.append(f"{self.player}: jump {self.number}, minus the stated: {stated}")
        return "\n".join(lines)

    def _line(self, heights: dict[str, float], events: dict[str, float]) -> str:
        parts = [
            f"{title} {or_dash(100 * heights[name], '+.1f')} cm"
            for name, title in zip(HEIGHTS, _TITLES, strict=True)
            if name in heights
        ]
        parts += [f"{name.removesuffix('_frame')} {or_dash(error, '+.2f')} frames" for name, error in events.items()]
        return ", ".join(parts)


def compare_jumps(
    motion: PlayersMotion, truth: PlayersMotion, players: Sequence[str], references: dict[str, dict[str, float]]
) -> tuple[JumpErrors, ...]:
    """Compare the jumps of the named players; `references` holds the stated numbers of a player's only jump.

    Jumps are matched by overlapping flights. Empty if the joints include no legs.
    """
    errors, pairs = [], pair_jumps(motion, truth, players)
    for jump, partner in pairs:
        is_only = sum(j.player == jump.player for j, _ in pairs) == 1
        errors.append(_errors(jump, partner, references.get(jump.player, {}) if is_only else {}))
    return tuple(errors)


def pair_jumps(
    motion: PlayersMotion, truth: PlayersMotion, players: Sequence[str]
) -> tuple[tuple[Jump, Jump | None], ...]:
    """Return every true jump of the named players with the measured one whose flight overlaps it, if any.

    Empty if the joints include no legs.
    """
    if not all(_has_legs(each) for each in (motion, truth)):
        return ()
    measured = measure_jumps(_select_players(motion, players))
    return tuple(
        (jump, next((j for j in measured if j.player == jump.player and _overlap(j, jump)), None))
        for jump in measure_jumps(_select_players(truth, players))
    )


def _errors(true: Jump, measured: Jump | None, reference: dict[str, float]) -> JumpErrors:
    names = (*HEIGHTS, *EVENTS)
    values = {name: getattr(measured, name).value if measured else math.nan for name in names}
    error = {name: values[name] - getattr(true, name).value for name in names}
    stated = {name: values[name] - reference[name] for name in names if name in reference}
    inside = {}
    for name in names:
        value = getattr(true, name).value
        if measured is not None and math.isfinite(error[name]):
            interval = getattr(measured, name)
            inside[name] = bool(interval.low <= value <= interval.high)
    return JumpErrors(
        player=true.player,
        number=true.number,
        is_found=measured is not None,
        height_error_m={name: error[name] for name in HEIGHTS},
        event_error_frames={name: error[name] for name in EVENTS},
        stated_height_error_m={name: stated[name] for name in HEIGHTS if name in stated},
        stated_event_error_frames={name: stated[name] for name in EVENTS if name in stated},
        within_95=inside,
    )


def _has_legs(motion: PlayersMotion) -> bool:
    return all(f"{part}_{side}" in motion.joints for part in ("hip", "knee", "ankle") for side in ("left", "right"))


def _select_players(motion: PlayersMotion, players: Sequence[str]) -> PlayersMotion:
    at = [motion.players.index(name) for name in players]
    columns = {
        name: getattr(motion, name)[:, at] for name in ("points", "covariance", "joint_status", "score", "n_views")
    }
    return replace(motion, players=tuple(players), **columns)


def _overlap(one: Jump, other: Jump) -> bool:
    spans = [(float(np.min(jump.path_s)), float(np.max(jump.path_s))) for jump in (one, other)]
    return max(spans[0][0], spans[1][0]) <= min(spans[0][1], spans[1][1])
