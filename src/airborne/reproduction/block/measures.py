"""One estimates sequence against its truth: a record of numbers for each run and player."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from airborne.evaluation.jump_errors import JumpErrors
from airborne.evaluation.players import PlayerErrors, compare_players
from airborne.evaluation.players_truth import reference_jump
from airborne.evaluation.success import Cover
from airborne.export import write_json
from airborne.motion.players import PlayersMotion
from airborne.reproduction.block.causes import CAUSES, TORSO_OFF_M, PlayerTruth, causes_of
from airborne.reproduction.block.occlusion import FULLY_OCCLUDED, occlusion_shares
from airborne.reproduction.block.plan import PAPER_PARTS, BlockRun, BlockTake
from airborne.reproduction.block.tracking import SceneEstimates, true_motion
from airborne.synthetic import BlockScene, jump_truth
from airborne.types import Array

_WARM_UP = 3  # first frames, left out of the times: kernels are compiled, colours learned
_LEGS = len(PAPER_PARTS)


def records_of(
    take: BlockTake, scene: BlockScene, estimates: SceneEstimates, truth: PlayersMotion
) -> list[dict[str, Any]]:
    """Measure every run against the truth of all players: one record for each of its players."""
    occluded = occlusion_shares(scene)
    visible = np.zeros((scene.n_frames, len(truth.players), len(scene.rig), len(truth.joints)), bool)
    visible[:, : len(scene.blockers), :, :_LEGS] = occluded < FULLY_OCCLUDED
    true_jumps = {player.name: reference_jump(jump_truth(player, float(scene.rate))) for player in scene.blockers}
    player_truths = [_player_truth(i, truth, occluded) for i in range(len(scene.blockers))]
    records = []
    for run, motion in estimates.motions.items():
        comparison = compare_players(
            motion, truth, rig=scene.calibrated_rig, visible=visible, reference_jumps=true_jumps
        )
        ms = 1e3 * float(estimates.cpu_s[run][_WARM_UP:].mean()) / len(motion.players)
        for i, (name, errors) in enumerate(comparison.players.items()):
            estimate = _legs(motion)[:, i]
            causes = causes_of(estimate, player_truths[i], _torso_error_m(run, i, estimates, truth))
            records.append(
                {
                    "sequence": take.number,
                    "n_blockers": take.n_blockers,
                    "n_frames": scene.n_frames,
                    "player": name,
                    "row": run.row,
                    "seed": run.seed,
                    "n_particles": run.n_particles,
                    "ms_per_frame": ms,
                    "causes": [int(np.sum(causes == k)) for k in range(len(CAUSES))],
                    "places": f"{run.key}/{i}",
                    **_player_measures(errors),
                    "jumps": [_jump(jump) for jump in comparison.jumps if jump.player == name],
                }
            )
    return records


def torso_record(take: BlockTake, estimates: SceneEstimates, truth: PlayersMotion) -> dict[str, Any]:
    """Return the torso tracker's errors on the blockers, and its time."""
    errors = np.stack([_torso_errors_m(seed, estimates, truth) for seed in estimates.torsos])
    return {
        "mean_mm": 1e3 * errors.mean(),
        "median_mm": 1e3 * np.median(errors),
        "off": np.mean(errors > TORSO_OFF_M),
        "n": errors.size,
        "ms_per_frame": 1e3 * float(estimates.torso_cpu_s[_WARM_UP:].mean()) / take.n_blockers,
    }


def write_take(path: Path, take: BlockTake, scene: BlockScene, estimates: SceneEstimates) -> None:
    """Write the estimates beside `path` as .npz, then the records; the file marks a finished sequence.

    Points (n, 6, 3) [m] and covariances (n, 6, 3, 3) [m2] of each run and player by the record's "places"; the truth of
    player k as `truth/k`.
    """
    arrays: dict[str, Any] = {"time_s": scene.times_s}
    truth = true_motion(scene)
    arrays |= {f"truth/{i}": _legs(truth)[:, i] for i in range(len(scene.blockers))}
    for run, motion in estimates.motions.items():
        columns = [motion.joints.index(name) for name in PAPER_PARTS]
        for i in range(len(motion.players)):
            arrays[f"{run.key}/{i}"] = motion.points[:, i, columns]
            arrays[f"{run.key}/{i}/covariance"] = motion.covariance[:, i, columns]
    np.savez_compressed(path.with_suffix(".npz"), **arrays)
    records = records_of(take, scene, estimates, truth)
    write_json(path, {"records": records, "torso": torso_record(take, estimates, truth)})


def read_take(path: Path) -> dict[str, Any]:
    """Read what `write_take` wrote: "records", each with its distances "error_mm" (n, 6), and "torso"."""
    measures = json.loads(path.read_text(encoding="utf-8"))
    with np.load(path.with_suffix(".npz")) as arrays:
        for record in measures["records"]:
            truth = arrays[f"truth/{record['places'].rsplit('/', 1)[1]}"]
            record["error_mm"] = 1e3 * np.linalg.norm(arrays[record["places"]] - truth, axis=-1)
            record["time_s"] = arrays["time_s"]
    return measures


def _success(cover: Cover) -> dict[str, Any]:
    """Return in how many frames each part is covered, touched and judged, and the tolerance that this implies."""
    return {
        "covered": [cover.rate[name] * cover.n[name] if cover.n[name] else 0.0 for name in PAPER_PARTS],
        "touched": [cover.touching_rate[name] * cover.n[name] if cover.n[name] else 0.0 for name in PAPER_PARTS],
        "judged": [cover.n[name] for name in PAPER_PARTS],
        "tolerance_m": [cover.tolerance_m[name] for name in PAPER_PARTS],
        "touching_tolerance_m": [cover.touching_tolerance_m[name] for name in PAPER_PARTS],
    }


def _player_measures(errors: PlayerErrors) -> dict[str, Any]:
    cover = errors.cover
    assert cover is not None, "cameras were given"
    parts = {name: errors.parts[name] for name in PAPER_PARTS}
    return {
        **_success(cover),
        "within_95": [part.within_95 for part in parts.values()],
        "n_lost": errors.n_lost,
        "n_uncertain": errors.n_uncertain,
        "swaps": errors.swap_rate["knees"],
        "swaps_feet": errors.swap_rate["ankles"],
        "pcp": errors.pcp,
    }


def _jump(jump: JumpErrors) -> dict[str, Any]:
    return {
        "is_found": jump.is_found,
        **jump.stated_height_error_m,
        **jump.stated_event_error_frames,
        "within_95": jump.within_95,
    }


def _player_truth(i: int, truth: PlayersMotion, occluded: Array) -> PlayerTruth:
    legs = _legs(truth)
    return PlayerTruth(truth=legs[:, i], others=np.delete(legs, i, axis=1), occluded=occluded[:, i])


def _torso_error_m(run: BlockRun, i: int, estimates: SceneEstimates, truth: PlayersMotion) -> Array | None:
    if run.method == "blocker" or run.torsos == "given":
        return None
    return _torso_errors_m(run.seed, estimates, truth)[:, i]


def _torso_errors_m(seed: int, estimates: SceneEstimates, truth: PlayersMotion) -> Array:
    torsos = estimates.torsos[seed]
    return np.linalg.norm(torsos - truth.points[:, : torsos.shape[1], truth.joints.index("torso")], axis=-1)


def _legs(motion: PlayersMotion) -> Array:
    return motion.points[:, :, [motion.joints.index(name) for name in PAPER_PARTS]]
