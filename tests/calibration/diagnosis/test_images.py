"""Pictures mirrored, turned, of another size, exchanged; and sound ones."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.diagnosis.images import (
    check_floor,
    check_image_size,
    check_mirroring,
    check_roll,
    check_swapped_files,
)
from airborne.cameras import Rig
from tests.support import wand_waving as waving

RIG = waving.hall()
UP = np.array([0, 0, 1.0])


def points_and_px(seed=0, **kinds):
    rng = np.random.default_rng(seed)
    points = waving.wave_wand(rng, 100).reshape(-1, 3)
    return points, waving.observe(rng, RIG, points, **kinds)


def changed(k, camera):
    cameras = list(RIG)
    cameras[k] = camera
    return Rig(tuple(cameras))


@pytest.mark.parametrize("k", range(4))
@pytest.mark.parametrize("stray_share", [0.0, 0.1])
def test_a_mirrored_image_is_told_from_a_sound_one(k, stray_share):
    points, px = points_and_px(stray_share=stray_share)
    assert check_mirroring("cam", waving.SIZE, points, px[:, k]) == []
    mirrored = px[:, k] * [-1, 1] + [waving.SIZE[0] - 1, 0]
    [found] = check_mirroring("cam", waving.SIZE, points, mirrored)
    assert "cam fits what the other cameras see" in found.sentence
    assert "only as in a mirror" in found.sentence


def test_pixels_that_fit_nothing_are_not_called_mirrored():
    points, px = points_and_px()
    shuffled = np.random.default_rng(1).permutation(px[:, 0])
    assert check_mirroring("cam", waving.SIZE, points, shuffled) == []
    assert check_mirroring("cam", waving.SIZE, points[:10], px[:10, 0] * [-1, 1]) == []


@pytest.mark.parametrize("up", [None, UP])
def test_level_cameras_are_not_flagged(up):
    assert check_roll(RIG, up) == []


@pytest.mark.parametrize("up", [None, UP])
@pytest.mark.parametrize("degrees", [90, 180, -90])
def test_a_turned_camera_is_named_with_its_turn(up, degrees):
    turn = RigidTransform.from_rotation(Rotation.from_euler("z", degrees, degrees=True))
    rig = changed(2, replace(RIG["cam3"], camera_from_world=turn * RIG["cam3"].camera_from_world))
    [found] = check_roll(rig, up)
    assert found.cameras == ("cam3",)
    told = float(found.sentence.split("turned by ")[1].split(" degrees")[0])
    assert abs((told - degrees + 180) % 360 - 180) < 6


def test_two_cameras_alone_cannot_tell_which_is_turned():
    turn = RigidTransform.from_rotation(Rotation.from_euler("z", 180, degrees=True))
    pair = Rig((RIG["cam1"], replace(RIG["cam2"], camera_from_world=turn * RIG["cam2"].camera_from_world)))
    assert check_roll(pair) == []


@pytest.mark.parametrize(
    ("size", "said"),
    [
        ((1080, 1920), "turned by 90 degrees"),
        ((1280, 720), "saved 0.667 times as large; give saved_scale = 1.5"),
        ((1440, 1080), "cropped (give saved_offset_px, and saved_scale if it was resized too), or the camera"),
    ],
)
def test_another_size_is_explained(size, said):
    [found] = check_image_size("cam1", waving.SIZE, size)
    assert said in found.sentence
    assert check_image_size("cam1", size, size) == []


@pytest.mark.parametrize("order", [[0, 2, 1, 3], [3, 1, 2, 0]])
def test_swapped_files_are_named(order):
    _, px = points_and_px(stray_share=0.05)
    assert check_swapped_files(RIG, px) == []
    [found] = check_swapped_files(RIG, px[:, order])
    names = tuple(f"cam{i + 1}" for i, k in enumerate(order) if i != k)
    assert found.cameras == names
    assert f"the files of {names[0]} and {names[1]} are swapped" in found.sentence


def test_a_wrong_rig_is_not_called_a_swap():
    _, px = points_and_px()
    turn = RigidTransform.from_rotation(Rotation.from_euler("y", 5, degrees=True))
    rig = changed(1, replace(RIG["cam2"], camera_from_world=turn * RIG["cam2"].camera_from_world))
    assert check_swapped_files(rig, px) == []


def test_a_camera_below_the_floor_is_named():
    assert check_floor(RIG) == []
    down = RigidTransform.from_translation([0, 0, 8.0])
    low = replace(RIG["cam1"], camera_from_world=RIG["cam1"].camera_from_world * down)
    [found] = check_floor(changed(0, low))
    assert found.sentence.startswith("cam1 comes out below the floor, at z = -5.0 m")
