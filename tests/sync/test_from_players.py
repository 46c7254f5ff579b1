"""Offsets found from players whom all cameras track: of videos that begin apart, from times that are wrong."""

import numpy as np
import pytest

from airborne.errors import TrialError
from airborne.sync import lags
from airborne.sync.from_players import offsets_by_players
from airborne.sync.from_trial import synchronise
from airborne.trial.file import read_trial
from tests.support.jumping_scenes import FPS, Hall, hop

AHEAD = (0, 1, 2)  # frames
OFFSET_S = np.array(AHEAD) / FPS


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    hall = Hall({"anna": hop(late_s=-0.2)})  # squats already
    return read_trial(hall.write_trial(tmp_path_factory.mktemp("hall"), 24, ahead=AHEAD))


def assert_found(offsets):
    misses = offsets.offset_s - OFFSET_S
    assert np.abs(misses).max() < 0.003
    assert (np.abs(misses[1:]) < 3 * offsets.offset_sd_s[1:]).all() and offsets.offset_sd_s.max() < 0.005
    assert offsets.offset_s[0] == offsets.offset_sd_s[0] == 0.0


def test_videos_that_begin_apart_are_put_on_one_clock(trial):
    assert_found(offsets_by_players(trial, np.zeros(3)))


def test_by_default_motion_finds_them_roughly_and_tracking_exactly(trial, monkeypatch):
    monkeypatch.setattr(lags, "_MOST_PASSES", 4)  # enough from so near
    offsets = synchronise(trial, within_s=0.2)
    assert_found(offsets)
    assert offsets.how.startswith("by tracking")


def test_of_players_who_are_hardly_found_nothing_is_said(trial):
    short = trial.model_copy(update={"track": trial.track.model_copy(update={"stop": 4})})
    with pytest.raises(TrialError, match=r"players were found at [0-9] moments; the offsets need at least 8"):
        offsets_by_players(short, np.zeros(3))
