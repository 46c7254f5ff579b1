"""What can be gained for joints: `python benchmarks/accuracy/smoothing_bound.py [SOMERSAULT ...]`.

Two synthetic somersaults, on which this was developed, and recorded ones whose folders are given are tracked frame by
frame, about 3 minutes of CPU each. Their errors are split into what lasts, what changes slowly and what smoothing of
the tracked joints can see. A way to smooth is measured that the package does not have: a second pass from the run's
end, joined with the first by their covariances. What the images gain is measured in `smoothing.py`.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.fft import dct, idct

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append
from smoothing import true_joints

from airborne.body import BodyModel
from airborne.run.body import BodyRun
from airborne.run.opening import open_trial
from airborne.synthetic import write_somersault
from airborne.synthetic.flight.somersault import SomersaultPreset
from airborne.tracking import Estimate
from airborne.tracking.both_directions import turn_time
from airborne.tracking.methods import tracker_of
from airborne.tracking.passes import Passes, differences, join_passes
from airborne.trial.file import read_trial
from airborne.types import Array
from airborne.video.rereading import Rereading

_SYNTHETIC: dict[SomersaultPreset, int] = {"moving-arms": 91, "pike": 92}  # and their seeds
_SLOW_FRAMES = 10  # errors of longer periods keep their sign for over five frames


def measure(name: str, folder: Path) -> list[dict]:
    """Return the rows of one recording."""
    trial = read_trial(folder / "trial.toml")
    run = BodyRun.open(trial, open_trial(trial))
    reader, stop = Rereading(run.recording), run.recording.stop
    run = run.see(next(reader.forward(run.recording.start, stop)))
    model = run.model
    tracker = tracker_of(trial.settings, model, run.start)
    state, found = tracker.init(), dict[int, Estimate]()
    for frames in reader.forward(run.recording.start, stop):
        estimate = tracker.search(state, frames)
        if estimate.pose is not None and state.past:
            found[frames.index] = estimate
        state = tracker.learn(state, frames, estimate)
    state, passes, last = tracker.turn(state, {}), list[Passes](), max(found)  # which looks at every frame anew
    for frames in reader.backward(run.recording.start, last):
        turned = turn_time(frames)
        back = tracker.search(state, turned)
        if frames.index in found:
            pair = differences(model, found[frames.index], back)
            nats = tracker.weigh(state, turned, pair.candidates) if pair.candidates else None
            passes.append(Passes(found[frames.index], replace(back, time_s=frames.time_s), pair, nats))
        state = tracker.learn(state, turned, back)
    joined = [*join_passes(model, passes[::-1]), found[last]]
    return _rows(name, folder, model, list(found.values()), joined)


def _rows(
    name: str, folder: Path, model: BodyModel, found: Sequence[Estimate], joined: Sequence[Estimate]
) -> list[dict]:
    time_s, names = np.array([float(each.time_s) for each in found]), [landmark.name for landmark in model.landmarks]
    truth = true_joints(folder, time_s, names)
    errors, both = (_places(model, estimates) - truth for estimates in (found, joined))
    common = {"data": name, "method": "bound", "n": len(found)}
    rows = [{**common, "metric": "joints, mean, tracked", "unit": "mm", "value": 1e3 * _mean(errors)}]
    rows += [
        {**common, "metric": f"share of squared error, {kind}", "unit": "%", "value": 100 * share}
        for kind, share in _split(errors).items()
    ]
    for way, after in {"without all that is not slow": _slow(errors), "two passes": both}.items():
        change = 100 * (_mean(after) / _mean(errors) - 1)
        rows.append({**common, "metric": f"joints, {way}, against", "unit": "%", "value": change})
    return rows


def _places(model: BodyModel, estimates: Sequence[Estimate]) -> Array:
    return np.array([model.with_pose(each.pose).landmarks for each in estimates if each.pose is not None])


def _mean(errors: Array) -> float:
    return float(np.nanmean(np.linalg.norm(errors, axis=-1)))


def _slow(errors: Array) -> Array:
    """Return the errors' periods over ten frames: (n, joints, 3)."""
    spectrum = _spectrum(errors)
    spectrum[int(np.ceil(2 * len(errors) / _SLOW_FRAMES)) :] = 0
    return np.asarray(idct(spectrum, axis=0, norm="ortho"))


def _spectrum(errors: Array) -> Array:
    """Return the cosine transform over time (n, joints, 3), of the same squares."""
    return np.array(dct(np.nan_to_num(errors), axis=0, norm="ortho"))


def _split(errors: Array) -> dict[str, float]:
    """Return the shares of the squared errors that are constant for each joint, slow, fast, and of this white."""
    squares = _spectrum(errors) ** 2
    fast = float(np.nansum((errors - _slow(errors)) ** 2))
    white = float(squares[len(squares) // 2 :].mean()) * squares.size  # as the upper half of the frequencies has it
    parts = {"constant": float(squares[0].sum()), "slow": float(squares[1:].sum()) - fast, "fast": fast, "white": white}
    return {kind: each / float(squares.sum()) for kind, each in parts.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("recordings", type=Path, nargs="*", help="folders with trial.toml and truth")
    parser.add_argument("--recorded-only", action="store_true", help="leave the synthetic ones out")
    asked = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as made:
        folders = {folder.name: folder for folder in asked.recordings}
        for preset, seed in () if asked.recorded_only else _SYNTHETIC.items():
            folder = folders[f"{preset}, seed {seed}"] = Path(made) / f"{preset}_{seed}"
            write_somersault(folder, preset=preset, style="gym", seed=seed)
        for name, folder in folders.items():
            rows += measure(name, folder)
    append("smoothing", rows)


if __name__ == "__main__":
    main()
