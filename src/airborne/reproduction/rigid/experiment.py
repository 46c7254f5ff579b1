"""`airborne reproduce rigid`: paper B's synthetic experiment, its table and figures, beside better methods."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import Pose, geometry
from airborne.cameras import Camera
from airborne.errors import ResultError
from airborne.export import write_json
from airborne.export.convergence import Rise, write_convergence, write_sequences
from airborne.rendering import model_picture, render
from airborne.reproduction.rigid.curves import Curve, convergence
from airborne.reproduction.rigid.sensitivity import CASES, Case, run_case
from airborne.reproduction.rigid.somersaults import (
    METHODS,
    PAPER_LARGEST,
    PAPER_RMS,
    UNITS,
    VARIABLES,
    Errors,
    Experiment,
    MethodName,
    experiment,
    tracked,
)
from airborne.synthetic.flight.somersault import N_POSES, Target

Array = NDArray[np.floating]
Progress = Callable[[int, int], None]  # poses done, poses in all

_CROP_M, _THUMBNAIL_PX = 2.4, 120  # of a picture of fig. 4
_CURVES: tuple[tuple[str, Target], ...] = (("ellipsoids on ellipsoids", "ellipsoids"), ("ellipsoids on NURBS", "skin"))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """How much is done."""

    persons: tuple[int, ...]
    methods: tuple[MethodName, ...]
    n_poses: int
    n_curve_poses: int
    cases: tuple[Case, ...]
    case_methods: tuple[MethodName, ...]

    @property
    def runs(self) -> list[tuple[Target, int]]:
        """The targets: every person's skin, and the ellipsoids themselves."""
        return [*(("skin", person) for person in self.persons), ("ellipsoids", 0)]

    @property
    def n_steps(self) -> int:
        """Poses to be worked on."""
        table = len(self.runs) * len(self.methods)
        return self.n_poses * (table + len(self.cases) * len(self.case_methods)) + 2 * self.n_curve_poses


