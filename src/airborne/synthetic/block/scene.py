"""Scenes of block jumps: everything that such a recording depends on, as one value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial

import numpy as np
from numpy.typing import NDArray

from airborne.cameras import Rig
from airborne.errors import TrialError, require_choice
from airborne.synthetic.block.margins import BodyVolume, gap_m
from airborne.synthetic.block.players import (
    CLEARANCE_M,
    Player,
    draw_attacker,
    draw_blocker,
    draw_bystander,
    volume_over,
)
from airborne.synthetic.block.rig import hall_rig, perturb_calibration
from airborne.synthetic.block.steps import Approach
from airborne.types import Array

_FRAME_RATES = (30, 60, 120)  # usual rates of cameras
_PAPER_FRAMES, _PAPER_SCENES = 1798, 22  # the block-jump paper's sequences
_PAPER_TEAMS = (2, 2, 2, 3, 3)  # blockers, where there are several
_MEAN_FRAMES, _FEWEST_FRAMES = 82, 70  # 1798 / 22 as in the paper; least that shows a jump
_SPREAD_S = 0.08  # between the take-offs of neighbouring blockers
_SPACING_M, _WIDER_M = (0.62, 0.80), 0.04  # between blockers; by how much it is widened until they do not touch
_NEAR_M = 2.5  # players further apart at the start cannot touch
_TRIES = 200  # draws of a player until it is clear of the others
_FLIGHT_S = 0.66  # about
_POSITION_RANGE_M = (-2.6, 2.6)  # of the block along the net
_OUT_OF_WAY_M = 0.7  # from the lines of sight to the block
_APPROACHES: tuple[Approach, ...] = ("static", "shuffle", "crossover")


@dataclass(frozen=True, slots=True, kw_only=True)
class Difficulty:
    """How hard a recording is."""

    colour_similarity: float = 0.8  # of the opponents' legs to the blockers': 0 none, 1 the same clothes
    occlusion: float = 0.35  # probability that another player occludes a view, or stands behind a blocker's legs
    frame_rate: int = 60  # [1/s]: 30, 60 or 120
    n_cameras: int = 3  # 2 to 6
    calibration_error_px: float = 0.5  # sd to the right, and down
    torso_noise_m: float = 0.025  # sd of the torso's input path, each axis
    start_noise_m: float = 0.015  # sd of the joints set by hand, each axis
    noise_sd: float = 3.0  # of the sensor [grey levels]
    gain_spread: float = 0.08  # largest change of a camera's gain, and of its red and blue
    jpeg_quality: int = 85  # 0: no compression
    shadow: float = 0.35  # largest share of light missing in a body's shadow

    def __post_init__(self) -> None:
        for name in ("colour_similarity", "occlusion", "shadow"):
            if not 0 <= getattr(self, name) <= 1:
                raise TrialError(f"{name} is {getattr(self, name):g}; expected 0 to 1")
        if self.frame_rate not in _FRAME_RATES:
            raise TrialError(f"frame_rate is {self.frame_rate}; choose 30, 60 or 120")
        for name in ("calibration_error_px", "torso_noise_m", "start_noise_m", "noise_sd", "gain_spread"):
            if getattr(self, name) < 0:
                raise TrialError(f"{name} is {getattr(self, name):g}; expected zero or more")
        if not 0 <= self.jpeg_quality <= 100:
            raise TrialError(f"jpeg_quality is {self.jpeg_quality}; expected 1 to 100, or 0 for none")


_EASY = Difficulty(colour_similarity=0.0, occlusion=0.0, calibration_error_px=0.0, noise_sd=2.0, gain_spread=0.03)
_HARD = Difficulty(colour_similarity=1.0, occlusion=0.8, calibration_error_px=1.5, noise_sd=4.0, shadow=0.5)
DIFFICULTIES = {"easy": _EASY, "default": Difficulty(), "hard": _HARD}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlockScene:
    """Players at the net, and how they are recorded."""

    name: str
    seed: int  # of all random numbers
    rig: Rig  # the true cameras
    calibrated_rig: Rig  # the cameras as calibrated
    players: tuple[Player, ...]  # blockers first
    n_frames: int
    difficulty: Difficulty = field(default_factory=Difficulty)

    @property
    def rate(self) -> Fraction:
        """Frame rate of the cameras [1/s]."""
        return Fraction(self.difficulty.frame_rate)

    @property
    def times_s(self) -> Array:
        """The frames' times (n,) [s]."""
        return np.arange(self.n_frames) / self.difficulty.frame_rate

    @property
    def blockers(self) -> tuple[Player, ...]:
        """The players whose legs are tracked."""
        return tuple(player for player in self.players if player.role == "blocker")


