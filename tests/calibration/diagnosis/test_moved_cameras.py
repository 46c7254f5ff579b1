"""A camera that is knocked while it films: which, when, how far; and cameras that stand still."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle import FreeParameters, adjust
from airborne.calibration.diagnosis.moved_cameras import check_moved_cameras
from airborne.calibration.sources.wand import wand_source
from airborne.cameras import Rig
from tests.support import wand_waving as waving

RIG = waving.hall((1500.0,) * 4)
N = 200
TIMES_S = np.arange(N) / 50


def knocked(seed, moment, names=("cam2",), degrees=0.5):
    """The wand as seen by cameras of which some are turned and shifted at a moment."""
    rng = np.random.default_rng(seed)
    points = waving.wave_wand(rng, N)
    turn = Rotation.from_euler("y", degrees, degrees=True)
    knock = RigidTransform.from_components(degrees * np.array([0.04, 0, 0.02]), turn)
    after = Rig(tuple(replace(c, camera_from_world=knock * c.camera_from_world) if c.name in names else c for c in RIG))
    px = [waving.observe(rng, rig, points, stray_share=0.03) for rig in (RIG, after)]
    return np.where((np.arange(N) < moment)[:, None, None, None], *px)


def test_cameras_that_stand_still_are_not_flagged():
    assert check_moved_cameras(RIG, knocked(0, N), TIMES_S) == []


@pytest.mark.parametrize("name", ["cam1", "cam4"])
@pytest.mark.parametrize("moment", [60, 140])
def test_the_camera_the_time_and_the_way_are_reported(name, moment):
    [found] = check_moved_cameras(RIG, knocked(1, moment, (name,)), TIMES_S)
    assert found.cameras == (name,)
    assert f"between {TIMES_S[moment - 1]:.2f} s and {TIMES_S[moment]:.2f} s" in found.sentence
    turned = float(found.sentence.split("turned by ")[1].split(" ")[0])
    assert turned == pytest.approx(0.5, abs=0.1)
    assert float(found.sentence.split("jumps by ")[1].split(" ")[0]) == pytest.approx(16, abs=2)


def test_it_is_told_from_a_calibration_with_the_moved_camera_too():
    px = knocked(2, 100, ("cam3",))
    tracks = waving.WandTracks(cameras=RIG.names, px=px, lengths_m={(0, 1): 1.0})
    spoiled = adjust(RIG, [wand_source(RIG, tracks)], FreeParameters(focal=False)).rig
    [found] = check_moved_cameras(spoiled, px)
    assert found.cameras == ("cam3",)
    assert "between frame 99 and frame 100" in found.sentence


def test_two_that_move_apart_in_time_are_both_named():
    first, second = knocked(3, 70, ("cam1",)), knocked(3, 130, ("cam4",))
    px = first.copy()
    px[:, :, 3] = second[:, :, 3]
    assert {found.cameras for found in check_moved_cameras(RIG, px, TIMES_S)} == {("cam1",), ("cam4",)}


def test_a_shake_below_the_noise_is_not_told():
    assert check_moved_cameras(RIG, knocked(4, 100, degrees=0.01), TIMES_S) == []


def test_two_cameras_or_nothing_seen_tell_nothing():
    px = knocked(5, 100)
    assert check_moved_cameras(RIG.select(["cam1", "cam2"]), px[:, :, :2]) == []
    assert check_moved_cameras(RIG, np.full_like(px, np.nan)) == []
