"""What can be gained for joints: `python benchmarks/accuracy/smoothing_bound.py [SOMERSAULT ...]`.

Two synthetic somersaults, on which this was developed, and recorded ones whose folders are given are tracked frame by
frame, about 3 minutes of CPU each. Their errors are split into what lasts, what changes slowly and what smoothing can
see. Two ways to smooth are measured that the package does not have: the whole run fitted to the evidence of its images
alone, without the tracker's predictions, by a random walk of the velocities; and a second pass from the run's end,
joined with the first by their covariances.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np
from scipy.fft import dct, idct
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append
from smoothing import true_joints

from airborne.body import BodyModel, Pose
from airborne.body.chain import delta_between, move_pose
from airborne.constants import FREE_FALL_M_S2
from airborne.motion.flight.momentum import centre_of_mass
from airborne.run.body import BodyRun
from airborne.run.opening import open_trial
from airborne.synthetic import write_somersault
from airborne.synthetic.flight.somersault import SomersaultPreset
from airborne.tracking import Estimate
from airborne.tracking.both_directions import turn_time
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.methods import tracker_of
from airborne.tracking.model_based.degrees_of_freedom import all_joints
from airborne.tracking.model_based.gauss_newton import linearise_images
from airborne.tracking.model_based.later_frames import MARGIN_PX
from airborne.tracking.model_based.learning import learn_missing_backgrounds
from airborne.tracking.model_based.refined import RefinedState, RefinedTracker
from airborne.tracking.passes import Passes, differences, join_passes
from airborne.tracking.time_offsets import compensate_offsets
from airborne.trial.file import read_trial
from airborne.types import Array
from airborne.video import Frames
from airborne.video.rereading import Rereading

_SYNTHETIC: dict[SomersaultPreset, int] = {"moving-arms": 91, "pike": 92}  # and their seeds
_SLOW_FRAMES = 10  # errors of longer periods keep their sign for over five frames
_ROUNDS = 4  # of the accelerations' variances
_FIRST_SD = 30.0  # of the accelerations [m/s2, rad/s2]
_FALL_SD_M_S2 = 0.3  # of the centre of mass's acceleration in flight, beside gravity
_DAMPING = 1e-4  # [1/m2, 1/rad2] holds what neither images nor neighbours show
_STEP = 1e-4  # [m, rad] of the difference quotient


@dataclass(frozen=True, slots=True, eq=False)
class _Moment:
    """One tracked frame, and what its images alone say of a change of its pose: -x information x / 2 + gradient x."""

    estimate: Estimate
    pose: Pose
    information: Array  # (d, d)
    gradient: Array  # (d,)


def measure(name: str, folder: Path) -> list[dict]:
    """Return the rows of one recording."""
    trial = read_trial(folder / "trial.toml")
    run = BodyRun.open(trial, open_trial(trial))
    reader, stop = Rereading(run.recording), run.recording.stop
    run = run.see(next(reader.forward(run.recording.start, stop)))
    model = run.model
    tracker = tracker_of(trial.settings, model, run.start)
    refined, state, moments = cast(RefinedTracker, tracker._tracker), tracker.init(), list[_Moment]()
    for frames in reader.forward(run.recording.start, stop):
        estimate = tracker.search(state, frames)
        if estimate.pose is not None and state.past:
            moments.append(_look(refined, state.inner, compensate_offsets(frames, state.past), estimate))
        state = tracker.learn(state, frames, estimate)
    state, passes = tracker.turn(state), list[Passes]()
    by_index = {moment.estimate.index: moment.estimate for moment in moments}
    for frames in reader.backward(run.recording.start, moments[-1].estimate.index):
        turned = turn_time(frames)
        back = tracker.search(state, turned)
        if frames.index in by_index:
            pair = differences(model, by_index[frames.index], back)
            nats = tracker.weigh(state, turned, pair.candidates) if pair.candidates else None
            passes.append(Passes(by_index[frames.index], replace(back, time_s=frames.time_s), pair, nats))
        state = tracker.learn(state, turned, back)
    joined = [each.pose for each in join_passes(model, passes[::-1]) if each.pose is not None]
    return _rows(name, folder, model, moments, [*joined, moments[-1].pose])


def _look(tracker: RefinedTracker, state: RefinedState, frames: Frames, estimate: Estimate) -> _Moment:
    """Linearise a frame's images at its estimate; the joints' range is known to every frame alike."""
    assert estimate.pose is not None
    render_model, dofs, pose = tracker.render_model, all_joints(tracker.render_model.model), estimate.pose
    posed = render_model.with_pose(pose)
    regions = crop_regions([posed], render_model.geometry, tracker.reduce_frames(frames), MARGIN_PX)
    regions = [region for region in regions if state.appearance.has_colours(region)]
    appearance = learn_missing_backgrounds(render_model, posed, regions, state.appearance)
    images = linearise_images(render_model, pose, regions, appearance, dofs=dofs)
    rows, values = dofs.rest_residuals(pose)
    information, gradient = images.A / images.misfit + rows.T @ rows, images.g / images.misfit - rows.T @ values
    return _Moment(estimate, pose, information, gradient)


def _rows(name: str, folder: Path, model: BodyModel, moments: Sequence[_Moment], joined: Sequence[Pose]) -> list[dict]:
    names = [landmark.name for landmark in model.landmarks]
    time_s = np.array([float(moment.estimate.time_s) for moment in moments])
    poses = [moment.pose for moment in moments]
    truth = true_joints(folder, time_s, names)
    errors = _places(model, poses) - truth
    whole, falling = (_fit_run(model, moments, time_s, falls=falls) for falls in (False, True))
    common = {"data": name, "method": "bound", "n": len(moments)}
    rows = [{**common, "metric": "joints, mean, tracked", "unit": "mm", "value": 1e3 * _mean(errors)}]
    rows += [
        {**common, "metric": f"share of squared error, {kind}", "unit": "%", "value": 100 * share}
        for kind, share in _split(errors).items()
    ]
    ways = {"without all that is not slow": None, "evidence alone": whole, "evidence, in free fall": falling}
    for way, fitted in (*ways.items(), ("two passes", list(joined))):
        after = _slow(errors) if fitted is None else _places(model, fitted) - truth
        change = 100 * (_mean(after) / _mean(errors) - 1)
        rows.append({**common, "metric": f"joints, {way}, against", "unit": "%", "value": change})
    return rows


def _places(model: BodyModel, poses: Sequence[Pose]) -> Array:
    return np.array([model.with_pose(pose).landmarks for pose in poses])


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


def _fit_run(model: BodyModel, moments: Sequence[_Moment], time_s: Array, *, falls: bool) -> list[Pose]:
    """Return the poses of a whole run at the most of its evidence.

    The second derivatives of all degrees of freedom are white, with a variance for each joint that the run shows, by
    expectation and maximisation. `falls`: that of the centre of mass is gravity.
    """
    poses, n, d = [moment.pose for moment in moments], len(moments), model.n_dofs
    C, c = _accelerations(poses, time_s, d)
    F, f = _fall_equations(model, poses, time_s) if falls else (np.zeros((0, n * d)), np.zeros(0))
    group = np.concatenate([np.repeat([0, 1], 3), 2 + np.arange(d - 6) // 3])
    H, g = F.T @ F / _FALL_SD_M_S2**2 + _DAMPING * np.eye(n * d), -F.T @ f / _FALL_SD_M_S2**2
    for i, moment in enumerate(moments):
        own = slice(i * d, (i + 1) * d)
        H[own, own] += moment.information
        g[own] += moment.gradient
    variance, x = np.full(d, _FIRST_SD**2), np.zeros(n * d)
    for _ in range(_ROUNDS + 1):
        weighted = C / np.tile(variance, n - 2)[:, None]
        factor = cho_factor(H + weighted.T @ C, lower=True)
        x = cho_solve(factor, g - weighted.T @ c)
        of_moment = (c + C @ x) ** 2 + np.sum(solve_triangular(factor[0], C.T, lower=True) ** 2, axis=0)
        by_group = np.array([of_moment.reshape(n - 2, d)[:, group == k].mean() for k in range(group.max() + 1)])
        variance = by_group[group]
    return [move_pose(pose, delta) for pose, delta in zip(poses, x.reshape(n, d), strict=True)]


def _accelerations(poses: Sequence[Pose], time_s: Array, d: int) -> tuple[Array, Array]:
    """Return the second derivatives, gravity taken out: by the poses' changes ((n - 2) d, n d), and at none."""
    n, step_s = len(poses), np.diff(time_s)
    rate, by_change = np.zeros((n - 1, d)), np.zeros((n - 1, d, n, d))
    for i in range(n - 1):
        delta = delta_between(poses[i], poses[i + 1])
        turn = np.eye(d)
        turn[3:6, 3:6] = Rotation.from_rotvec(delta[3:6]).as_matrix()
        for j in range(6, d, 3):  # a joint's change is in its segment's axes, which turn with it
            turn[j : j + 3, j : j + 3] = Rotation.from_rotvec(-delta[j : j + 3]).as_matrix()
        rate[i] = delta / step_s[i]
        by_change[i, :, i + 1], by_change[i, :, i] = np.eye(d) / step_s[i], -turn / step_s[i]
    between_s = (step_s[1:] + step_s[:-1])[:, None] / 2
    value = np.diff(rate, axis=0) / between_s
    value[:, :3] -= FREE_FALL_M_S2
    return (np.diff(by_change, axis=0) / between_s[:, :, None, None]).reshape(-1, n * d), value.ravel()


def _fall_equations(model: BodyModel, poses: Sequence[Pose], time_s: Array) -> tuple[Array, Array]:
    """Return how far the centre of mass's acceleration is from gravity: by the poses' changes, and at none."""
    n, d, step_s = len(poses), model.n_dofs, np.diff(time_s)
    place = np.array([centre_of_mass(model.with_pose(pose))[0] for pose in poses])
    changes = _STEP * np.eye(d)
    moved = [[centre_of_mass(model.with_pose(move_pose(pose, x)))[0] for x in changes] for pose in poses]
    slope = (np.array(moved) - place[:, None]).swapaxes(1, 2) / _STEP  # (n, 3, d)
    by_change, value = np.zeros((n - 2, 3, n, d)), np.zeros((n - 2, 3))
    for i in range(n - 2):
        before, after = step_s[i : i + 2]
        weights = 2 / (before * (before + after)), -2 / (before * after), 2 / (after * (before + after))
        for k, weight in enumerate(weights, start=i):
            by_change[i, :, k] = weight * slope[k]
            value[i] += weight * place[k]
    return by_change.reshape(-1, n * d), (value - FREE_FALL_M_S2).ravel()


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
