"""All sequences pooled: the paper's success, strict errors, over seeds; which sequences fail and why."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from airborne.evaluation.jump_errors import EVENTS, HEIGHTS
from airborne.reproduction.block.causes import CAUSES, OFF_M
from airborne.reproduction.block.plan import BLOCK_METHODS, FAILS_BELOW, PAPER_PARTS, PAPER_SUCCESS, Plan
from airborne.types import Array

Record = Mapping[str, Any]  # of one run and player, see `measures.read_take`
Summary = Mapping[str, Any]  # what summary.json holds
_WITH_JUMPS = ("blocker", "block-jump")


def summarise(plan: Plan, takes: Sequence[Mapping[str, Any]], *, is_quick: bool) -> dict[str, Any]:
    """Reduce the finished sequences, in any order, to what summary.json holds."""
    records = sorted(
        (record for take in takes for record in take["records"]),
        key=lambda r: (r["sequence"], r["row"], r["n_particles"], r["seed"], r["player"]),
    )
    table = [r for r in records if r["n_particles"] in (0, plan.n_particles)]
    rows = {name: [r for r in table if r["row"] == name] for name in _row_names(table)}
    players = {(r["sequence"], r["player"]): r for r in table}.values()
    return {
        "is_quick": is_quick,
        "sequences": sorted({r["sequence"] for r in table}),
        "n_frames": sum({r["sequence"]: r["n_frames"] for r in table}.values()),
        "n_player_frames": sum(r["n_frames"] for r in players),
        "n_several": len({r["sequence"] for r in table if r["n_blockers"] > 1}),
        "n_seeds": plan.n_seeds,
        "n_particles": plan.n_particles,
        "parts": list(PAPER_PARTS),
        "paper": {name: list(values) for name, values in PAPER_SUCCESS.items()},
        "tolerance_m": np.mean([r["tolerance_m"] for r in table], axis=0),
        "touching_tolerance_m": np.mean([r["touching_tolerance_m"] for r in table], axis=0),
        "rows": {name: _row(each) for name, each in rows.items()},
        "failed": {name: _failures(each) for name, each in rows.items()},
        "jumps": {name: _jumps(rows[name]) for name in _WITH_JUMPS},
        "sweep": _sweep(plan, records),
        "torso": _torso([take["torso"] for take in takes]),
    }


def success(records: Iterable[Record], key: str = "covered") -> Array:
    """Return the share of judged frames in which each part is covered, or "touched", pooled over the records: (6,)."""
    records = list(records)
    covered = np.sum([r[key] for r in records], axis=0)
    return covered / np.maximum(np.sum([r["judged"] for r in records], axis=0), 1)


def by_sequence(records: Iterable[Record]) -> dict[int, list[Record]]:
    """Group records by their sequence."""
    groups: dict[int, list[Record]] = {}
    for record in records:
        groups.setdefault(record["sequence"], []).append(record)
    return groups


def _row_names(records: Sequence[Record]) -> list[str]:
    names = {r["row"] for r in records}
    return [name for name in BLOCK_METHODS if name in names] + sorted(names - set(BLOCK_METHODS))


def _row(records: Sequence[Record]) -> dict[str, Any]:
    error = np.concatenate([r["error_mm"] for r in records])
    finite_or_lost = np.where(np.isnan(error), np.inf, error)
    median = np.median(finite_or_lost, axis=0)
    return {
        "success": _over_seeds(records, success),
        "touching": _over_seeds(records, lambda each: success(each, "touched")),
        "success_one_blocker": _over_seeds([r for r in records if r["n_blockers"] == 1], success),
        "success_several": _over_seeds([r for r in records if r["n_blockers"] > 1], success),
        "mean_mm": _over_seeds(records, _mean_mm),
        "median_mm": np.where(np.isfinite(median), median, np.nan),
        "within_100mm": np.mean(finite_or_lost <= 1e3 * OFF_M, axis=0),
        "within_50mm": np.mean(finite_or_lost <= 50, axis=0),
        "within_95": _mean_by_frames(records, "within_95"),
        "swaps_knees": _mean_by_frames(records, "swaps"),
        "swaps_feet": _mean_by_frames(records, "swaps_feet"),
        "limbs_correct": _mean_by_frames(records, "pcp"),
        "lost": _share(records, "n_lost"),
        "uncertain": _share(records, "n_uncertain"),
        "ms_per_frame": _mean_by_frames(records, "ms_per_frame"),
    }


def _over_seeds(records: Sequence[Record], measure: Callable[[list[Record]], Array]) -> dict[str, Any] | None:
    """Return mean and standard deviation over seeds of a measure; None without records."""
    if not records:
        return None
    values = [measure([r for r in records if r["seed"] == seed]) for seed in sorted({r["seed"] for r in records})]
    sd = np.std(values, axis=0, ddof=1) if len(values) > 1 else np.full(len(PAPER_PARTS), np.nan)
    return {"mean": np.mean(values, axis=0), "sd": sd}


def _mean_mm(records: Iterable[Record]) -> Array:
    error = np.concatenate([r["error_mm"] for r in records])
    has_any = np.isfinite(error).any(axis=0)
    return np.nanmean(np.where(has_any, error, 0.0), axis=0) + np.where(has_any, 0.0, np.nan)


def _mean_by_frames(records: Sequence[Record], key: str) -> Array:
    """Return the mean over records, weighted by their frames; NaN is left out."""
    values = np.array([r[key] for r in records], float)
    weights = np.array([r["n_frames"] for r in records], float).reshape(-1, *[1] * (values.ndim - 1))
    weights = np.where(np.isnan(values), 0.0, weights)
    total = weights.sum(axis=0)
    summed = np.nansum(values * weights, axis=0) / np.maximum(total, 1)
    return np.where(total > 0, summed, np.nan)


def _share(records: Sequence[Record], key: str) -> float:
    return sum(r[key] for r in records) / max(sum(r["n_frames"] for r in records), 1)


def _failures(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Return the sequences in which a part's mean success is too low, worst first, with the causes."""
    failures = []
    for number, each in by_sequence(records).items():
        rate = success(each)
        if rate.min() >= FAILS_BELOW:
            continue
        counts = np.sum([r["causes"] for r in each], axis=0)
        order = np.argsort(-counts, kind="stable")[:3]
        share = counts / max(counts.sum(), 1)
        off = [float(np.mean(~(r["error_mm"] <= 1e3 * OFF_M))) for r in each]
        worst = each[int(np.argmax(off))]
        failures.append(
            {
                "sequence": number,
                "n_blockers": each[0]["n_blockers"],
                "success": rate,
                "worst_part": PAPER_PARTS[int(rate.argmin())],
                "worst_success": float(rate.min()),
                "causes": {CAUSES[k]: float(share[k]) for k in order if counts[k]},
                "worst_run": {"player": worst["player"], "seed": worst["seed"], "off": max(off)},
                "first_frame_off": _first_off(each),
            }
        )
    return sorted(failures, key=lambda each: each["worst_success"])


