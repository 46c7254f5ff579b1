"""Offsets of a trial's cameras from its players: each camera's pixels against the players as all cameras track them."""

from __future__ import annotations

from itertools import islice

import numpy as np

from airborne.errors import TrialError
from airborne.run.opening import open_trial
from airborne.run.players_tracker import player_starts
from airborne.sync.lags import LEAST_MOMENTS, find_lags
from airborne.sync.offsets import Offsets, image_counter, with_offsets
from airborne.sync.silhouettes import MOST_IMAGES
from airborne.tracking import Status
from airborne.tracking.camera_lags import LagEquations
from airborne.tracking.capsules import Blocker
from airborne.tracking.capsules.camera_evidence import LagMoment, lag_equations, moment_of
from airborne.trial.file import Trial
from airborne.types import Array, Progress


def offsets_by_players(
    trial: Trial, start_s: Array, *, with_drift: bool = False, progress: Progress | None = None
) -> Offsets:
    """Find the offsets at which every camera's pixels agree with the players as all cameras together track them.

    The recording's first 1500 frames are tracked several times, from offsets start_s (c,) [s]. Raises TrialError where
    players are found too rarely, and where a camera does not see them move.
    """
    recording, on_image = open_trial(trial).recording, image_counter(progress)
    starts = player_starts(trial, recording.rig)

    def measure(lag_s: Array, drift: Array) -> LagEquations:
        now = with_offsets(recording, start_s[0] + np.nan_to_num(lag_s), np.nan_to_num(drift))
        moments: dict[str, list[LagMoment]] = {start.name: [] for start in starts if start.has_legs}
        tracker = Blocker(starts)
        state = tracker.init()
        for frames in islice(now, MOST_IMAGES):
            state, estimates = tracker.step(state, frames)
            for each in estimates:
                if each.status is not Status.LOST:
                    moments[each.player].append(moment_of(state, each.player, frames))
            on_image()
        found = [moment for each in moments.values() for moment in each]
        if (n := len({moment.time_s for moment in found})) < LEAST_MOMENTS:
            raise TrialError(
                f"players were found at {n} moments; the offsets need at least {LEAST_MOMENTS}; check "
                "[[start.player]], or synchronise by motion, flash or sound first"
            )
        return lag_equations(found)

    lags = find_lags(measure, start_s - start_s[0], with_drift=with_drift)
    how = "by tracking: every camera's pixels against the players as all of them see these"
    return lags.to_offsets(recording.rig.names, float(start_s[0]), who="the players", how=how)
