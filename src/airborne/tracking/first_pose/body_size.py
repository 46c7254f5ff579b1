"""Whether a body is as large as the landmarks of its start say, which are no part of what tracks it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from scipy.optimize import minimize_scalar

from airborne.body import BodyModel
from airborne.body.inverse_kinematics import PoseFit, fit_pose
from airborne.constants import ALARM_SDS
from airborne.tracking.self_check.path import alarm
from airborne.types import Array

# chosen on 12 synthetic people, segments 5 % and joints 15 mm off, two such errors: with right statures landmarks were
# 18 to 32 mm off (RMS) and their size 1.00, sd 0.03; with statures 10 % too small 34 to 63 mm and 1.11, sd 0.02
_SUSPECT_RMS_M = 0.04  # two recorded people with right statures: 29 and 39 mm
_SIZE_SD = 0.03  # chosen on the same
_LEAST, _MOST, _STEP = 0.75, 1.35, 0.005  # chosen: sizes that are tried, and how finely


class WrongSize(NamedTuple):
    """A body whose landmarks fit clearly better if it is larger or smaller."""

    value: float  # the share by which it should be larger
    sd: float

    @property
    def sentence(self) -> str:
        """Say it."""
        how = "larger" if self.value > 0 else "smaller"
        return (
            f"the landmarks of the start are those of a body {abs(100 * self.value):.0f} ± {100 * self.sd:.0f} % {how} "
            "than its file or stature says: correct that, or fit the body with `airborne fit-body`"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return what `self_check` in summary.json holds: an alarm."""
        return alarm("body", "scale", value=self.value, sd=self.sd, sentence=self.sentence)


def find_wrong_size(
    model: BodyModel, targets: Mapping[str, Array], weights: Mapping[str, float], fit: PoseFit
) -> WrongSize | None:
    """Find by how much a person should be larger for its landmarks to lie at targets (3,) [m]; None where it is right.

    `fit` is the pose that fits best as it is.
    """
    if not model.has_joints or fit.rms_m < _SUSPECT_RMS_M:
        return None

    def cost_m2(size: float) -> float:  # the targets are scaled, not the body
        scaled = {name: target / size for name, target in targets.items()}
        return (size * fit_pose(model, scaled, weights=weights, start=fit.pose).rms_m) ** 2

    found = minimize_scalar(cost_m2, bounds=(_LEAST, _MOST), method="bounded", options={"xatol": _STEP})
    value = float(found.x) - 1
    return WrongSize(value, _SIZE_SD) if abs(value) > ALARM_SDS * _SIZE_SD else None
