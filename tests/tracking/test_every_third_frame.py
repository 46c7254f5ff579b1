"""Few frames a second, and motion that no prediction foresees, are met by the global search."""

import numpy as np
from scipy.spatial.transform import Rotation

from tests.support.scenes import FPS, Scene, statuses, thrown, track, worst


def test_every_third_frame_is_enough():
    scene = Scene()
    estimates = track(scene, range(0, 18, 3))
    assert statuses(estimates) == ["tracked"] * 6
    position_mm, rotation_deg = worst(scene, estimates)
    assert position_mm < 3
    assert rotation_deg < 1


def jumping(time_s):
    """The throw, but from the sixth frame on 12 cm and 25 degrees away."""
    pose = thrown(time_s)
    if time_s * FPS < 6:
        return pose
    return pose.move(np.array([0.08, 0.06, 0.06]), Rotation.from_euler("xyz", [15, -15, 14], degrees=True).as_rotvec())


def test_sudden_jump_is_found_by_the_global_search():
    scene = Scene(motion=jumping)
    estimates = track(scene, range(0, 15, 3))
    assert statuses(estimates) == ["tracked"] * 5
    position_mm, rotation_deg = worst(scene, estimates)
    assert position_mm < 3
    assert rotation_deg < 1
