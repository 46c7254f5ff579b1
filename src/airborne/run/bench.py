"""Speed on this machine, as CPU time of one thread, on the bundled example."""

from __future__ import annotations

import time

import numpy as np

from airborne.body import surface_arrays
from airborne.rendering import FLAT, RULES, pack_targets, score
from airborne.run.opening import open_trial
from airborne.tracking.methods import tracker_of
from airborne.tracking.tracker import step
from airborne.trial.examples import example_trial
from airborne.trial.file import read_trial


def measure_speed() -> dict[str, float]:
    """Return milliseconds for a field of three views, for each method; microseconds for one hypothesis.

    Of the fields' times their median, mean and 95th percentile: a few hard fields hardly move a median.
    """
    speeds = {}
    for method in ("refined", "stepping", "simplex"):
        times_ms = _tracking_ms(method)
        speeds[f"{method}_ms_per_field"] = float(np.median(times_ms))
        speeds[f"{method}_mean_ms_per_field"] = float(np.mean(times_ms))
        speeds[f"{method}_95th_percentile_ms_per_field"] = float(np.percentile(times_ms, 95))
    speeds["score_us_per_hypothesis"] = _scoring_us()
    return speeds


def _tracking_ms(method: str) -> list[float]:
    """Return the CPU time of each field, the first one's search included."""
    trial = read_trial(example_trial("thrown_cross"), {"method": method})
    recording = open_trial(trial).recording
    tracker = tracker_of(trial.settings, trial.model(), trial.start.pose)
    recorded = list(recording)
    times: list[float] = []
    for _ in range(2):  # the first round compiles
        state, times = tracker.init(), []
        for frames in recorded:
            start = time.thread_time()
            state, _ = step(tracker, state, frames)
            times.append(1e3 * (time.thread_time() - start))
    return times


def _scoring_us(n: int = 200, rounds: int = 15) -> float:
    trial = read_trial(example_trial("thrown_cross"), {"method": "stepping"})
    model = trial.model()
    frames = next(iter(open_trial(trial).recording))
    posed, views, flat = model.with_pose(trial.start.pose), pack_targets(frames.views, FLAT), surface_arrays(model)
    R, t = np.repeat(posed.R[None], n, axis=0), np.repeat(posed.t[None], n, axis=0)
    times = []
    for _ in range(rounds):
        start = time.thread_time()
        score(flat, views, R, t, rule=RULES["normalised"])
        times.append(time.thread_time() - start)
    return float(np.median(times) / n * 1e6)
