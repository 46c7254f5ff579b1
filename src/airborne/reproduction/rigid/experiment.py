"""`airborne reproduce rigid`: paper B's synthetic experiment, its table and figures, beside better methods."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import Pose, surface_arrays
from airborne.cameras import Camera
from airborne.errors import ResultError
from airborne.export import write_json
from airborne.export.convergence import ScoreCurve, write_convergence, write_sequences
from airborne.rendering import model_picture, render
from airborne.reproduction.rigid.curves import Curve, score_curves
from airborne.reproduction.rigid.sensitivity import CASES, Case, run_case
from airborne.reproduction.rigid.somersaults import (
    PAPER_LARGEST,
    PAPER_RMS,
    RIGID_METHODS,
    VARIABLE_UNITS,
    VARIABLES,
    Experiment,
    RigidMethod,
    RunErrors,
    make_experiment,
    track_experiment,
)
from airborne.synthetic.flight.skill import N_POSES
from airborne.synthetic.flight.somersault import Target
from airborne.types import Progress

_CROP_M, _THUMBNAIL_PX = 2.4, 120  # of an image of fig. 4
_CURVES: tuple[tuple[str, Target], ...] = (("ellipsoids on ellipsoids", "ellipsoids"), ("ellipsoids on NURBS", "skin"))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """The extent of the reproduction."""

    persons: tuple[int, ...]
    methods: tuple[RigidMethod, ...]
    n_poses: int
    n_curve_poses: int
    cases: tuple[Case, ...]
    case_methods: tuple[RigidMethod, ...]

    @property
    def runs(self) -> list[tuple[Target, int]]:
        """The targets: every person's skin, and the ellipsoids themselves."""
        return [*(("skin", person) for person in self.persons), ("ellipsoids", 0)]

    @property
    def n_steps(self) -> int:
        """Number of poses to be tracked or scored."""
        table = len(self.runs) * len(self.methods)
        return self.n_poses * (table + len(self.cases) * len(self.case_methods)) + 2 * self.n_curve_poses


_FULL = _Plan(
    persons=(0, 1, 2),
    methods=RIGID_METHODS,
    n_poses=N_POSES,
    n_curve_poses=N_POSES,
    cases=CASES,
    case_methods=("faithful", "refined"),
)
_QUICK = _Plan(
    persons=(0,),
    methods=("faithful", "refined"),
    n_poses=4,
    n_curve_poses=2,
    cases=CASES[1:2],
    case_methods=("faithful",),
)
_Runs = dict[tuple[Target, int, RigidMethod], RunErrors]


def reproduce_rigid(output: Path, *, quick: bool = False, progress: Progress | None = None) -> dict[str, Any]:
    """Reproduce paper B's synthetic experiment; return experiment summary.json holds.

    Into `output`, each file as soon as it is finished: table.csv, figure4.png, convergence.csv, convergence.png,
    sensitivity.csv, summary.json. Quick: fewer poses, methods and cases. Raises ResultError where the folder holds
    anything. Source: paper B, table 1, figs 4 to 6.
    """
    if output.exists() and not output.is_dir():
        raise ResultError(f"{output} is a file; give a folder for the results")
    if output.is_dir() and any(output.iterdir()):
        raise ResultError(f"{output} is not empty; give a new or empty folder")
    output.mkdir(parents=True, exist_ok=True)
    plan = _QUICK if quick else _FULL
    done = _Counter(plan.n_steps, progress)
    experiments = {run: make_experiment(run[0], person=run[1], n_poses=plan.n_poses) for run in plan.runs}
    runs, first = _table(plan, experiments, output, done)
    unperturbed = experiments["skin", plan.persons[0]]
    write_sequences(output / "figure4.png", _figure4(unperturbed, first))
    widths = _curves(plan, output, done)
    cases = _sensitivity(plan, unperturbed, runs=runs, output=output, done=done)
    summary = {
        "is_quick": quick,
        "n_poses": plan.n_poses,
        "persons": list(plan.persons),
        "variables": list(VARIABLES),
        "units": list(VARIABLE_UNITS),
        "paper": {"rms": list(PAPER_RMS), "largest": list(PAPER_LARGEST)},
        "skin": {method: _over_persons(runs, plan.persons, method) for method in plan.methods},
        "ellipsoids": {method: _statistics([runs["ellipsoids", 0, method]]) for method in plan.methods},
        "basin_half_width": widths,
        "sensitivity": cases,
    }
    write_json(output / "summary.json", summary)
    return summary


