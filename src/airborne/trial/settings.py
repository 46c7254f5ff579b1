"""[track]: the settings of a method, one model for each kind of method."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field, model_validator

from airborne.io.names import CheckedPath
from airborne.rendering import Lights
from airborne.tracking.direct_search.stepping import VRule
from airborne.tracking.methods import Method, Prediction, ScoreName, Settings
from airborne.tracking.particle import LegsMethod, LegsSettings
from airborne.tracking.particle.bootstrap import ResampleWhen
from airborne.tracking.particle.resampling import Scheme
from airborne.tracking.particle.settings import EstimateAs, ViewsAs
from airborne.tracking.particle.swing import Swing
from airborne.trial.table import SettingsTable

StepSizes = Annotated[list[Annotated[float, Field(gt=0)]], Field(strict=False)]
CapsuleMethod = Literal["blocker"]
Overlay = Literal["paper", "broadcast"]
Directions = Literal["both", "forward"]


class _Settings(SettingsTable):
    """What every method reads."""

    method: str
    every: Annotated[int, Field(ge=1)] = 1  # track every n-th frame or field
    stop: Annotated[int, Field(ge=1)] | None = None  # one past the last frame or field

    @model_validator(mode="before")
    @classmethod
    def _check_unread(cls, table: Any) -> Any:
        """Refuse keys that only other methods read, by a better name than unknown."""
        known = {key for settings in _Settings.__subclasses__() for key in settings.model_fields}
        unread = sorted(key for key in table if key in known - set(cls.model_fields)) if isinstance(table, dict) else []
        if unread:
            raise ValueError(f"{', '.join(unread)}: not read by method '{table['method']}'; remove it")
        return table

    def check_stretch(self, frame: int) -> None:
        """Raise ValueError where no frame is left to track from a start in `frame` on."""
        if self.stop is not None and self.stop <= frame:
            raise ValueError(
                f"track.stop = {self.stop} leaves no frame, as start.frame = {frame}; give a later one, or none"
            )

    def first_frame(self, frame: int) -> int:
        """Return the first frame that is tracked, by that of the start."""
        return frame


class BodySettings(_Settings):
    """Methods of one body. A file may set what its method leaves unread, so that methods can be compared on it."""

    method: Method = "refined"
    start: Annotated[int, Field(ge=0)] | None = None  # the first frame or field; before start.frame, tracked backward
    prediction: Prediction = "smooth"
    directions: Directions = "both"  # between [[key]] tables, and of people; or forward alone
    whole_run: bool = True  # refined: fit a person's poses of all frames once more, all at once
    fixed_shape: bool = False  # joint angles stay those of the start; stepping and simplex never change them
    colour: ScoreName = "normalised"  # stepping and simplex: paper B's score
    v_rule: VRule = "v_sym"  # stepping
    steps_mm: StepSizes = [50, 30, 20, 10, 10, 5, 5]  # stepping: one loop each
    steps_deg: StepSizes = [5, 3, 2, 1, 1, 0.5, 0.5]
    scale: Literal[1, 2, 4] = 1  # stepping and simplex: reduction of the images

    @model_validator(mode="after")
    def _check_steps(self) -> BodySettings:
        if len(self.steps_mm) != len(self.steps_deg) or not self.steps_mm:
            raise ValueError("steps_mm and steps_deg need one number each for every loop, equally many")
        return self

    def check_stretch(self, frame: int) -> None:
        """Raise ValueError where no frame is left to track from a start in `frame` on, or none before it."""
        super().check_stretch(frame)
        if self.start is not None and self.start > frame:
            raise ValueError(
                f"track.start = {self.start} lies after start.frame = {frame}, from where the body is followed; give "
                "that frame, an earlier one, or none"
            )

    def first_frame(self, frame: int) -> int:
        """Return the first frame that is tracked, by that of the start: that, or one before it."""
        return frame if self.start is None else frame - (frame - self.start) // self.every * self.every

    @property
    def fits_whole_run(self) -> bool:
        """Whether a run is fitted once more at its end, if the body has joints."""
        return self.method == "refined" and self.whole_run and not self.fixed_shape

    def with_lights(self, lights: Lights | None, *, is_exact: bool) -> Settings:
        """Return the settings as the trackers take them, in metres and radians; lights None where unknown."""
        steps = zip(self.steps_mm, self.steps_deg, strict=True)
        return Settings(
            method=self.method,
            prediction=self.prediction,
            fixed_shape=self.fixed_shape,
            colour=self.colour,
            v_rule=self.v_rule,
            loops=tuple((mm / 1000, float(np.radians(deg))) for mm, deg in steps),
            scale=self.scale,
            lights=lights,
            is_light_exact=is_exact,
        )


class CapsuleSettings(_Settings):
    """Players as capsules. A file may also set what the particle filters read: that stays unread."""

    method: CapsuleMethod = "blocker"
    overlay: Overlay = "paper"  # what the overlay videos show

    @model_validator(mode="before")
    @classmethod
    def _leave_filters_out(cls, table: Any) -> Any:
        unread = set(ParticleSettings.model_fields) - set(cls.model_fields)
        return {key: value for key, value in table.items() if key not in unread} if isinstance(table, dict) else table


class ParticleSettings(_Settings):
    """The particle filters of players' legs."""

    method: LegsMethod = "block-jump"
    n_particles: Annotated[int, Field(ge=50, le=100_000)] | None = None  # None: the method's own
    seed: Annotated[int, Field(ge=0)] = 0  # of the random numbers
    swing: Swing = "literal"  # block-jump: how rods swing
    estimate: EstimateAs | None = None  # None: the method's own
    views: ViewsAs = "all"  # which cameras count
    tempered: bool = False  # a softer comparison of histograms, the more cameras
    torso_shift: bool = False  # the whole body moves along with the torso
    resample: Scheme = "systematic"
    resample_when: ResampleWhen = "always"
    torso: CheckedPath | None = None  # a table of torsos; None: they are tracked
    overlay: Overlay = "paper"  # what the overlay videos show

    @property
    def filter(self) -> LegsSettings:
        """The settings as the trackers take them."""
        own = self.model_dump(exclude={"every", "stop", "torso", "overlay"}, exclude_none=True)
        return LegsSettings(**own)


TrackSettings = Annotated[BodySettings | CapsuleSettings | ParticleSettings, Field(discriminator="method")]

BODY_METHODS: tuple[str, ...] = get_args(Method)
PLAYERS_METHODS: tuple[str, ...] = (*get_args(CapsuleMethod), *reversed(get_args(LegsMethod)))
METHODS = (*BODY_METHODS, *PLAYERS_METHODS)
KEY_METHODS = ("refined", "joint", "hierarchical")  # those that read [[key]]
