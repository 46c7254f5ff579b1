"""How far the joints of a person are off, and whether they say so: `python benchmarks/accuracy/person_reliability.py`.

The two somersaults of `../shared/data` (`--data FOLDER` for another place), tracked as their trials say, frame by frame
and after the fit of the whole run, and the synthetic somersault with a smooth skin, frame by frame. Of each: the mean
joint error, without each joint's constant offset (two definitions of a joint), the largest; joints that are called
tracked and are more than 100 mm off; the reliability diagram, stated against found coverage, and its ECE, also by the
deviations of what changes from frame to frame. Of the fitted somersaults also the flight: centre of mass,
gravity, angular momentum and turns. About 3 minutes. `--quick` tracks 12 frames of the
synthetic one and writes no rows. The trackers see no truth.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

from airborne.io.environment import set_up_libraries

set_up_libraries()  # as the command line does: with other threads, last digits differ

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import ROOT, append

from airborne.body import BodyModel
from airborne.body.chain import move_pose
from airborne.evaluation import JointComparison, compare_joints, read_joint_paths
from airborne.evaluation.joint_files import JointPaths
from airborne.export import headline
from airborne.motion import Motion, flight_summary, measure_flight
from airborne.motion.files import read_motion
from airborne.motion.run_folder import TRACKED_MOTION, read_body_run
from airborne.run.track import track_trial
from airborne.synthetic import scene_frames
from airborne.synthetic.flight.somersault import somersault_scene
from airborne.tracking.both_directions import track_forward_backward
from airborne.tracking.methods import Settings, tracker_of
from airborne.trial.file import read_trial

FLOORS = {"somersault_1": (30, 13, 100), "somersault_2": (34, 18, 120)}  # mm: mean, without offset, largest
START_M, START_RAD = 0.025, np.radians(3.0)  # by which the synthetic start is wrong, in position and in every rotation
N_QUICK = 12
BY_FRAME = "refined, frame by frame"


def measure_recording(data: str, folder: Path) -> Iterator[list[dict]]:
    """Track a recording, then fit the whole run to its images; yield the rows of either, and those of the flight."""
    trial, truth = read_trial(folder / "trial.toml"), read_joint_paths(folder / "truth_joints.csv")
    with tempfile.TemporaryDirectory() as results:
        run = Path(results) / "run"
        track_trial(trial, run, pictures=False)
        fitted, model = read_body_run(run)
        tracked = replace(read_motion(run / TRACKED_MOTION), lasting=fitted.lasting)
        yield rows_of(data, BY_FRAME, compare_joints(tracked, model, truth))
        yield rows_of(data, "refined", compare_joints(fitted, model, truth))
        if (path := folder / "truth_flight.csv").is_file():
            yield flight_rows(data, fitted, model, np.genfromtxt(path, delimiter=",", names=True))


def flight_rows(data: str, motion: Motion, model: BodyModel, truth: np.ndarray) -> list[dict]:
    """Return the rows of a flight whose truth has a row for each frame of the run."""
    table, head = measure_flight(motion, model), headline(motion)
    summary = flight_summary(motion, table)
    com = table["com"].to_numpy() - np.stack([truth[f"com_{axis}_m"] for axis in "xyz"], axis=-1)
    momentum = table["angular_momentum"].to_numpy()
    error = momentum - np.stack([truth[f"L_{axis}_kg_m2_s"] for axis in "xyz"], axis=-1)
    sd = table["angular_momentum_sd"].to_numpy()
    common = {"data": data, "method": "refined", "n": len(motion)}
    rows = [
        ("centre of mass, RMS without its mean", "mm", 1e3 * np.sqrt(np.mean((com - com.mean(axis=0)) ** 2) * 3), 10),
        ("fitted gravity", "m/s2", summary.fitted_gravity_m_s2, 9.81),
        ("its sd", "m/s2", summary.fitted_gravity_sd_m_s2, 0.1),
        ("angular momentum, RMS about the worst axis", "kg m2/s", np.sqrt(np.nanmean(error**2, axis=0)).max(), 2),
        ("its median sd", "kg m2/s", np.nanmedian(sd), 4),
        ("its errors within 2 sd", "", np.mean(np.abs(error)[np.isfinite(sd)] < 2 * sd[np.isfinite(sd)]), "0.85..0.99"),
    ]
    for name, found in (("somersault", summary.somersault_rev), ("twist", summary.twist_rev)):
        true = truth[f"{name}_deg"]
        off, sd = abs(found - (true[-1] - true[0]) / 360), head[f"{name}_rev_sd"]
        rows += [(f"{name}, off by", "turns", off, 0.02), (f"{name}, in sds", "", off / sd, 2)]
    return [{**common, "metric": m, "unit": u, "value": float(v), "floor": f} for m, u, v, f in rows]


def compare_synthetic(n: int | None = None) -> JointComparison:
    """Track the synthetic somersault, or its first n frames, and compare it with its true joints."""
    scene = somersault_scene("moving-arms", target="skin", style="exact")
    frames, model = list(islice(scene_frames(scene), n)), scene.tracking_body
    time_s = np.array([float(scene.time_s(i)) for i in range(len(frames))])
    flight, rng = scene.flight(time_s), np.random.default_rng(7)
    off = np.append(START_M * np.array([1, 1, -1]) / np.sqrt(3), START_RAD * np.sign(rng.normal(size=model.n_dofs - 3)))
    tracker = tracker_of(Settings(), model, move_pose(flight.pose(0), off))
    found = track_forward_backward(tracker, model, frames, write=lambda estimate: None)
    estimates = [estimate for _, estimate in found]
    motion = Motion.collect(estimates, tuple(segment.name for segment in model.segments[1:]))
    points = np.array([model.with_pose(flight.pose(i)).landmarks for i in range(len(frames))])
    truth = JointPaths(names=tuple(each.name for each in model.landmarks), time_s=time_s, points=points)
    return compare_joints(motion, model, truth)


def rows_of(data: str, method: str, found: JointComparison) -> list[dict]:
    """Return the rows of one recording and way."""
    floors = dict(zip(("mean", "without", "largest"), FLOORS.get(data, ("", "", "")), strict=True))
    common = {"data": data, "method": method, "n": found.whole.n}
    whole, held, by_frame = found.whole, found.coverage, found.coverage_by_frame
    return [
        {**common, "metric": "mean joint error", "unit": "mm", "value": whole.mean_mm, "floor": floors["mean"]},
        {**common, "metric": "the same without constant offsets", "unit": "mm",
         "value": whole.mean_without_offset_mm, "floor": floors["without"]},
        {**common, "metric": "largest joint error", "unit": "mm", "value": whole.largest_mm,
         "floor": floors["largest"]},
        {**common, "metric": "joints tracked", "unit": "", "value": found.share_tracked},
        {**common, "metric": "of them more than 100 mm off", "unit": "", "value": found.n_far, "floor": "0"},
        {**common, "metric": "held by the 50 % interval", "unit": "", "value": held.within_50},
        {**common, "metric": "held by the 80 % interval", "unit": "", "value": held.within_80},
        {**common, "metric": "held by the 95 % interval", "unit": "", "value": held.within_95,
         "floor": "0.88..0.99"},
        {**common, "metric": "ECE of the errors with constant offsets", "unit": "",
         "value": found.coverage_with_offset.ece, "floor": 0.08},
        {**common, "metric": "ECE", "unit": "", "value": held.ece, "floor": 0.08},
        {**common, "metric": "held by the 95 % interval of single frames", "unit": "", "value": by_frame.within_95,
         "floor": "0.88..0.99"},
        {**common, "metric": "ECE by single frames' deviations", "unit": "", "value": by_frame.ece, "floor": 0.08},
    ]  # fmt: skip


def main() -> None:
    """Measure, print, and without `--quick` append the rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="12 frames of the synthetic somersault, no rows")
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data", help="where the recordings are")
    options = parser.parse_args()
    if options.quick:
        for row in rows_of("synthetic somersault", BY_FRAME, compare_synthetic(N_QUICK)):
            print(f"{row['metric']:<40}{row['value']:>10.3g} {row['unit']}")
        return
    append("person_reliability", rows_of("synthetic somersault", BY_FRAME, compare_synthetic()))
    for name in FLOORS:
        if not (options.data / name).is_dir():
            print(f"{options.data / name} is not there: {name} is left out")
            continue
        for rows in measure_recording(name, options.data / name):
            append("person_reliability", rows)


if __name__ == "__main__":
    main()