def describe_rigid(summary: Mapping[str, Any]) -> str:
    """Return the table as text: RMS errors, and the largest in brackets."""
    columns = {"paper B": summary["paper"]}
    columns |= {f"{method}, NURBS": row for method, row in summary["skin"].items()}
    columns |= {f"{method}, ellipsoids": row for method, row in summary["ellipsoids"].items()}
    lines = [f"RMS (largest) of {summary['n_poses']} poses, mean over {len(summary['persons'])} NURBS bodies"]
    lines.append(
        " " * 22 + "".join(f"{f'{name} [{unit}]':>22}" for name, unit in zip(VARIABLES, VARIABLE_UNITS, strict=True))
    )
    for name, row in columns.items():
        cells = [f"{rms:.3g} ({largest:.3g})" for rms, largest in zip(row["rms"], row["largest"], strict=True)]
        lost = f"  {row['n_lost']} lost" if row.get("n_lost") else ""
        lines.append(f"{name:<22}" + "".join(f"{cell:>22}" for cell in cells) + lost)
    return "\n".join(lines)


class _Counter:
    """Counts poses."""

    def __init__(self, total: int, progress: Progress | None) -> None:
        self._done, self._total, self._progress = 0, total, progress

    def __call__(self) -> None:
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, self._total)


def _table(
    plan: _Plan, experiments: Mapping[tuple[Target, int], Experiment], output: Path, done: _Counter
) -> tuple[_Runs, list[Pose | None]]:
    """Track everything; return the errors, and the paper's method's poses on the first skin."""
    runs: _Runs = {}
    first: list[Pose | None] = []
    for target, person in plan.runs:
        for method in plan.methods:
            runs[target, person, method], poses = track_experiment(experiments[target, person], method, progress=done)
            first = first or poses
    rows = []
    for (target, person, method), errors in runs.items():
        for k, (name, unit) in enumerate(zip(VARIABLES, VARIABLE_UNITS, strict=True)):
            values = (PAPER_RMS[k], errors.rms[k], PAPER_LARGEST[k], errors.largest[k])
            rows.append([target, person, method, name, unit, *map(_number, values), len(errors.values), errors.n_lost])
    header = "target person method variable unit paper_rms rms paper_largest largest n_poses n_lost"
    _write_csv(output / "table.csv", header.split(), rows)
    return runs, first


def _curves(plan: _Plan, output: Path, done: _Counter) -> dict[str, Any]:
    """Write figs 5 and 6; return the basins' half-widths."""
    curves: dict[str, list[Curve]] = {}
    for name, target in _CURVES:
        curves[name] = score_curves(make_experiment(target, n_poses=plan.n_curve_poses), done)
    rows = [
        [name, VARIABLES[curve.variable], VARIABLE_UNITS[curve.variable], _number(x), *map(_number, summed)]
        for name, group in curves.items()
        for curve in group
        for x, summed in zip(
            curve.offset,
            np.stack([curve.scores.mean(0), curve.scores.min(0), curve.scores.max(0)], axis=1),
            strict=True,
        )
    ]
    _write_csv(output / "convergence.csv", ["bodies", "variable", "unit", "offset", "score", "least", "largest"], rows)
    write_convergence(
        output / "convergence.png",
        list(zip(VARIABLES, VARIABLE_UNITS, strict=True)),
        {
            name: [ScoreCurve(curve.offset, curve.scores, float(np.median(curve.half_widths))) for curve in group]
            for name, group in curves.items()
        },
    )
    return {
        name: {
            "median": [float(np.median(curve.half_widths)) for curve in group],
            "least": [float(curve.half_widths.min()) for curve in group],
        }
        for name, group in curves.items()
    }


