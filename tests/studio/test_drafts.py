"""What is made on a page and not used yet is kept with every change and undone like all else; no file is overtaken."""

import shutil

import numpy as np
import pytest

from airborne.studio.drafts import DRAFTS
from airborne.studio.session import Session
from airborne.studio.starts import (
    is_newer_than_clicks,
    keep_start,
    points_name,
    read_draft_pose,
    read_draft_start,
    standing_pose,
    start_from_pose,
    write_start,
)
from tests.support.places import THROWN_CROSS


@pytest.fixture
def session(tmp_path):
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    return Session(folder, folder / "trial.toml")


def reopened(session):
    """Return a session of the same trial, as after a crash."""
    return Session(session.folder, session.path)


def start_at(x_m):
    """Return a [start] of a frame, as a page makes it."""
    return {"frame": 3, "position_m": [x_m, 0.0, 1.0], "quaternion_xyzw": [0.0, 0.0, 0.0, 1.0]}


def test_a_draft_is_found_again_and_undone_and_done_again(session):
    session.keep_draft("points", ["knob"], "knob added")
    session.keep_draft("points", ["knob", "tip"], "tip added")
    assert reopened(session).draft("points") == ["knob", "tip"]
    assert session.editor.undo() == "tip added (draft.json)"
    assert session.draft("points") == ["knob"]
    session.editor.redo()
    assert session.draft("points") == ["knob", "tip"]


def test_drafts_of_two_trials_of_a_folder_are_apart(session):
    other = Session(session.folder, session.folder / "other.toml")
    session.keep_draft("points", ["knob"], "knob added")
    other.keep_draft("points", ["tip"], "tip added")
    assert (session.draft("points"), other.draft("points")) == (["knob"], ["tip"])


@pytest.mark.parametrize(
    "text", ["", "[1]", '{"trial.toml": 3}', '{"trial.toml": {"start": {"start": {"frame": "a"}, "over": {}}}}']
)
def test_a_draft_that_is_none_is_nothing(session, text):
    session.keep_draft("start", {}, "pose set")
    (session.folder / DRAFTS).write_text(text)
    assert read_draft_start(reopened(session)) is None


def test_a_drafted_start_waits_until_the_trial_has_another(session):
    keep_start(session, start_at(0.1), "pose set by hand")
    assert read_draft_start(reopened(session)) == start_at(0.1)
    write_start(session, read_draft_start(session))
    assert read_draft_start(reopened(session)) == start_at(0.1)  # the trial's own, too
    write_start(session, start_at(0.2))
    assert read_draft_start(reopened(session)) is None
    session.editor.undo()
    assert read_draft_start(session) == start_at(0.1)


def test_clicks_made_since_are_newer_than_a_drafted_start(session):
    keep_start(session, start_at(0.1), "pose set by hand")
    assert is_newer_than_clicks(session, read_draft_start(session))
    session.edit(points_name(3), "point,cam1_u,cam1_v\nhip_left,1.0,2.0\n", "hip_left clicked")
    assert not is_newer_than_clicks(session, read_draft_start(session))
    session.editor.undo()
    assert is_newer_than_clicks(session, read_draft_start(session))


def test_a_drafted_pose_is_that_of_its_body_or_none(session):
    model = session.project().model()
    pose = standing_pose(model, session.rig())
    found = read_draft_pose(model, start_from_pose(model, 3, pose))
    np.testing.assert_allclose(found.world_from_root.translation, pose.world_from_root.translation, atol=1e-4)
    assert read_draft_pose(model, {**start_at(0.1), "joint_angles_deg": {"knee_left": [9.0, 0.0, 0.0]}}) is None
    assert read_draft_pose(model, {"frame": 3, "player": [{"name": "a", "joints_m": {}}]}) is None