def block_scene(
    seed: int,
    *,
    n_blockers: int = 1,
    difficulty: Difficulty | str = "default",
    frame_rate: int | None = None,
    n_cameras: int | None = None,
    n_frames: int | None = None,
) -> BlockScene:
    """Draw a block of one to three players against a spiker, with decoys and three team mates in defence.

    `difficulty` is one of DIFFICULTIES by its name, or any other; frames per second and cameras are its own unless
    given. `n_frames` defaults to 82 at 60 frames/s, and to the same duration at other rates. Raises
    AirborneError for an unusable number or name.
    """
    if not isinstance(difficulty, Difficulty):
        require_choice(difficulty, tuple(DIFFICULTIES), "difficulty")
        difficulty = DIFFICULTIES[difficulty]
    given = {"frame_rate": frame_rate, "n_cameras": n_cameras}
    difficulty = replace(difficulty, **{name: value for name, value in given.items() if value is not None})
    if not 1 <= n_blockers <= 3:
        raise TrialError(f"{n_blockers} blockers were asked for; give 1 to 3")
    n_frames = n_frames or round(_MEAN_FRAMES * difficulty.frame_rate / 60)
    if n_frames * 60 < _FEWEST_FRAMES * difficulty.frame_rate:
        raise TrialError(f"{n_frames} frames are too few for a jump; give at least {_FEWEST_FRAMES / 60:.2f} s")
    rng = np.random.default_rng([seed, 21])
    rig = hall_rig(rng, difficulty.n_cameras)
    calibrated_rig = perturb_calibration(rng, rig, difficulty.calibration_error_px)
    duration_s = n_frames / difficulty.frame_rate
    blockers = _draw_block(rng, n_blockers, duration_s)
    players = _add_others(rng, blockers, rig, duration_s=duration_s, difficulty=difficulty)
    return BlockScene(
        name=f"block jump {seed}",
        seed=seed,
        rig=rig,
        calibrated_rig=calibrated_rig,
        players=players,
        n_frames=n_frames,
        difficulty=difficulty,
    )


def paper_lengths(rng: np.random.Generator) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Draw how many frames at 60 a second the paper's sequences have, (22,), and how many blockers, (22,)."""
    lengths = np.clip(rng.normal(_MEAN_FRAMES, 6, _PAPER_SCENES), _FEWEST_FRAMES + 4, 100)
    counts = np.diff(np.round(np.cumsum(lengths) * _PAPER_FRAMES / lengths.sum()), prepend=0).astype(int)
    n_blockers = np.ones(_PAPER_SCENES, int)
    n_blockers[rng.choice(_PAPER_SCENES, len(_PAPER_TEAMS), replace=False)] = _PAPER_TEAMS
    return counts, n_blockers


def _draw_block(rng: np.random.Generator, n_blockers: int, duration_s: float) -> list[Player]:
    """Draw blockers side by side, as near to each other as bodies allow; all approach from the same side."""
    first_s = float(rng.uniform(0.5, 0.62)) * (duration_s - _FLIGHT_S)
    approach = _APPROACHES[rng.choice(3, p=[0.4, 0.4, 0.2])]
    direction = float(rng.choice([-1.0, 1.0]))
    x = float(rng.uniform(*_POSITION_RANGE_M)) - 0.35 * (n_blockers - 1)
    blockers: list[Player] = []
    for k in range(n_blockers):
        takeoff_s = first_s + (float(rng.uniform(0, _SPREAD_S)) if k else 0.0)
        player = _draw_until(
            lambda name=f"blocker{k + 1}", x=x, takeoff_s=takeoff_s: draw_blocker(
                rng, name, x, takeoff_s=takeoff_s, approach=approach, direction=direction, duration_s=duration_s
            )
        )
        while blockers and gap_m(volume_over(player, duration_s), volume_over(blockers[-1], duration_s)) < CLEARANCE_M:
            player = player.translate(np.array([_WIDER_M, 0.0]))
            x += _WIDER_M
        blockers.append(player)
        x += float(rng.uniform(*_SPACING_M))
    return blockers


