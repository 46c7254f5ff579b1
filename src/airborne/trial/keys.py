"""[[key]]: what is known of the body's pose at a later frame, each with its standard deviation."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from airborne.trial.pose_forms import BY_HAND, PoseForms

_Positive = Annotated[float, Field(gt=0)]


class KeyTable(PoseForms):
    """Evidence of the pose at one frame, in any of the forms of [start], several of them together, or parts of one."""

    frame: Annotated[int, Field(ge=0)]
    sd_m: _Positive = 0.03  # of position_m and joints_m: what a person takes for a joint's centre
    sd_px: _Positive = 5.0  # of points_px and detections
    sd_deg: _Positive = 10.0  # of the rotation and of joint_angles_deg

    @model_validator(mode="after")
    def _check_key(self) -> KeyTable:
        if not (BY_HAND | {"joints_m", "points_px", "detections"}) & self.model_fields_set:
            raise ValueError(
                "nothing is said of the pose; give points_px, joints_m, detections, position_m, a rotation or "
                "joint_angles_deg"
            )
        return self
