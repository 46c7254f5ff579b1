"""What is tracked for the block-jump paper's Table I: sequences, methods and seeds; and the paper's numbers."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from airborne.synthetic import BlockScene, block_scene
from airborne.synthetic.block.scene import paper_lengths
from airborne.tracking.particle.swing import Swing

BlockMethod = Literal["framework", "mixture", "block-jump", "blocker"]
_FILTERS: tuple[BlockMethod, ...] = ("framework", "mixture", "block-jump")
BLOCK_METHODS: tuple[BlockMethod, ...] = (*_FILTERS, "blocker")
PAPER_PARTS = (
    "hip_left",
    "hip_right",
    "knee_left",
    "knee_right",
    "ankle_left",
    "ankle_right",
)  # the paper's feet: ankles
PAPER_SUCCESS: dict[str, tuple[float, ...]] = {  # success in percent, as PARTS
    "framework": (84.8, 82.6, 66.3, 65.9, 67.1, 66.9),
    "mixture": (94.7, 95.1, 81.7, 76.8, 78.4, 80.6),
    "block-jump": (97.7, 98.5, 91.4, 92.2, 93.9, 93.8),
}
FAILS_BELOW = 0.8  # success of any part, below which a sequence counts as failed
_SCENES = 0  # which draw of the 22 sequences


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockRun:
    """One tracker with one seed. The seed also perturbs the hand-set joints, alike for every method."""

    method: BlockMethod
    seed: int
    n_particles: int = 0  # 0: the method has none
    torsos: Literal["tracked", "given"] = "tracked"  # given: the truth with noise
    swing: Swing = "literal"

    @property
    def row(self) -> str:
        """The row of the table that this run belongs to."""
        if self.swing == "consistent":
            return f"{self.method}, rods keep their lengths"
        return f"{self.method}, torsos given" if self.torsos == "given" else self.method

    @property
    def key(self) -> str:
        """A unique name."""
        variant = "-consistent" if self.swing == "consistent" else ""
        return f"{self.method}{variant}-{self.torsos}-{self.n_particles}-{self.seed}"


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockTake:
    """One sequence and who tracks it."""

    number: int  # of the paper's 22, from 0
    scene_seed: int
    n_blockers: int
    n_frames: int
    runs: tuple[BlockRun, ...]

    def scene(self) -> BlockScene:
        """Draw the scene; takes seconds."""
        return block_scene(self.scene_seed, n_blockers=self.n_blockers, n_frames=self.n_frames)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The extent of the reproduction."""

    numbers: tuple[int, ...]  # which of the 22 sequences
    n_seeds: int
    n_particles: int
    has_variants: bool  # "block-jump" with torsos given, and with rods that keep their lengths
    sweep: tuple[int, ...]  # particles of "block-jump"
    sweep_numbers: tuple[int, ...]  # sequences
    n_sweep_seeds: int

    def to_dict(self) -> dict[str, Any]:
        """Return the plan for a JSON file."""
        return asdict(self)

    def takes(self) -> list[BlockTake]:
        """Return the sequences; those with most work come first."""
        n_frames, n_blockers = paper_lengths(np.random.default_rng([_SCENES, 20]))
        takes = [
            BlockTake(
                number=k,
                scene_seed=1000 * (_SCENES + 1) + k,
                n_blockers=int(n_blockers[k]),
                n_frames=int(n_frames[k]),
                runs=(*self._table_runs(), *(self._sweep_runs() if k in self.sweep_numbers else ())),
            )
            for k in self.numbers
        ]
        return sorted(takes, key=lambda take: (-take.n_blockers * len(take.runs) * take.n_frames, take.number))

    def _table_runs(self) -> list[BlockRun]:
        seeds, count = range(self.n_seeds), self.n_particles
        runs = [BlockRun(method=method, seed=seed, n_particles=count) for method in _FILTERS for seed in seeds]
        runs += [BlockRun(method="blocker", seed=seed) for seed in seeds]
        if self.has_variants:
            runs += [BlockRun(method="block-jump", seed=seed, n_particles=count, torsos="given") for seed in seeds]
            runs += [BlockRun(method="block-jump", seed=seed, n_particles=count, swing="consistent") for seed in seeds]
        return runs

    def _sweep_runs(self) -> list[BlockRun]:
        counts = [count for count in self.sweep if count != self.n_particles]
        return [
            BlockRun(method="block-jump", seed=seed, n_particles=count)
            for count in counts
            for seed in range(self.n_sweep_seeds)
        ]


FULL = Plan(
    numbers=tuple(range(22)),
    n_seeds=5,
    n_particles=1500,
    has_variants=True,
    sweep=(100, 300, 1000, 1500, 5000),
    sweep_numbers=(0, 11, 20),
    n_sweep_seeds=3,
)
QUICK = Plan(
    numbers=(11, 21),
    n_seeds=2,
    n_particles=300,
    has_variants=False,
    sweep=(100, 300),
    sweep_numbers=(21,),
    n_sweep_seeds=2,
)
