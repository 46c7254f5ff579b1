"""What lies over the pictures of a run: outlines of the body and lines of players' legs, in the videos' own pixels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from airborne.body import PosedBody
from airborne.cameras import Camera
from airborne.export.palette import BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, STATUS_RGB, VERMILION, hex_colour
from airborne.export.views import cached_surface_arrays
from airborne.motion import PlayersMotion
from airborne.motion.run_folder import holds_players
from airborne.rendering import FLAT, render
from airborne.studio.curve_data import LIMBS
from airborne.studio.runs import run_body, run_players, run_rig, run_rows
from airborne.tracking import Status
from airborne.tracking.image_regions import bounding_points
from airborne.types import Array

_COLOURS = {status.value: hex_colour(rgb) for status, rgb in STATUS_RGB.items()}
_TEAM_COLOURS = ((SKY_BLUE, GREEN, BLUE), (ORANGE, VERMILION, PURPLE))  # before and behind the net
BESIDE_COLOUR = PURPLE  # of another run that is laid over the one in view
_RIM_PX = 2  # about the body, so that no outline runs along the border of what is drawn


def outline_items(
    posed: PosedBody, cameras: Sequence[Camera], colour: str, *, step: int = 1, grab: bool = False
) -> list[dict[str, Any]]:
    """Return a body's outline in every camera, one closed line for each part that is seen alone.

    `step` is how many pixels of the video one of the outline has; `grab` lets the body be taken there.
    """
    surface = cached_surface_arrays(posed.model)
    corners, items = bounding_points(posed, surface), []
    for pane, camera in enumerate(cameras):
        width, height = camera.size
        drawn = camera.without_distortion().resample(scale=(step, step), size=(-(-width // step), -(-height // step)))
        drawing = render(surface, posed, drawn, FLAT, region=_region_around(drawn.px_from_world(corners)))
        mask, corner = drawing.mask.astype(np.uint8), drawing.region[:2]
        if not mask.size:
            continue
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE, offset=corner)
        for contour in contours:
            line = camera.distort_px(step * cv2.approxPolyDP(contour, 0.7, True)[:, 0].astype(float))
            item = {"pane": pane, "points": _round(line), "colour": colour, "width": 2, "closed": True}
            items.append({**item, "grab": True} if grab else item)
    return items


def _region_around(px: Array) -> tuple[int, int, int, int] | None:
    """Return x0, y0, x1, y1 around points (n, 2) [px]; None, the whole picture, where one is behind the camera."""
    if not np.isfinite(px).all():
        return None
    (x0, y0), (x1, y1) = np.floor(px.min(axis=0)) - _RIM_PX, np.ceil(px.max(axis=0)) + _RIM_PX
    return int(x0), int(y0), int(x1), int(y1)


def run_overlay(run: Path, frame: int, cameras: Sequence[str], *, colour: str | None = None) -> dict[str, Any]:
    """Return what a run says of a frame: items over the cameras' pictures, and a label.

    Items have the colours of statuses, or that which is given.
    """
    if holds_players(run):
        return _players_overlay(run_players(run), run_rig(run).select(cameras).cameras, frame, colour)
    rows = run_rows(run)
    row = rows.row(frame)
    if row is None:
        return {"items": [], "label": f"frame {frame}"}
    estimate = rows.estimate(row)
    status, pose = estimate.status, estimate.pose
    why = f": {', '.join(estimate.doubts)}" if estimate.doubts else ""
    label = f"frame {frame}   {rows.time_s[row]:.3f} s   {status}{why}"
    if pose is None:
        return {"items": [], "label": label}
    shown = run_rig(run).select(cameras).cameras
    return {"items": outline_items(run_body(run).with_pose(pose), shown, colour or _COLOURS[status]), "label": label}


def _players_overlay(
    motion: PlayersMotion, cameras: Sequence[Camera], frame: int, colour: str | None
) -> dict[str, Any]:
    rows = np.flatnonzero(motion.index == frame)
    if not len(rows):
        return {"items": [], "label": f"frame {frame}"}
    row, items = int(rows[0]), []
    for player, name in enumerate(motion.players):
        status = str(motion.status[row, player])
        if status == Status.LOST.value:
            continue
        joints_m = dict(zip(motion.joints, motion.points[row, player], strict=True))
        items += legs_items(name, joints_m, cameras, colour or _COLOURS[status])
    return {"items": items, "label": f"frame {frame}   {motion.time_s[row]:.3f} s"}


def player_colours(y_m: Mapping[str, float]) -> dict[str, str]:
    """Return a colour for each player, cool before the net (y < 0) and warm behind it, by where each stands."""
    teams: tuple[list[str], list[str]] = ([], [])
    for name, y in y_m.items():
        teams[int(y > 0)].append(name)
    return {
        name: colours[number % len(colours)]
        for team, colours in zip(teams, _TEAM_COLOURS, strict=True)
        for number, name in enumerate(team)
    }


def sides_m(motion: PlayersMotion) -> list[float]:
    """Return where along y each player is, the median over a run [m]; 0 of one who is never found."""
    y = motion.points[..., 1].swapaxes(0, 1)  # (players, n, joints)
    return [float(np.nanmedian(each)) if np.isfinite(each).any() else 0.0 for each in y]


def leg_rods(joints: Sequence[str]) -> list[tuple[str, str]]:
    """Return the pairs of joints that a stick figure of legs joins."""
    chains = [[f"{limb}_{side}" for limb in LIMBS if f"{limb}_{side}" in joints] for side in ("left", "right")]
    return [*(pair for chain in chains for pair in pairwise(chain)), (chains[0][0], chains[1][0])]


def legs_items(
    name: str, joints_m: Mapping[str, Sequence[float]], cameras: Sequence[Camera], colour: str
) -> list[dict[str, Any]]:
    """Return the lines of a player's legs in every camera; joint -> position [m]."""
    items = []
    for side in ("left", "right"):
        points = np.array([joints_m[f"{limb}_{side}"] for limb in LIMBS if f"{limb}_{side}" in joints_m])
        for pane, camera in enumerate(cameras):
            line = camera.px_from_world(points)
            if np.isfinite(line).all():
                text = name if side == "left" else ""
                items.append({"pane": pane, "points": _round(line), "colour": colour, "width": 2.5, "text": text})
    return items


def _round(points: np.ndarray) -> list[list[float]]:
    return np.round(points, 2).tolist()