def _sensitivity(plan: _Plan, unperturbed: Experiment, *, runs: _Runs, output: Path, done: _Counter) -> dict[str, Any]:
    """Track with one perturbation at a time; the first row of each method has none."""
    statistics: dict[str, dict[str, Any]] = {}
    rows = []
    for method in plan.case_methods:
        cases = {"nothing wrong": runs["skin", plan.persons[0], method]}
        cases |= {case.name: run_case(case, unperturbed, method, done) for case in plan.cases}
        statistics[method] = {name: _statistics([errors]) for name, errors in cases.items()}
        rows += [
            [name, method, variable, unit, _number(errors.rms[k]), _number(errors.largest[k]), errors.n_lost]
            for name, errors in cases.items()
            for k, (variable, unit) in enumerate(zip(VARIABLES, VARIABLE_UNITS, strict=True))
        ]
    _write_csv(output / "sensitivity.csv", ["case", "method", "variable", "unit", "rms", "largest", "n_lost"], rows)
    return statistics


def _over_persons(runs: _Runs, persons: Sequence[int], method: RigidMethod) -> dict[str, Any]:
    each = [runs["skin", person, method] for person in persons]
    return _statistics(each) | {"rms_of_each": [errors.rms.tolist() for errors in each]}


def _statistics(each: Sequence[RunErrors]) -> dict[str, Any]:
    """Return the mean RMS over runs, the largest error of all, and how many poses were lost."""
    return {
        "rms": np.mean([errors.rms for errors in each], axis=0).tolist(),
        "largest": np.max([errors.largest for errors in each], axis=0).tolist(),
        "n_lost": sum(errors.n_lost for errors in each),
    }


def _figure4(experiment: Experiment, estimates: Sequence[Pose | None]) -> list[tuple[str, list[NDArray[np.uint8]]]]:
    """Crop target and tracked body from the front's and the side's images, each around the true root."""
    flat, rows = surface_arrays(experiment.model), []
    for number, name in enumerate(("front", "side")):
        targets, models = [], []
        for frame, true, pose in zip(experiment.frames, experiment.poses, estimates, strict=True):
            view = frame.views[number]
            assert view is not None
            targets.append(_crop(view.rgb, view.camera, true))
            rendered = np.zeros_like(view.rgb)
            if pose is not None:
                rendered = model_picture(render(flat, experiment.model.with_pose(pose), view.camera, experiment.lights))
            models.append(_crop(rendered, view.camera, true))
        rows += [(f"target, {name}", targets), (f"tracked, {name}", models)]
    return rows


def _crop(rgb: NDArray[np.uint8], camera: Camera, pose: Pose) -> NDArray[np.uint8]:
    """Crop a square of `_CROP_M` around a body, and reduce it."""
    root = pose.world_from_root.translation
    depth = float(camera.camera_from_world.apply(root)[2])
    half = round(_CROP_M / 2 * camera.K[0, 0] / depth)
    u, v = np.rint(camera.px_from_world(root)).astype(int)
    padded = np.pad(rgb, ((half, half), (half, half), (0, 0)))
    square = padded[v : v + 2 * half, u : u + 2 * half]
    return np.asarray(cv2.resize(square, (_THUMBNAIL_PX, _THUMBNAIL_PX), interpolation=cv2.INTER_AREA), np.uint8)


def _number(value: float) -> str:
    """Write a number to five digits; nothing where it is unknown."""
    return f"{value:.5g}" if np.isfinite(value) else ""


def _write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)
