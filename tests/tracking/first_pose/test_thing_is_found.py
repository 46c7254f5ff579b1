"""A thing is found without a start: right up to its symmetries, or said to be undecided."""

from functools import cache

import numpy as np
import pytest

from airborne.body import Box
from airborne.errors import TrialError
from airborne.tracking.first_pose.candidates import find_thing
from airborne.tracking.first_pose.moments import empty_scenes, look, spread_sample
from airborne.tracking.first_pose.places import find_places
from airborne.tracking.first_pose.rigid_search import Thing
from airborne.tracking.model_based.render_model import RenderModel
from tests.support.scenes import BLUE, CAMERAS, RED, SPINDLE, YELLOW, Scene, difference, part, rigid_body

TIMES = range(0, 24, 2)


def moments(scene):
    sample = spread_sample([scene.frames(index) for index in TIMES], len(TIMES))
    return look(sample, empty_scenes(sample))


def found(scene, model=None):
    return find_thing(model or scene.model, thrown() if scene is THROWN else moments(scene))


def off(scene, finding):
    """How far the likeliest pose is from the truth, up to symmetry: [mm], [degrees]."""
    pose, true = finding.candidates[0].pose, scene.start(finding.moment.frames.index)
    R, R_true = (each.world_from_root.rotation.as_matrix() for each in (pose, true))
    angle = Thing(RenderModel.of(scene.model)).angles(R[None], R_true)[0]
    return difference(pose, true)[0], float(np.degrees(angle))


THROWN = Scene()


@cache
def thrown():
    return moments(THROWN)


@pytest.mark.parametrize("scene", [THROWN, Scene(cameras=CAMERAS[:2]), Scene(model=SPINDLE)])
def test_a_thing_in_flight_is_found(scene):
    finding = found(scene)
    assert finding.is_decided
    mm, degrees = off(scene, finding)
    assert mm < 30 and degrees < 6


def board(left, right):
    """A board whose halves have colours."""
    half = Box(np.array([0.3, 0.3, 0.05]))
    return rigid_body(part("left", half, (0.15, 0, 0), left), part("right", half, (-0.15, 0, 0), right))


def test_colours_decide_between_the_ends_of_a_board():
    scene = Scene(model=board(RED, BLUE))
    finding = found(scene)
    assert finding.is_decided and off(scene, finding)[1] < 8


def test_a_board_of_one_colour_with_an_end_a_little_thicker_is_undecided_between_its_ends():
    thin, thick = Box(np.array([0.3, 0.3, 0.05])), Box(np.array([0.3, 0.3, 0.052]))
    model = rigid_body(part("left", thin, (0.15, 0, 0), YELLOW), part("right", thick, (-0.15, 0, 0), YELLOW))
    finding = found(Scene(model=model))
    assert not finding.is_decided
    assert len(finding.candidates) >= 2
    assert sum(each.probability for each in finding.candidates) == pytest.approx(1, abs=0.05)


def test_another_body_than_the_one_that_moves_is_not_taken_for_it():
    finding = found(THROWN, board(RED, BLUE))
    assert not finding.is_decided


def test_nothing_that_moves_is_said():
    with pytest.raises(TrialError, match="nothing is seen to move in two cameras"):
        found(Scene(motion=lambda time_s: None))


def test_the_place_of_what_moves_is_where_its_regions_rays_meet():
    moment = thrown()[0]
    places = find_places(moment, 0.5)
    assert np.linalg.norm(places[0].position - THROWN.start(0).world_from_root.translation) < 0.2
    assert sum(region is not None for region in places[0].regions) == len(CAMERAS)