_FULL = _Plan(
    persons=(0, 1, 2),
    methods=METHODS,
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
_Runs = dict[tuple[Target, int, MethodName], Errors]


def reproduce_rigid(output: Path, *, quick: bool = False, progress: Progress | None = None) -> dict[str, Any]:
    """Make paper B's synthetic experiment anew; return what summary.json holds.

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
    experiments = {run: experiment(run[0], person=run[1], n_poses=plan.n_poses) for run in plan.runs}
    runs, first = _table(plan, experiments, output, done)
    plain = experiments["skin", plan.persons[0]]
    write_sequences(output / "figure4.png", _figure4(plain, first))
    widths = _curves(plan, output, done)
    cases = _sensitivity(plan, plain, runs, output, done)
    summary = {
        "is_quick": quick,
        "n_poses": plan.n_poses,
        "persons": list(plan.persons),
        "variables": list(VARIABLES),
        "units": list(UNITS),
        "paper": {"rms": list(PAPER_RMS), "largest": list(PAPER_LARGEST)},
        "skin": {method: _over_persons(runs, plan.persons, method) for method in plan.methods},
        "ellipsoids": {method: _plain([runs["ellipsoids", 0, method]]) for method in plan.methods},
        "basin_half_width": widths,
        "sensitivity": cases,
    }
    write_json(output / "summary.json", summary)
    return summary


def describe(summary: Mapping[str, Any]) -> str:
    """Return the table as text: RMS errors, and the largest in brackets."""
    columns = {"paper B": summary["paper"]}
    columns |= {f"{method}, NURBS": found for method, found in summary["skin"].items()}
    columns |= {f"{method}, ellipsoids": found for method, found in summary["ellipsoids"].items()}
    lines = [f"RMS (largest) of {summary['n_poses']} poses, mean over {len(summary['persons'])} NURBS bodies"]
    lines.append(" " * 22 + "".join(f"{f'{name} [{unit}]':>22}" for name, unit in zip(VARIABLES, UNITS, strict=True)))
    for name, found in columns.items():
        cells = [f"{rms:.3g} ({largest:.3g})" for rms, largest in zip(found["rms"], found["largest"], strict=True)]
        lost = f"  {found['n_lost']} lost" if found.get("n_lost") else ""
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
    """Track everything; return the errors, and the poses that the paper's method found on the first skin."""
    runs: _Runs = {}
    first: list[Pose | None] = []
    for target, person in plan.runs:
        for method in plan.methods:
            runs[target, person, method], found = tracked(experiments[target, person], method, progress=done)
            first = first or found
    rows = []
    for (target, person, method), errors in runs.items():
        for k, (name, unit) in enumerate(zip(VARIABLES, UNITS, strict=True)):
            values = (PAPER_RMS[k], errors.rms[k], PAPER_LARGEST[k], errors.largest[k])
            rows.append([target, person, method, name, unit, *map(_number, values), len(errors.values), errors.n_lost])
    header = "target person method variable unit paper_rms rms paper_largest largest n_poses n_lost"
    _write_csv(output / "table.csv", header.split(), rows)
    return runs, first


def _curves(plan: _Plan, output: Path, done: _Counter) -> dict[str, Any]:
    """Write figs 5 and 6; return the basins' half-widths."""
    curves: dict[str, list[Curve]] = {}
    for name, target in _CURVES:
        curves[name] = convergence(experiment(target, n_poses=plan.n_curve_poses), done)
    rows = [
        [name, VARIABLES[curve.variable], UNITS[curve.variable], _number(x), *map(_number, summed)]
        for name, found in curves.items()
        for curve in found
        for x, summed in zip(
            curve.offset,
            np.stack([curve.scores.mean(0), curve.scores.min(0), curve.scores.max(0)], axis=1),
            strict=True,
        )
    ]
    _write_csv(output / "convergence.csv", ["bodies", "variable", "unit", "offset", "score", "least", "largest"], rows)
    write_convergence(
        output / "convergence.png",
        list(zip(VARIABLES, UNITS, strict=True)),
        {
            name: [Rise(one.offset, one.scores, float(np.median(one.half_widths))) for one in found]
            for name, found in curves.items()
        },
    )
    return {
        name: {
            "median": [float(np.median(one.half_widths)) for one in found],
            "least": [float(one.half_widths.min()) for one in found],
        }
        for name, found in curves.items()
    }


def _sensitivity(plan: _Plan, plain: Experiment, runs: _Runs, output: Path, done: _Counter) -> dict[str, Any]:
    """Track with one thing wrong at a time; the first row of each method has nothing wrong."""
    found: dict[str, dict[str, Any]] = {}
    rows = []
    for method in plan.case_methods:
        cases = {"nothing wrong": runs["skin", plan.persons[0], method]}
        cases |= {case.name: run_case(case, plain, method, done) for case in plan.cases}
        found[method] = {name: _plain([errors]) for name, errors in cases.items()}
        rows += [
            [name, method, variable, unit, _number(errors.rms[k]), _number(errors.largest[k]), errors.n_lost]
            for name, errors in cases.items()
            for k, (variable, unit) in enumerate(zip(VARIABLES, UNITS, strict=True))
        ]
    _write_csv(output / "sensitivity.csv", ["case", "method", "variable", "unit", "rms", "largest", "n_lost"], rows)
    return found


def _over_persons(runs: _Runs, persons: Sequence[int], method: MethodName) -> dict[str, Any]:
    each = [runs["skin", person, method] for person in persons]
    return _plain(each) | {"rms_of_each": [errors.rms.tolist() for errors in each]}


def _plain(each: Sequence[Errors]) -> dict[str, Any]:
    """Return the mean RMS over runs, the largest error of all, and how many poses were lost."""
    return {
        "rms": np.mean([errors.rms for errors in each], axis=0).tolist(),
        "largest": np.max([errors.largest for errors in each], axis=0).tolist(),
        "n_lost": sum(errors.n_lost for errors in each),
    }


def _figure4(what: Experiment, found: Sequence[Pose | None]) -> list[tuple[str, list[NDArray[np.uint8]]]]:
    """Cut target and tracked body from the front's and the side's pictures, each about the true root."""
    flat, rows = geometry(what.model), []
    for number, name in enumerate(("front", "side")):
        targets, models = [], []
        for frame, true, pose in zip(what.frames, what.poses, found, strict=True):
            view = frame.views[number]
            assert view is not None
            targets.append(_cut(view.rgb, view.camera, true))
            drawn = np.zeros_like(view.rgb)
            if pose is not None:
                drawn = model_picture(render(flat, what.model.with_pose(pose), view.camera, what.lights))
            models.append(_cut(drawn, view.camera, true))
        rows += [(f"target, {name}", targets), (f"tracked, {name}", models)]
    return rows


def _cut(rgb: NDArray[np.uint8], camera: Camera, pose: Pose) -> NDArray[np.uint8]:
    """Cut a square of `_CROP_M` about a body, and reduce it."""
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
