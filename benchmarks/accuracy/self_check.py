"""What a run says of itself when something is wrong: `python benchmarks/accuracy/self_check.py [--quick]`.

A thrown cross, unseen seeds and the example, tracked as it is and with a wrong body, world, camera or clock. Of each:
what the self-check names, its size beside the truth, and how many errors of the poses lie within the stated intervals.
At the end a reliability diagram over all of them: stated against found coverage. Some 20 minutes; `--quick` two.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import ROOT, append

from airborne.body import BodyModel, Box
from airborne.cameras import Camera, Rig
from airborne.evaluation import read_truth
from airborne.motion import Motion
from airborne.run.opening import open_trial
from airborne.run.self_check import CheckedRun, check_run
from airborne.synthetic.throw.scene import cross_scene
from airborne.synthetic.throw.writing import write_trial
from airborne.tracking.methods import tracker_of
from airborne.tracking.self_check.kept_frames import KeptFrames
from airborne.tracking.tracker import step
from airborne.trial.file import Trial, read_trial

SEEDS = (101, 102, 103)
LEVELS = {0.5: 0.6745, 0.8: 1.2816, 0.95: 1.96}  # share within, in sds


@dataclass(frozen=True)
class Case:
    """One thing that is wrong in the files, and what the self-check should say of it."""

    kind: str = ""
    change: float = 0.0  # of what the file says: share, deg, s

    @property
    def truth(self) -> tuple[str, str, float]:
        """Subject, kind and value, as the self-check has them."""
        return {
            "body": ("body", "scale", 1 / (1 + self.change) - 1),
            "world": ("world", "scale", 1 / (1 + self.change) - 1),
            "turn": ("cam2", "turn_deg", abs(self.change)),
            "focal": ("cam2", "focal", 1 / (1 + self.change) - 1),
            "late": ("cam2", "time_s", -self.change),
        }[self.kind]


CASES = (
    Case(),
    *(Case("body", share) for share in (-0.1, -0.05, 0.05, 0.1)),
    *(Case("world", share) for share in (-0.1, 0.1)),
    Case("turn", 2.0),
    Case("focal", 0.05),
    Case("late", -0.02),
)
QUICK = (CASES[0], CASES[3], CASES[7], CASES[9])


def scaled(model: BodyModel, factor: float) -> BodyModel:
    """Scale a body of boxes about its root."""
    segments = []
    for segment in model.segments:
        parts = []
        for part in segment.parts:
            at = part.segment_from_part
            assert isinstance(part.shape, Box)
            moved = RigidTransform.from_components(factor * at.translation, at.rotation)
            parts.append(
                replace(part, shape=replace(part.shape, size_m=factor * part.shape.size_m), segment_from_part=moved)
            )
        segments.append(replace(segment, parts=tuple(parts)))
    return replace(model, segments=tuple(segments))


def changed(camera: Camera, case: Case) -> Camera:
    """Return a camera that is wrong: the world's scale in every one, a turn or a focal length in the second."""
    R, t = camera.camera_from_world.rotation, camera.camera_from_world.translation
    if case.kind == "world":
        return replace(camera, camera_from_world=RigidTransform.from_components((1 + case.change) * t, R))
    if camera.name == "cam2" and case.kind == "turn":
        turn = Rotation.from_rotvec([0, np.radians(case.change), 0])
        return replace(camera, camera_from_world=RigidTransform.from_components(turn.apply(t), turn * R))
    if camera.name == "cam2" and case.kind == "focal":
        return replace(camera, K=camera.K @ np.diag([1 + case.change, 1 + case.change, 1]))
    return camera


def track(trial: Trial, case: Case) -> CheckedRun:
    """Track a trial with what is wrong, and check the run."""
    if case.kind == "late":
        cameras = [c.model_copy(update={"offset_s": case.change}) if c.name == "cam2" else c for c in trial.camera]
        trial = trial.model_copy(update={"camera": cameras})
    opened, model = open_trial(trial), trial.model()
    model = scaled(model, 1 + case.change) if case.kind == "body" else model
    recording = replace(opened.recording, rig=Rig(tuple(changed(camera, case) for camera in opened.recording.rig)))
    tracker, kept, estimates = tracker_of(trial.settings, model, trial.start.pose), KeptFrames(), []
    state = tracker.init()
    for frames in recording:
        state, estimate = step(tracker, state, frames)
        estimates.append(estimate)
        kept.add(frames)
    return check_run(Motion.collect(estimates), model, recording.rig, kept, is_preset=False)


