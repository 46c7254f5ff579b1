"""Of a player of whom no frame is tracked, no joint is called tracked, in a run and in one that goes on."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from airborne.motion import read_players
from airborne.run.track import track_trial
from airborne.tracking import Status
from airborne.trial.file import read_trial
from tests.support.players_trial import StandIn, stand_in, write_trial


@dataclass(frozen=True)
class OneKneeUncertain(StandIn):
    """Calls number 7's left knee uncertain in every frame."""

    def step(self, state, frames):
        state, estimates = super().step(state, frames)
        knee = tuple(Status.UNCERTAIN if name == "knee_left" else Status.TRACKED for name in self.joints)
        return state, tuple(
            replace(e, joint_status=knee if e.player == "number 7" else e.joint_status) for e in estimates
        )


@pytest.fixture
def run(tmp_path, monkeypatch):
    stand_in(monkeypatch, OneKneeUncertain())
    trial = read_trial(write_trial(tmp_path / "trial", 6))
    return trial, tmp_path / "run", track_trial(trial, tmp_path / "run", pictures=False)


def test_no_joint_of_a_player_who_is_never_tracked_is_tracked(run):
    _, folder, result = run
    motion = read_players(folder / "joints.csv")
    np.testing.assert_array_equal(motion.joint_status, result.motion.joint_status)
    anna, other = (motion.players.index(name) for name in ("Anna", "number 7"))
    assert (motion.joint_status[:, anna] == "tracked").all()
    assert (motion.joint_status[:, other] == "uncertain").all()
    assert any("number 7: no frame was tracked" in said and "[start]" in said for said in result.summary["warnings"])
    assert result.summary["players"]["number 7"]["doubts"] == [
        "left knee in frames 0 to 5: images show them worse than usual"  # and no other joint, whose images are good
    ]


def test_a_revised_run_goes_on_to_the_same_table(run):
    trial, folder, _ = run
    whole = (folder / "joints.csv").read_bytes()
    (folder / "summary.json").unlink()
    track_trial(trial, folder, resume=True, pictures=False)
    assert (folder / "joints.csv").read_bytes() == whole
    (folder / "summary.json").unlink()
    (folder / "joints.csv").write_bytes(whole[: len(whole) // 2])
    track_trial(trial, folder, resume=True, pictures=False)
    assert (folder / "joints.csv").read_bytes() == whole
