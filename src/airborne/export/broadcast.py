"""A graphic for a broadcast: the floor under a player, a ruler, the feet's height, the highest of the jump."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body.legs import LEG_POINTS
from airborne.cameras import Camera
from airborne.export.lettering import draw_text, text_width
from airborne.export.views import Picture
from airborne.tracking import Status
from airborne.tracking.players import PlayerStart

Array = NDArray[np.floating]
Colour = tuple[int, int, int]

WHITE, DARK, ACCENT, UNSURE = (255, 255, 255), (16, 20, 28), (255, 205, 0), (190, 190, 190)
FLOOR_HALF_M, RULER_AWAY_M, RULER_M, TICK_M = 0.35, 0.50, 1.0, 0.1
GROUND_M, JUMP_M = 0.05, 0.10  # below the one a player stands, above the other a jump has begun
EM_SHARE = 1 / 34  # of the picture's height
_ANKLES = [LEG_POINTS.index("ankle_left"), LEG_POINTS.index("ankle_right")]
_BITS = 4


@dataclass(frozen=True, slots=True)
class Height:
    """How high a player's feet are above where they stood [m]; the peak is that of the last jump, if there was one."""

    now_m: float
    peak_m: float | None = None
    is_up: bool = False

    def then(self, now_m: float, *, counts: bool) -> Height:
        """Return what is shown next; only what counts can be a peak."""
        if now_m < GROUND_M:
            return Height(now_m, self.peak_m, False)
        if not counts or (now_m < JUMP_M and not self.is_up):
            return Height(now_m, self.peak_m, self.is_up)
        return Height(now_m, max(now_m, self.peak_m or 0.0) if self.is_up else now_m, True)


class Heights:
    """The heights of all players from frame to frame: the mean of both ankles above their places at the start."""

    def __init__(self, starts: Sequence[PlayerStart]) -> None:
        """Take the standing heights from the starts that have legs."""
        with_legs = [start for start in starts if start.has_legs]
        self._standing_m = {s.name: np.mean([s.joints_m[LEG_POINTS[i]][2] for i in _ANKLES]) for s in with_legs}
        self._shown = {name: Height(0.0) for name in self._standing_m}

    def after(self, known: Mapping[str, tuple[Array, Status]]) -> dict[str, Height]:
        """Return the heights of the players whose points (6, 3) [m] are known at the next time."""
        for player, (points, status) in known.items():
            now_m = float(points[_ANKLES, 2].mean() - self._standing_m[player])
            self._shown[player] = self._shown[player].then(now_m, counts=status is Status.TRACKED)
        return {player: self._shown[player] for player in known}


@dataclass(frozen=True, slots=True, eq=False)
class Jumper:
    """What the graphic shows of one player."""

    name: str
    points: Array  # (6, 3) [m], as LEG_POINTS
    height: Height
    is_sure: bool

    @property
    def rgb(self) -> Colour:
        """The colour of the player's height."""
        return ACCENT if self.is_sure else UNSURE

    @property
    def ground(self) -> Array:
        """The floor below the feet: (3,) [m]."""
        return np.append(self.points[_ANKLES, :2].mean(axis=0), 0.0)


def draw_heights(picture: Picture, camera: Camera, jumpers: Sequence[Jumper]) -> None:
    """Draw into a camera's picture a floor line and a ruler for each player, and a row of plates at its lower edge.

    Rulers stand outside: to the left of players in the left half of the group, to the right of the others.
    """
    em = picture.shape[0] * EM_SHARE
    right = camera.camera_from_world.rotation.as_matrix()[0] * [1, 1, 0]
    right /= np.linalg.norm(right)
    seen = [jumper for jumper in jumpers if np.isfinite(camera.px_from_world(jumper.ground)).all()]
    order = sorted(seen, key=lambda jumper: camera.px_from_world(jumper.ground)[0])
    for k, jumper in enumerate(order):
        side = -1 if 2 * k + 1 < len(order) else 1
        _draw_one(picture, camera, jumper, side * right, side, em)
    _draw_plates(picture, jumpers, em)


