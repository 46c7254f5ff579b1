"""A graphic for broadcasts: the floor under a player, a ruler, the height of the feet, the peak of the jump."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from airborne.body.legs import LEG_POINTS
from airborne.cameras import Camera
from airborne.export.lettering import draw_text, text_width
from airborne.tracking import Status
from airborne.tracking.players import PlayerStart
from airborne.types import Array, Image

_Colour = tuple[int, int, int]

# sRGB; ACCENT where the height is sure
_WHITE, _DARK, ACCENT, UNSURE = (255, 255, 255), (16, 20, 28), (255, 205, 0), (190, 190, 190)
# half width of the floor's mark, ruler from the player, its height, a tick
_FLOOR_HALF_M, _RULER_AWAY_M, _RULER_M, _TICK_M = 0.35, 0.50, 1.0, 0.1
_GROUND_M, _JUMP_M = 0.05, 0.10  # below the first a player stands, above the second a jump has begun
_EM_SHARE = 1 / 34  # of the image's height
_ANKLES = [LEG_POINTS.index("ankle_left"), LEG_POINTS.index("ankle_right")]
_BITS = 4  # of a pixel, for smooth edges


@dataclass(frozen=True, slots=True)
class Height:
    """Height of a player's feet over their standing height [m]; the peak is that of the last jump, if any."""

    now_m: float
    peak_m: float | None = None
    is_up: bool = False

    def advance(self, now_m: float, *, is_tracked: bool) -> Height:
        """Return the next height to show; only a tracked one can be a peak."""
        if now_m < _GROUND_M:
            return Height(now_m, self.peak_m, False)
        if not is_tracked or (now_m < _JUMP_M and not self.is_up):
            return Height(now_m, self.peak_m, self.is_up)
        return Height(now_m, max(now_m, self.peak_m or 0.0) if self.is_up else now_m, True)


class Heights:
    """The heights of all players from frame to frame: the mean of both ankles over their height at the start."""

    def __init__(self, starts: Sequence[PlayerStart]) -> None:
        """Take the standing heights from the starts with legs."""
        with_legs = [start for start in starts if start.has_legs]
        self._standing_m = {s.name: np.mean([s.joints_m[LEG_POINTS[i]][2] for i in _ANKLES]) for s in with_legs}
        self._heights = {name: Height(0.0) for name in self._standing_m}

    def update(self, located: Mapping[str, tuple[Array, Status]]) -> dict[str, Height]:
        """Return the heights of the players whose points (6, 3) [m] are given at the next time."""
        for player, (points, status) in located.items():
            now_m = float(points[_ANKLES, 2].mean() - self._standing_m[player])
            self._heights[player] = self._heights[player].advance(now_m, is_tracked=status is Status.TRACKED)
        return {player: self._heights[player] for player in located}


@dataclass(frozen=True, slots=True, eq=False)
class Jumper:
    """One player as the graphic shows them."""

    name: str
    points: Array  # (6, 3) [m], as LEG_POINTS
    height: Height
    is_sure: bool

    @property
    def rgb(self) -> _Colour:
        """The colour of the player's height."""
        return ACCENT if self.is_sure else UNSURE

    @property
    def ground(self) -> Array:
        """The floor below the feet: (3,) [m]."""
        return np.append(self.points[_ANKLES, :2].mean(axis=0), 0.0)


def draw_heights(image: Image, camera: Camera, jumpers: Sequence[Jumper]) -> None:
    """Draw into a camera's image a floor line and a ruler for each player, and a row of captions at its lower edge.

    Rulers stand outside: to the left of players in the left half of the group, to the right of the others.
    """
    em = image.shape[0] * _EM_SHARE
    right = camera.camera_from_world.rotation.as_matrix()[0] * [1, 1, 0]
    right /= np.linalg.norm(right)
    visible = [jumper for jumper in jumpers if np.isfinite(camera.px_from_world(jumper.ground)).all()]
    order = sorted(visible, key=lambda jumper: camera.px_from_world(jumper.ground)[0])
    for k, jumper in enumerate(order):
        side = -1 if 2 * k + 1 < len(order) else 1
        _draw_player(image, camera, jumper, outward=side * right, side=side, em=em)
    _draw_captions(image, jumpers, em)


