"""The height of the net over a court whose floor is right: clicked points of another net than was stated."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airborne.calibration.sources.control_points import ControlPoints
from airborne.calibration.sources.court import court_points
from airborne.cameras import Rig
from airborne.cameras.finding import Finding

_OF_NET = ("net_", "antenna_")  # as their names begin; posts have a height of their own
_RISES_M = np.arange(-1.0, 1.005, 0.01)  # chosen: that are tried; nets for children are a metre lower than men's


def check_net(rig: Rig, points: ControlPoints, *, most_px: float) -> list[Finding]:
    """Report a net that is higher or lower than stated: then all points fit to `most_px` [px, RMS], and else do not."""
    names = [name for name in rig.names if name in points.cameras]
    is_net = np.array([name.startswith(_OF_NET) for name in points.names])
    if not is_net.any() or is_net.all():
        return []
    seen = points.select(names)
    floor_px = _rms_px(rig, seen, ~is_net, 0.0)
    misses_px = np.array([_rms_px(rig, seen, is_net, rise_m) for rise_m in _RISES_M])
    stated_px, best = _rms_px(rig, seen, is_net, 0.0), int(np.argmin(misses_px))
    if not max(floor_px, misses_px[best]) <= most_px < stated_px:
        return []
    rise_m = float(_RISES_M[best])
    stated_m = _net_height_m(points)
    return [
        Finding(
            kind="misfit",
            what=f"court: only the net's points miss, by {stated_px:.0f} px, the others by {floor_px:.1f} px",
            advice=f"a net at {stated_m + rise_m:.2f} m fits, {abs(rise_m):.2f} m {'above' if rise_m > 0 else 'below'} "
            f"the stated {stated_m:.2f} m; give its height",
        )
    ]


def _net_height_m(points: ControlPoints) -> float:
    """Return the height of the net over the middle of the court that its points were placed by [m]."""
    height_m = 2.0  # of any net: its points rise as it does
    low = court_points(height_m)
    rises = [
        z - low[name].position_m[2]
        for name, z in zip(points.names, points.world[:, 2], strict=True)
        if name.startswith(_OF_NET)
    ]
    return height_m + float(np.median(rises))


def _rms_px(rig: Rig, points: ControlPoints, is_in: NDArray[np.bool_], rise_m: float) -> float:
    """Return how far the clicks of some points lie from these, raised by so much [px, RMS]."""
    raised = points.world[is_in] + [0.0, 0.0, rise_m]
    misses = [rig[name].px_from_world(raised) - points.px[is_in, i] for i, name in enumerate(points.cameras)]
    return float(np.sqrt(np.nanmean(np.sum(np.square(misses), axis=-1))))
