"""The tracking methods by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose, surface_arrays
from airborne.body.colours import with_sampled_colours
from airborne.rendering import FLAT, RULES, Lights, render
from airborne.tracking import predictors
from airborne.tracking.direct_search.stepping import VRule
from airborne.tracking.direct_search.trackers import DirectTracker, Search, simplex_search, stepping_search
from airborne.tracking.evidence import PoseEvidence
from airborne.tracking.model_based.refined import RefinedTracker
from airborne.tracking.time_offsets import CompensatedTracker
from airborne.tracking.tracker import Tracker
from airborne.video import Frames

Method = Literal["refined", "joint", "hierarchical", "stepping", "simplex"]
Prediction = Literal["smooth", "ballistic", "none"]
ScoreName = Literal["raw", "normalised", "blend", "union"]

# stepping and simplex get what paper B had: full frames whose missing rows are interpolated
FIELD_MODES: dict[Method, Literal["rows", "interpolated"]] = {
    "refined": "rows",
    "joint": "rows",
    "hierarchical": "rows",
    "stepping": "interpolated",
    "simplex": "interpolated",
}
_DIRECT = frozenset({"colour", "scale", "v_rule", "steps_mm", "steps_deg"})
_MODEL_BASED = frozenset({"fixed_shape", "directions", "whole_run"})
UNREAD_SETTINGS: dict[str, frozenset[str]] = {  # keys of a run's record that its method makes no use of
    "refined": _DIRECT,
    **dict.fromkeys(("joint", "hierarchical"), _DIRECT | {"whole_run"}),
    "stepping": _MODEL_BASED,
    "simplex": _MODEL_BASED | {"v_rule", "steps_mm", "steps_deg"},
    **dict.fromkeys(("mixture", "framework"), frozenset({"swing"})),
}
_SIMPLEX_SIZE = np.array([0.03] * 3 + [0.06] * 3)  # [m], [rad]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """The settings of a method; for stepping and simplex the defaults are paper B's for video."""

    method: Method = "refined"
    prediction: Prediction = "smooth"
    colour: ScoreName = "normalised"
    v_rule: VRule = "v_sym"
    loops: Sequence[tuple[float, float]] = ()  # stepping: a step in position [m] and in angle [rad] for each loop
    scale: Literal[1, 2, 4] = 1  # stepping, simplex: reduction of the images
    lights: Lights | None = None  # None: unknown
    is_light_exact: bool = False  # else only stepping and simplex use `lights`; the others fit the light
    fixed_shape: bool = False  # joints stay as they are at the start; stepping and simplex never move them

    @property
    def exact_lights(self) -> Lights | None:
        """The lights by which images are drawn; None where the light is fitted."""
        return self.lights if self.is_light_exact else None


def tracker_of(
    settings: Settings, model: BodyModel, start: Pose, keys: Mapping[int, PoseEvidence] | None = None
) -> CompensatedTracker:
    """Make the tracker of a method, with the time offsets of late views compensated; `keys` by their frames."""
    return CompensatedTracker(_tracker_of(settings, model, start, keys))


def _tracker_of(settings: Settings, model: BodyModel, start: Pose, keys: Mapping[int, PoseEvidence] | None) -> Tracker:
    if settings.method in ("refined", "joint", "hierarchical"):
        return RefinedTracker(
            model,
            start,
            prediction=settings.prediction,
            lights=settings.exact_lights,
            order=settings.method,
            fixed_shape=settings.fixed_shape,
            keys=keys,
        )
    predict: Callable = {
        "smooth": predictors.linear,
        "ballistic": predictors.ballistic,
        "none": predictors.constant,
    }[settings.prediction]
    rule = RULES[settings.colour]
    if settings.lights is None:  # brightness means little: fit it, and let "union" compare hues
        rule = replace(rule, fits_gain=True, normalised=1.0 if settings.colour == "union" else rule.normalised)
    return DirectTracker(
        model,
        start,
        _search(settings),
        rule=rule,
        lights=settings.lights or FLAT,
        scale=settings.scale,
        predict=predict,
    )


def _search(settings: Settings) -> Search:
    if settings.method == "simplex":
        return simplex_search(_SIMPLEX_SIZE)
    return stepping_search([np.repeat(steps, 3) for steps in settings.loops], settings.v_rule)


def sample_body_colours(
    model: BodyModel, start: Pose, frames: Frames, note: Callable[[str], None] = lambda line: None
) -> BodyModel:
    """Give parts with `colour = "sample"` the colour that the first frames show at the first pose.

    `note` is told which parts they do not show; see `with_sampled_colours`.
    """
    if not model.needs_colours:
        return model
    posed, flat = model.with_pose(start), surface_arrays(model)
    pixels_of_part: list[list[NDArray[np.uint8]]] = [[np.zeros((0, 3), np.uint8)] for _ in model.parts]
    for view in frames.views:
        if view is not None:
            part = render(flat, posed, view.camera, FLAT).part
            for index, pixels in enumerate(pixels_of_part):
                pixels.append(view.rgb[part == index])
    return with_sampled_colours(model, [np.concatenate(pixels) for pixels in pixels_of_part], note)