def _draw_player(image: Image, camera: Camera, jumper: Jumper, *, outward: Array, side: int, em: float) -> None:
    ground, height_m = jumper.ground, float(np.clip(jumper.height.now_m, 0.0, _RULER_M))
    floor = camera.px_from_world(ground + np.outer([-_FLOOR_HALF_M, _FLOOR_HALF_M], outward))
    marks_m = np.arange(round(_RULER_M / _TICK_M) + 1) * _TICK_M
    peak_m = min(jumper.height.peak_m or 0.0, _RULER_M)
    at_m = np.array([*marks_m, height_m, peak_m])
    *marks, now, peak = camera.px_from_world(ground + _RULER_AWAY_M * outward + np.outer(at_m, [0, 0, 1.0]))
    if not np.isfinite([*floor, *marks]).all():
        return
    _draw_line(image, floor[0], floor[1], jumper.rgb, thickness=em / 8)
    for thickness, rgb in ((em / 5, _DARK), (em / 12, _WHITE)):
        _draw_line(image, marks[0], marks[-1], rgb, thickness=thickness)
        for k, mark in enumerate(marks):
            _draw_line(
                image, mark, mark + np.array([-side * em * (0.2 if k % 5 else 0.45), 0]), rgb, thickness=thickness
            )
    _draw_line(image, marks[0], now, jumper.rgb, thickness=em / 4)
    if jumper.height.peak_m is not None:
        half = np.array([em * 0.4, 0])
        _draw_line(image, peak - half, peak + half, jumper.rgb, thickness=em / 8)
    number = f"{_cm(jumper.height.now_m)}"
    width = text_width(number, size_px=em, bold=True)
    x = now[0] + em * 0.6 if side > 0 else now[0] - em * 0.6 - width
    _draw_outlined_text(image, number, (x, now[1] + em * 0.35), size_px=em, rgb=jumper.rgb)
    name_px = em * 0.62
    middle = floor.mean(axis=0) + np.array([-text_width(jumper.name, size_px=name_px, bold=True) / 2, em * 0.9])
    _draw_outlined_text(image, jumper.name, (middle[0], middle[1]), size_px=name_px, rgb=_WHITE)


def _draw_captions(image: Image, jumpers: Sequence[Jumper], em: float) -> None:
    """Draw dark captions side by side: name, height in centimetres, peak of the last jump."""
    widths = [max(text_width(jumper.name, size_px=em * 0.8), 6.5 * em) + em for jumper in jumpers]
    gap, height = em * 0.5, 3.7 * em
    x = (image.shape[1] - sum(widths) - gap * (len(widths) - 1)) / 2
    y = image.shape[0] - height - em
    for jumper, width in zip(jumpers, widths, strict=True):
        x0, y0 = max(round(x), 0), max(round(y), 0)
        caption = image[y0 : y0 + round(height), x0 : x0 + round(width)]
        caption[:] = caption * 0.25 + np.array(_DARK) * 0.75
        caption[: max(round(em / 8), 1)] = jumper.rgb
        peak = "" if jumper.height.peak_m is None else f"peak {_cm(jumper.height.peak_m)} cm"
        left = x0 + em / 2
        draw_text(image, jumper.name, (left, y0 + em), size_px=em * 0.8, rgb=_WHITE)
        number = f"{_cm(jumper.height.now_m)} cm"
        draw_text(image, number, (left, y0 + 2.4 * em), size_px=em * 1.4, rgb=jumper.rgb, bold=True)
        draw_text(image, peak, (left, y0 + 3.3 * em), size_px=em * 0.8, rgb=_WHITE)
        x += width + gap


def _cm(height_m: float) -> int:
    return max(round(height_m * 100), 0)


def _draw_outlined_text(image: Image, text: str, at: tuple[float, float], *, size_px: float, rgb: _Colour) -> None:
    """Write bold text with a dark rim, legible on any background."""
    rim = max(size_px / 14, 0.7)
    for dx, dy in ((-rim, 0), (rim, 0), (0, -rim), (0, rim)):
        draw_text(image, text, (at[0] + dx, at[1] + dy), size_px=size_px, rgb=_DARK, bold=True)
    draw_text(image, text, at, size_px=size_px, rgb=rgb, bold=True)


def _draw_line(image: Image, a: Array, b: Array, rgb: _Colour, *, thickness: float) -> None:
    ends = [tuple(np.rint(end * (1 << _BITS)).astype(int).tolist()) for end in (a, b)]
    cv2.line(image, ends[0], ends[1], rgb, max(round(thickness), 1), cv2.LINE_AA, _BITS)
