"""Measure how often players at the net are found without `[start]`: `python benchmarks/accuracy/find_players.py`.

20 synthetic blocks of one to three blockers and the rendered block of `shared/data/block_jump`, which is not ours
(about 6 minutes of CPU); `--quick` takes one, `--seeds 3001-3008` others, and neither writes rows. A player is right
with a mean error of hips, knees, ankles and feet up to 80 mm; a scene if every blocker is, and nobody else was found.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from finding import measure

from airborne.errors import UndecidedError
from airborne.evaluation import read_players_truth
from airborne.run.find_players import find_players_start
from airborne.synthetic.block.pictures import block_frames
from airborne.synthetic.block.scene import block_scene
from airborne.synthetic.block.truth import true_joints
from airborne.tracking.capsules.jumper import JOINTS
from airborne.tracking.first_pose.moments import spread_sample
from airborne.tracking.first_pose.players import find_players
from airborne.tracking.players import PlayerStart
from airborne.trial.file import read_trial
from airborne.trial.players import start_of
from airborne.trial.start import StartTable
from airborne.types import Array

_RIGHT_M = 0.08
_LEGS = JOINTS[:8]  # without the torso
_EVERY = 11  # frames between those that are rendered and looked at
_BLOCK_JUMP = Path(__file__).resolve().parents[3] / "shared" / "data" / "block_jump"


def verdict(seed: int) -> tuple[str, float]:
    """Find the players of one block; return right, wrong or undecided, and the CPU time [s] without rendering."""
    scene = block_scene(seed, n_blockers=1 + seed % 3)
    whole = {frames.index: frames for frames in block_frames(scene, range(0, scene.n_frames, _EVERY))}
    sample = spread_sample(whole.values(), len(whole))
    start_s = time.process_time()
    finding = find_players(sample, whole.__getitem__)
    cpu_s = time.process_time() - start_s
    index, best = finding.frames.index, finding.candidates[0]
    truth = {}
    for player in scene.blockers:
        joints = true_joints(player, scene.times_s[index : index + 1])
        truth[player.name] = np.array([joints[joint][0] for joint in _LEGS])
    print(f"{scene.name}: frame {index}: {best.probability:.3f}, {cpu_s:.1f} s: ", end="")
    for player in best.players:
        print(f"[support {player.support:.2f}, evidence {player.evidence:.2f}, {player.probability:.3f}] ", end="")
    return _judge(truth, best.starts, is_decided=finding.is_decided), cpu_s


def _errors_m(truth: Mapping[str, Array], starts: Sequence[PlayerStart]) -> list[float]:
    """Return each blocker's mean error of the legs against the player found nearest; infinite where nobody was."""
    legs = [np.array([start.joints_m[joint] for joint in _LEGS]) for start in starts]
    return [
        min((float(np.linalg.norm(each - points, axis=1).mean()) for each in legs), default=np.inf)
        for points in truth.values()
    ]


def _judge(truth: Mapping[str, Array], starts: Sequence[PlayerStart], *, is_decided: bool) -> str:
    errors_m = _errors_m(truth, starts)
    is_right = len(starts) == len(truth) and max(errors_m) <= _RIGHT_M
    word = "undecided" if not is_decided else "right" if is_right else "wrong"
    off = ", ".join(f"{1e3 * error_m:.0f}" for error_m in errors_m)
    print(f"{word}, {len(starts)} of {len(truth)} found, {off} mm off", flush=True)
    return word


def verdict_of_block_jump() -> tuple[str, float]:
    """Find the blocker of the rendered block, from its videos, and follow him back to the first frame."""
    trial = read_trial(_BLOCK_JUMP / "trial.toml").model_copy(update={"start": StartTable(find=True)})
    motion = read_players_truth(_BLOCK_JUMP / "truth.csv")
    start_s = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        try:
            start = find_players_start(trial, Path(folder)).trial.start
        except UndecidedError as error:
            print(f"block_jump: {error}")
            return "undecided", time.process_time() - start_s
    cpu_s = time.process_time() - start_s
    points = motion.points[list(motion.index).index(start.frame), motion.players.index("blocker1")]
    truth = {"blocker1": points[[motion.joints.index(joint) for joint in _LEGS]]}
    print(f"block_jump: frame {start.frame}, {cpu_s:.1f} s: ", end="")
    found = [start_of(player.name, player.joints_m) for player in start.player]
    return _judge(truth, found, is_decided=True), cpu_s


if __name__ == "__main__":
    recordings = [verdict_of_block_jump] if _BLOCK_JUMP.is_dir() else []
    measure(
        "find_players",
        "block_jump and blocks",
        verdict,
        seeds=(4100, 4119),
        n_quick=1,
        floors=(">= 85", "<= 3"),
        recordings=recordings,
    )
