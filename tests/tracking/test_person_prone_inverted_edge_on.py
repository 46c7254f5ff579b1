"""Which way up a person is does not matter, nor that one camera sees the body end on."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.people import CAMERAS, HUMAN, PLACE, mean_errors_mm, person, tracker, turned_to
from tests.support.scenes import statuses, track


def axis_toward_first_camera() -> Rotation:
    """The body's long axis along the line of sight, the head toward the camera."""
    away = CAMERAS[0].camera_from_world.inv().translation - PLACE
    return Rotation.align_vectors([away], [[0, 0, 1.0]])[0]


TURNS = {
    "prone": Rotation.from_euler("XYZ", [1.5, 0.1, 0.3]),
    "inverted": Rotation.from_euler("XYZ", [3.0, 0.1, 0.3]),
    "side on": Rotation.from_euler("XYZ", [0, 0, np.pi / 2]),
    "end on": axis_toward_first_camera(),
}


MOST_MM = {"prone": 7.5, "inverted": 5.5, "side on": 5, "end on": 16}


@pytest.mark.parametrize("name", TURNS)
def test_person_is_tracked_whichever_way_the_body_points(name):
    scene = person(turned_to(TURNS[name]))
    estimates = track(scene, range(4), tracker(scene))
    assert statuses(estimates) == ["tracked"] * 4
    assert mean_errors_mm(scene, estimates).max() < MOST_MM[name]


def test_body_end_on_is_short_in_the_picture():
    scene = person(turned_to(TURNS["end on"]))
    names, landmarks = [each.name for each in HUMAN.landmarks], HUMAN.with_pose(scene.start()).landmarks
    ends = landmarks[[names.index("pelvis"), names.index("neck")]]
    lengths_px = [np.linalg.norm(np.diff(each.px_from_world(ends), axis=0)) for each in scene.cameras]
    assert lengths_px[0] < 0.4 * lengths_px[1]
