"""What a person, or a network, said of a run beside its videos: its keys, and the images that were left out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from airborne.motion import Motion, PlayersMotion
from airborne.tracking import Status
from airborne.trial.file import Trial
from airborne.trial.keys import KeyTable

_FORMS = {  # of a key: what it gives, and the name of its deviation
    "points_px": ("clicks by hand", "sd_px"),
    "detections": ("detections", "sd_px"),
    "joints_m": ("positions of joints", "sd_m"),
    "position_m": ("position by hand", "sd_m"),
    **dict.fromkeys(
        ("rotation_matrix", "quaternion_xyzw", "somersault_tilt_twist_deg"), ("orientation by hand", "sd_deg")
    ),
    "joint_angles_deg": ("joint angles by hand", "sd_deg"),
}


def corrections_of(trial: Trial, frames: Sequence[int]) -> dict[str, Any]:
    """Return the keys and masks of a trial that touch its tracked frames, as a summary has them; none where none do."""
    if not frames:
        return {}
    tracked, first, last = set(frames), frames[0], frames[-1]
    keys = [_describe_key(key) for key in sorted(trial.key, key=lambda key: key.frame) if key.frame in tracked]
    masks = [
        {"camera": mask.camera, "first": max(mask.first, first), "last": min(mask.last, last)}
        for mask in trial.mask
        if mask.first <= last and mask.last >= first
    ]
    return {name: found for name, found in (("keys", keys), ("masks", masks)) if found}


def lost_keys(trial: Trial, motion: Motion | PlayersMotion) -> list[str]:
    """Return a warning for every frame that is lost although the trial has a key of it."""
    if isinstance(motion, PlayersMotion):
        return []
    lost = set(motion.index[motion.status == Status.LOST.value].tolist())
    return [
        f"frame {key.frame} is lost although there is a [[key]] of it: the images do not show the body where the key "
        "has it; look at the frame and mend the key"
        for key in trial.key
        if key.frame in lost
    ]


def _describe_key(key: KeyTable) -> dict[str, Any]:
    """Return a key's frame, what it gives, and the deviations of that."""
    given = key.model_dump(exclude_defaults=True)
    forms = [form for name, form in _FORMS.items() if name in given]
    return {"frame": key.frame, "gives": [what for what, _ in forms]} | {sd: getattr(key, sd) for _, sd in forms}