def _draw_one(picture: Picture, camera: Camera, jumper: Jumper, outward: Array, side: int, em: float) -> None:
    ground, height_m = jumper.ground, float(np.clip(jumper.height.now_m, 0.0, RULER_M))
    floor = camera.px_from_world(ground + np.outer([-FLOOR_HALF_M, FLOOR_HALF_M], outward))
    marks_m = np.arange(round(RULER_M / TICK_M) + 1) * TICK_M
    peak_m = min(jumper.height.peak_m or 0.0, RULER_M)
    at_m = np.array([*marks_m, height_m, peak_m])
    *marks, now, peak = camera.px_from_world(ground + RULER_AWAY_M * outward + np.outer(at_m, [0, 0, 1.0]))
    if not np.isfinite([*floor, *marks]).all():
        return
    _line(picture, floor[0], floor[1], jumper.rgb, em / 8)
    for thickness, rgb in ((em / 5, DARK), (em / 12, WHITE)):
        _line(picture, marks[0], marks[-1], rgb, thickness)
        for k, mark in enumerate(marks):
            _line(picture, mark, mark + np.array([-side * em * (0.2 if k % 5 else 0.45), 0]), rgb, thickness)
    _line(picture, marks[0], now, jumper.rgb, em / 4)
    if jumper.height.peak_m is not None:
        half = np.array([em * 0.4, 0])
        _line(picture, peak - half, peak + half, jumper.rgb, em / 8)
    number = f"{_cm(jumper.height.now_m)}"
    wide = text_width(number, size_px=em, bold=True)
    x = now[0] + em * 0.6 if side > 0 else now[0] - em * 0.6 - wide
    _outlined(picture, number, (x, now[1] + em * 0.35), em, jumper.rgb)
    name_px = em * 0.62
    middle = floor.mean(axis=0) + np.array([-text_width(jumper.name, size_px=name_px, bold=True) / 2, em * 0.9])
    _outlined(picture, jumper.name, (middle[0], middle[1]), name_px, WHITE)


def _draw_plates(picture: Picture, jumpers: Sequence[Jumper], em: float) -> None:
    """Draw dark plates side by side: name, height in centimetres, the last jump's peak."""
    wide = [max(text_width(jumper.name, size_px=em * 0.8), 6.5 * em) + em for jumper in jumpers]
    gap, tall = em * 0.5, 3.7 * em
    x = (picture.shape[1] - sum(wide) - gap * (len(wide) - 1)) / 2
    y = picture.shape[0] - tall - em
    for jumper, width in zip(jumpers, wide, strict=True):
        x0, y0 = max(round(x), 0), max(round(y), 0)
        plate = picture[y0 : y0 + round(tall), x0 : x0 + round(width)]
        plate[:] = plate * 0.25 + np.array(DARK) * 0.75
        plate[: max(round(em / 8), 1)] = jumper.rgb
        peak = "" if jumper.height.peak_m is None else f"peak {_cm(jumper.height.peak_m)} cm"
        left = x0 + em / 2
        draw_text(picture, jumper.name, (left, y0 + em), size_px=em * 0.8, rgb=WHITE)
        number = f"{_cm(jumper.height.now_m)} cm"
        draw_text(picture, number, (left, y0 + 2.4 * em), size_px=em * 1.4, rgb=jumper.rgb, bold=True)
        draw_text(picture, peak, (left, y0 + 3.3 * em), size_px=em * 0.8, rgb=WHITE)
        x += width + gap


def _cm(height_m: float) -> int:
    return max(round(height_m * 100), 0)


def _outlined(picture: Picture, text: str, at: tuple[float, float], size_px: float, rgb: Colour) -> None:
    """Write bold text with a dark rim, to be read on any ground."""
    rim = max(size_px / 14, 0.7)
    for dx, dy in ((-rim, 0), (rim, 0), (0, -rim), (0, rim)):
        draw_text(picture, text, (at[0] + dx, at[1] + dy), size_px=size_px, rgb=DARK, bold=True)
    draw_text(picture, text, at, size_px=size_px, rgb=rgb, bold=True)


def _line(picture: Picture, a: Array, b: Array, rgb: Colour, thickness: float) -> None:
    ends = [tuple(np.rint(end * (1 << _BITS)).astype(int).tolist()) for end in (a, b)]
    cv2.line(picture, ends[0], ends[1], rgb, max(round(thickness), 1), cv2.LINE_AA, _BITS)