def errors_in_sds(motion: Motion, truth: Path) -> dict[str, np.ndarray]:
    """Return the errors of the tracked poses over their stated sds: position (n, 3) and rotation (n, 3)."""
    true = read_truth(truth)
    rows = np.flatnonzero(motion.status == "tracked")
    at = np.searchsorted(true.index, motion.index[rows]) if hasattr(true, "index") else motion.index[rows]
    turn = Rotation.from_matrix(motion.R[rows]) * Rotation.from_matrix(true.R[at]).inv()
    return {
        "position": (motion.position[rows] - true.position[at]) / motion.position_sd[rows],
        "rotation": turn.as_rotvec() / motion.rotation_sd[rows],
    }


def rows_of(data: str, case: Case, checked: CheckedRun, errors: dict[str, np.ndarray]) -> Iterator[dict]:
    """Yield what a case shows."""
    assert checked.found is not None
    base = {"data": data, "method": f"{case.kind or 'nothing'} {case.change or ''}".strip()}
    findings = checked.found.diagnosis.findings
    alarms = [finding for finding in findings if finding.is_alarm]
    for finding in alarms:
        print("   ", finding.sentence)
    if not case.kind:
        yield {**base, "metric": "false alarms", "unit": "", "value": len(alarms), "floor": "0"}
    else:
        subject, kind, value = case.truth
        named = [each for each in alarms if (each.subject, each.kind) == (subject, kind)]
        yield {**base, "metric": "named", "unit": "", "value": int(bool(named)), "floor": "1"}
        yield {**base, "metric": "other alarms", "unit": "", "value": len(alarms) - len(named), "floor": "0"}
        if named:
            away = abs(named[0].value - value) / named[0].sd
            yield {**base, "metric": "size, error", "unit": "sd", "value": float(away), "floor": "<= 2"}
    for what, each in errors.items():
        share = 100 * float(np.mean(np.abs(each) < 2)) if each.size else float("nan")
        yield {**base, "metric": f"{what} errors within 2 sd", "unit": "%", "value": share, "n": each.size, "floor": 88}


def reliability(errors: dict[str, list[np.ndarray]]) -> Iterator[dict]:
    """Print the diagram, stated against found coverage; yield it and its mean distance, the ECE."""
    for what, each in errors.items():
        pooled = np.abs(np.concatenate(each))
        found = {level: float(np.mean(pooled < sds)) for level, sds in LEVELS.items()}
        for level, share in found.items():
            print(f"{what:<9} stated {level:4.0%} |{'#' * round(40 * share):<40}| found {share:4.0%}")
            metric = f"{what} errors within {level:.0%}"
            yield {
                "data": "all",
                "method": "all",
                "metric": metric,
                "unit": "%",
                "value": 100 * share,
                "n": pooled.size,
            }
        ece = float(np.mean([abs(level - share) for level, share in found.items()]))
        yield {"data": "all", "method": "all", "metric": f"{what} ECE", "unit": "", "value": ece, "floor": "<= 0.08"}


def main() -> None:
    """Measure, print, and without `--quick` append the rows."""
    is_quick, rows = "--quick" in sys.argv[1:], []
    pooled: dict[str, dict[str, list[np.ndarray]]] = {"right": {}, "wrong": {}}
    with tempfile.TemporaryDirectory() as scratch:
        folders = {"thrown_cross": ROOT / "examples" / "thrown_cross"}
        for seed in SEEDS[: 1 if is_quick else None]:
            folders[f"seed {seed}"] = Path(scratch) / str(seed)
            write_trial(
                cross_scene("side-somersault" if seed % 2 == 0 else "half-twist", seed=seed), folders[f"seed {seed}"]
            )
        for data, folder in folders.items():
            if is_quick and data == "thrown_cross":
                continue
            for case in QUICK if is_quick else CASES:
                print(f"{data}: {case.kind or 'nothing'} wrong {case.change or ''}", flush=True)
                checked = track(read_trial(folder / "trial.toml", {}, None), case)
                errors = errors_in_sds(checked.motion, folder / "truth.csv")
                rows += rows_of(data, case, checked, errors)
                for what, each in errors.items():
                    pooled["wrong" if case.kind else "right"].setdefault(what, []).append(each.ravel())
    for which, each in pooled.items():
        print(f"-- files {which}")
        rows += [{**row, "data": f"files {which}"} for row in reliability(each)]
    if is_quick:
        for row in rows:
            print(*(row.get(key, "") for key in ("data", "method", "metric", "value", "unit", "floor")), sep="  ")
    else:
        append("self_check", rows)


if __name__ == "__main__":
    main()