def _add_others(
    rng: np.random.Generator, blockers: list[Player], rig: Rig, *, duration_s: float, difficulty: Difficulty
) -> tuple[Player, ...]:
    """Add a spiker, one or two decoys and three team mates, each where there is room."""
    players = list(blockers)
    similarity = difficulty.colour_similarity
    block_xy = np.mean([_position(player) for player in blockers], axis=0)
    hit_s = float(np.mean([player.takeoff_s or 0.0 for player in blockers])) - float(rng.uniform(0.02, 0.15))

    def spiker() -> Player:
        x = block_xy[0] + _lateral_offset(rng, difficulty.occlusion)
        return draw_attacker(rng, "spiker", x, takeoff_s=hit_s, similarity=similarity, duration_s=duration_s)

    def decoy(name: str) -> Player:
        position = np.array([block_xy[0] + _lateral_offset(rng, difficulty.occlusion), rng.uniform(0.7, 1.6)])
        return draw_bystander(rng, name, position, is_opponent=True, similarity=similarity, duration_s=duration_s)

    def mate(name: str) -> Player:
        position = _defence_position(rng, block_xy, rig, difficulty.occlusion)
        return draw_bystander(rng, name, position, is_opponent=False, similarity=similarity, duration_s=duration_s)

    draws = [spiker, *(partial(decoy, f"opponent{k}") for k in range(2, 3 + int(rng.integers(1, 3))))]
    draws += [partial(mate, f"mate{k}") for k in (1, 2, 3)]
    volumes = [volume_over(player, duration_s) for player in players]
    for draw in draws:
        player = _draw_until(draw, lambda drawn: _is_clear(volume_over(drawn, duration_s), volumes))
        players.append(player)
        volumes.append(volume_over(player, duration_s))
    return tuple(players)


def _draw_until(draw: Callable[[], Player], is_good: Callable[[Player], bool] = lambda _: True) -> Player:
    """Draw players until one has a possible movement and passes the check."""
    for _ in range(_TRIES):
        try:
            player = draw()
        except TrialError:
            continue
        if is_good(player):
            return player
    raise TrialError("no room was found for all players; use another seed")


def _is_clear(volume: BodyVolume, others: Sequence[BodyVolume]) -> bool:
    """Say whether a player's volume is clear of all others; distant ones are not checked closely."""
    middle = volume[0][0].mean(axis=0)[:2]
    near = [other for other in others if np.linalg.norm(other[0][0].mean(axis=0)[:2] - middle) < _NEAR_M]
    return all(gap_m(volume, other) >= CLEARANCE_M for other in near)


def _position(player: Player) -> Array:
    """Return a player's position at take-off, or at time 0: (2,) [m]."""
    return player.poses(np.array([player.takeoff_s or 0.0])).root_t[0, :2]


def _lateral_offset(rng: np.random.Generator, occlusion: float) -> float:
    """Draw an opponent's offset from the block along the net [m]: behind it, or to one side."""
    if rng.random() < occlusion:
        return float(rng.uniform(-0.35, 0.35))
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(0.8, 2.4))


def _defence_position(rng: np.random.Generator, block_xy: Array, rig: Rig, occlusion: float) -> Array:
    """Draw a team mate's position (2,) [m]: occluding one of the cameras, or none of them."""
    centres = np.array([camera.centre[:2] for camera in rig])
    rays = (centres - block_xy) / np.linalg.norm(centres - block_xy, axis=1, keepdims=True)
    if rng.random() < occlusion:
        ray = rays[int(rng.integers(min(len(rays), 3)))]
        return block_xy + ray * (rng.uniform(1.9, 2.8) / max(-ray[1], 0.4)) + rng.normal(0, 0.12, 2)
    while True:
        position = np.array([rng.uniform(-4.0, 4.0), rng.uniform(-7.0, -3.0)])
        offset = position - block_xy
        distance = np.abs(rays[:, 0] * offset[1] - rays[:, 1] * offset[0])
        if np.all(distance > _OUT_OF_WAY_M):
            return position