def _first_off(records: Sequence[Record]) -> int | None:
    """Return the frame in which the median run first has a part off; None where most have none."""
    first = []
    for r in records:
        off = np.flatnonzero((~(r["error_mm"] <= 1e3 * OFF_M)).any(axis=1))
        first.append(off[0] if len(off) else np.inf)
    middle = float(np.quantile(first, 0.5, method="lower"))
    return int(middle) if np.isfinite(middle) else None


def _jumps(records: Sequence[Record]) -> dict[str, Any]:
    """Return the mean absolute error of heights [m] and events [frames] against the scenes' own facts, and the bias."""
    jumps = [jump for r in records for jump in r["jumps"]]
    errors: dict[str, Any] = {"n": len(jumps), "n_found": sum(jump["is_found"] for jump in jumps)}
    for name in (*HEIGHTS, *EVENTS):
        error = np.array([jump.get(name) for jump in jumps], float)
        error = error[np.isfinite(error)]
        covered = [jump["within_95"][name] for jump in jumps if name in jump["within_95"]]
        some = bool(len(error))
        errors[name] = {
            "n": len(error),
            "mean_absolute": float(np.abs(error).mean()) if some else np.nan,
            "mean": float(error.mean()) if some else np.nan,
            "largest": float(np.abs(error).max()) if some else np.nan,
            "within_95": float(np.mean(covered)) if covered else np.nan,
        }
    return errors


def _sweep(plan: Plan, records: Sequence[Record]) -> list[dict[str, Any]]:
    rows = []
    for count in plan.sweep:
        each = [
            r
            for r in records
            if r["row"] == "block-jump"
            and r["n_particles"] == count
            and r["sequence"] in plan.sweep_numbers
            and r["seed"] < plan.n_sweep_seeds
        ]
        rows.append(
            {
                "n_particles": count,
                "success": _over_seeds(each, success),
                "mean_mm": _over_seeds(each, _mean_mm),
                "ms_per_frame": _mean_by_frames(each, "ms_per_frame"),
            }
        )
    return rows


def _torso(torsos: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    weights = [torso["n"] for torso in torsos]
    return {
        key: float(np.average([torso[key] for torso in torsos], weights=weights))
        for key in ("mean_mm", "median_mm", "off", "ms_per_frame")
    }
