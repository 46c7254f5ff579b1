"""Two team-mates in the same colours, whom nobody entered, hide the player's legs from two of three cameras."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.tracking import Status
from airborne.tracking.capsules import Blocker
from airborne.tracking.capsules.bystanders import LOOK_S, find_bystanders, occluding_capsules
from airborne.tracking.capsules.first_frame import start_state
from airborne.tracking.capsules.tracker import look_for_others
from tests.support.jumping_scenes import Hall, errors_mm, hop, tracked

N = 26
MATES_M = {"left": (-0.6, -0.65), "right": (0.12, -0.9)}  # where they stand


@pytest.fixture(scope="module")
def crowd():
    return Hall({"anna": hop()} | {name: hop(place, late_s=9.0) for name, place in MATES_M.items()})


@pytest.fixture(scope="module")
def starts(crowd):
    return crowd.starts()[:1]


@pytest.fixture(scope="module")
def estimates(crowd, starts):
    return tracked(crowd, range(N), starts)[0]


def test_the_team_mates_are_found_where_they_stand(crowd, starts):
    anna = start_state("anna", starts[0].joints_m)
    found = find_bystanders([anna], crowd.frames(0))
    hips_m = sorted(each.fit.points[:2].mean(axis=0).tolist() for each in found)
    expected_m = sorted(crowd.truth(name, 0)[:2].mean(axis=0).tolist() for name in MATES_M)
    np.testing.assert_allclose(hips_m, expected_m, atol=0.08)


def test_nobody_is_found_where_nobody_stands(hall):
    assert find_bystanders([start_state("anna", hall.starts()[0].joints_m)], hall.frames(0)) == []


def test_one_camera_finds_nobody(crowd, starts):
    frames = Hall(crowd.motions, is_without=lambda index, number: number > 0).frames(0)
    assert find_bystanders([start_state("anna", starts[0].joints_m)], frames) == []


def test_nobody_is_found_beside_a_player_who_is_nowhere_or_right_below_a_camera(hall):
    frames, state = hall.frames(0), hall.motions["anna"](0.0)
    for floor_m in ((500.0, 500.0), frames.views[0].camera.centre[:2]):
        assert find_bystanders([np.r_[floor_m, state[2:]]], frames) == []
    assert find_bystanders([], frames) == []


def test_only_the_player_is_estimated(estimates):
    assert {each.player for each in estimates} == {"anna"}
    assert [each.note for each in estimates if each.note] == [
        "2 bystanders followed whom the start does not name: they may hide players"
    ]


def test_what_is_called_tracked_lies_on_the_player(crowd, estimates):
    off_mm = errors_mm(crowd, estimates)
    is_tracked = np.array([[status is Status.TRACKED for status in each.joint_status[:6]] for each in estimates])
    assert is_tracked[2:, :2].all(), "two cameras see the hips"
    assert off_mm[is_tracked].max() < 80


def test_followed_as_occluders_they_halve_the_errors_at_least(crowd, starts, estimates, monkeypatch):
    monkeypatch.setattr("airborne.tracking.capsules.tracker.find_bystanders", lambda players, frames: [])
    [alone] = tracked(crowd, range(N), starts)
    assert errors_mm(crowd, estimates).mean() < 0.5 * errors_mm(crowd, alone).mean()


def test_a_shank_that_two_cameras_show_is_known_all_round(hall):
    [estimates] = tracked(hall, range(3))
    off = [np.sqrt(np.linalg.eigvalsh(each.covariance[4]).max()) for each in estimates]
    assert max(off) < 0.08


def test_those_who_came_later_are_found_while_the_player_is_uncertain(crowd, starts, monkeypatch):
    monkeypatch.setattr("airborne.tracking.capsules.tracker.find_bystanders", lambda players, frames: [])
    blocker = Blocker(starts)
    alone, estimates = blocker.step(blocker.init(), crowd.frames(0))
    monkeypatch.undo()
    doubtful = {each.player: replace(each, joint_status=9 * (Status.UNCERTAIN,)) for each in estimates}
    sure = {each.player: replace(each, joint_status=9 * (Status.TRACKED,)) for each in estimates}
    later = replace(crowd.frames(1), time_s=LOOK_S)
    assert alone.bystanders == ()
    assert len(look_for_others(alone, doubtful, later).bystanders) == len(MATES_M)
    assert look_for_others(alone, doubtful, crowd.frames(1)) is alone, "they were looked for just now"
    assert look_for_others(alone, sure, later) is alone, "nobody hides the player"
    lost = {"ben": replace(estimates[0], joint_status=9 * (Status.LOST,))}
    assert look_for_others(alone, doubtful | lost, later) is alone, "they might be the lost one"


def test_a_shank_that_one_camera_shows_is_uncertain_along_its_ray(crowd, starts):
    only_left = Hall(crowd.motions, cameras=crowd.cameras[:2], is_black=lambda index, number: number == 1 and index > 0)
    blocker = Blocker(starts)
    state, _ = blocker.step(blocker.init(), only_left.frames(0))
    _, [estimate] = blocker.step(state, only_left.frames(1))
    ray = estimate.points[4] - only_left.cameras[0].centre
    ray /= np.linalg.norm(ray)
    across = np.cross(ray, [0, 0, 1.0])
    assert np.sqrt(ray @ estimate.covariance[4] @ ray) > 0.1
    assert np.sqrt(across @ estimate.covariance[4] @ across / (across @ across)) < 0.06
    assert estimate.joint_status[4] is Status.UNCERTAIN


def test_a_person_occludes_with_the_head(hall):
    state = hall.motions["anna"](0.0)
    person = occluding_capsules(state, [state])
    highest = (person.ends[..., 2] + person.radii).max()
    assert 1.72 < highest < 1.95, "a player of 1.81 m, slightly bent"
    assert len(occluding_capsules(state, [state + np.r_[4.0, np.zeros(34)]]).ends) == 0, "too far away"
