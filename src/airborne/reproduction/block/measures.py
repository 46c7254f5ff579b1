"""One tracked sequence against its truth: a record of plain numbers for each run and player."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airborne.evaluation.jump_errors import JumpErrors
from airborne.evaluation.players import PlayerErrors, compare_players
from airborne.evaluation.players_truth import known_jump
from airborne.evaluation.success import Cover
from airborne.export import write_json
from airborne.motion.players import PlayersMotion
from airborne.reproduction.block.causes import CAUSES, TORSO_OFF_M, Situation, causes_of
from airborne.reproduction.block.occlusion import FULLY_HIDDEN, hidden_shares
from airborne.reproduction.block.plan import PARTS, Run, Take
from airborne.reproduction.block.tracking import Tracked, true_motion
from airborne.synthetic import BlockScene, jump_facts

Array = NDArray[np.floating]

_WARM_UP = 3  # frames whose times are left out: kernels are compiled, colours learned
_LEGS = len(PARTS)


def records_of(take: Take, scene: BlockScene, tracked: Tracked, truth: PlayersMotion) -> list[dict[str, Any]]:
    """Measure every run against the truth of all players: one record for each of its players."""
    hidden = hidden_shares(scene)
    visible = np.zeros((scene.n_frames, len(truth.players), len(scene.rig), len(truth.joints)), bool)
    visible[:, : len(scene.blockers), :, :_LEGS] = hidden < FULLY_HIDDEN
    known = {player.name: known_jump(jump_facts(player, float(scene.rate))) for player in scene.blockers}
    situations = [_situation(i, truth, hidden) for i in range(len(scene.blockers))]
    records = []
    for run, motion in tracked.motions.items():
        compared = compare_players(motion, truth, rig=scene.calibrated, visible=visible, known_jumps=known)
        ms = 1e3 * float(tracked.cpu_s[run][_WARM_UP:].mean()) / len(motion.players)
        for i, (name, errors) in enumerate(compared.players.items()):
            estimate = _legs(motion)[:, i]
            causes = causes_of(estimate, situations[i], _torso_error_m(run, i, tracked, truth))
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
                    **_in_short(errors),
                    "jumps": [_jump(jump) for jump in compared.jumps if jump.player == name],
                }
            )
    return records


def torso_record(take: Take, tracked: Tracked, truth: PlayersMotion) -> dict[str, Any]:
    """Say how good and how dear the torso tracker is: errors of the blockers' torsos."""
    errors = np.stack([_torso_errors_m(seed, tracked, truth) for seed in tracked.torsos])
    return {
        "mean_mm": 1e3 * errors.mean(),
        "median_mm": 1e3 * np.median(errors),
        "off": np.mean(errors > TORSO_OFF_M),
        "n": errors.size,
        "ms_per_frame": 1e3 * float(tracked.torso_cpu_s[_WARM_UP:].mean()) / take.n_blockers,
    }


def write_take(path: Path, take: Take, scene: BlockScene, tracked: Tracked) -> None:
    """Write the estimates beside `path` as .npz, then the records; the file stands for a whole sequence.

    Places (n, 6, 3) [m] and covariances (n, 6, 3, 3) [m2] of each run and player by the record's "places"; the truth of
    player k as `truth/k`.
    """
    arrays: dict[str, Any] = {"time_s": scene.times_s}
    truth = true_motion(scene)
    arrays |= {f"truth/{i}": _legs(truth)[:, i] for i in range(len(scene.blockers))}
    for run, motion in tracked.motions.items():
        columns = [motion.joints.index(name) for name in PARTS]
        for i in range(len(motion.players)):
            arrays[f"{run.key}/{i}"] = motion.points[:, i, columns]
            arrays[f"{run.key}/{i}/covariance"] = motion.covariance[:, i, columns]
    np.savez_compressed(path.with_suffix(".npz"), **arrays)
    records = records_of(take, scene, tracked, truth)
    write_json(path, {"records": records, "torso": torso_record(take, tracked, truth)})


def read_take(path: Path) -> dict[str, Any]:
    """Read what `write_take` wrote: "records", each with its distances "error_mm" (n, 6), and "torso"."""
    found = json.loads(path.read_text(encoding="utf-8"))
    with np.load(path.with_suffix(".npz")) as arrays:
        for record in found["records"]:
            truth = arrays[f"truth/{record['places'].rsplit('/', 1)[1]}"]
            record["error_mm"] = 1e3 * np.linalg.norm(arrays[record["places"]] - truth, axis=-1)
            record["time_s"] = arrays["time_s"]
    return found


def _success(cover: Cover) -> dict[str, Any]:
    """Return in how many frames each part is covered, touched and judged, and what that lets it be off by."""
    return {
        "covered": [cover.rate[name] * cover.n[name] if cover.n[name] else 0.0 for name in PARTS],
        "touched": [cover.touching_rate[name] * cover.n[name] if cover.n[name] else 0.0 for name in PARTS],
        "judged": [cover.n[name] for name in PARTS],
        "tolerance_m": [cover.tolerance_m[name] for name in PARTS],
        "touching_tolerance_m": [cover.touching_tolerance_m[name] for name in PARTS],
    }


def _in_short(errors: PlayerErrors) -> dict[str, Any]:
    cover = errors.cover
    assert cover is not None, "cameras were given"
    parts = {name: errors.parts[name] for name in PARTS}
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


def _situation(i: int, truth: PlayersMotion, hidden: Array) -> Situation:
    legs = _legs(truth)
    return Situation(truth=legs[:, i], others=np.delete(legs, i, axis=1), hidden=hidden[:, i])


def _torso_error_m(run: Run, i: int, tracked: Tracked, truth: PlayersMotion) -> Array | None:
    if run.method == "blocker" or run.torsos == "given":
        return None
    return _torso_errors_m(run.seed, tracked, truth)[:, i]


def _torso_errors_m(seed: int, tracked: Tracked, truth: PlayersMotion) -> Array:
    torsos = tracked.torsos[seed]
    return np.linalg.norm(torsos - truth.points[:, : torsos.shape[1], truth.joints.index("torso")], axis=-1)


def _legs(motion: PlayersMotion) -> Array:
    return motion.points[:, :, [motion.joints.index(name) for name in PARTS]]
