"""Settings of the particle filters of legs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from airborne.errors import TrialError
from airborne.tracking.particle.bootstrap import ResampleWhen
from airborne.tracking.particle.resampling import Scheme
from airborne.tracking.particle.swing import Swing

LegsMethod = Literal["framework", "mixture", "block-jump"]
EstimateAs = Literal["max", "mean", "top10_mean"]
ViewsAs = Literal["all", "visible", "robust"]

_LEAST_PARTICLES = 50  # of a filter of legs


@dataclass(frozen=True, slots=True, kw_only=True)
class LegsSettings:
    """The block-jump paper's three filters (its Table I), and the choices that it leaves open.

    Every method compares `n_particles` hypotheses per player and frame with the images: "framework" has them all in one
    filter; the others take a fifth for the hips and two fifths for each leg.

    `estimate` is the best combination ("max", the paper's), the weighted mean of all, or of the ten best. `views`:
    "all" (the paper's); "visible" leaves out cameras in which another player occludes a part; "robust" mixes in a
    probability of one tenth that a camera shows something else. `tempered` divides the stiffness of the histograms'
    comparison by the root of the number of cameras. `torso_shift` moves everything along with the torso before it is
    moved at random (not in the paper).
    """

    method: LegsMethod = "block-jump"
    seed: int = 0
    n_particles: int = 1500
    swing: Swing = "literal"
    estimate: EstimateAs = "max"
    views: ViewsAs = "all"
    tempered: bool = False
    torso_shift: bool = False
    resample: Scheme = "systematic"
    resample_when: ResampleWhen = "always"

    def __post_init__(self) -> None:
        if self.n_particles < _LEAST_PARTICLES:
            raise TrialError(f"n_particles = {self.n_particles}; a filter of legs needs at least {_LEAST_PARTICLES}")
        if self.seed < 0:
            raise TrialError(f"seed = {self.seed}; give 0 or a positive whole number")

    @property
    def n_hips(self) -> int:
        """Particles of the filter of the hips (PF1)."""
        return self.n_particles // 5

    @property
    def n_leg(self) -> int:
        """Particles of the filter of each shank (PF2)."""
        return 2 * self.n_particles // 5
