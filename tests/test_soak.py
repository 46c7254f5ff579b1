"""The soak of `benchmarks/soak.py` in its quick form: nothing is left open, and nothing lost that is not counted."""

import pytest

from benchmarks.soak import soak_live, soak_long, soak_trials
from tests.support.players_trial import stand_in


@pytest.fixture(autouse=True)
def _stand_in(monkeypatch):
    stand_in(monkeypatch)


def grown(found, name):
    return found[name]["last"] - found[name]["first"]


def test_trial_after_trial_leaves_nothing_open(tmp_path):
    found = soak_trials(tmp_path, 12)
    assert found["trials"] == 12
    assert grown(found, "descriptors") <= 0 and grown(found, "threads") <= 0


def test_live_cameras_that_stall_and_send_garbage_are_counted(tmp_path):
    found = soak_live(tmp_path, 4.0)
    assert grown(found, "threads") <= 0
    for camera in found["live"]["cameras"]:
        assert camera["n_used"] + camera["n_dropped"] == camera["n_received"] <= found["sent"][camera["name"]]
        assert camera["n_received"] > 0.5 * found["sent"][camera["name"]]
    assert found["frames"] >= max(camera["n_used"] for camera in found["live"]["cameras"])


def test_a_long_recording_of_large_images_is_read_whole_and_flat(tmp_path):
    found = soak_long(tmp_path, 3.0)
    assert found["frames"] == found["written"] == 75
    assert found["events"] == []
    assert grown(found, "descriptors") <= 0 and grown(found, "memory_mb") < 100
