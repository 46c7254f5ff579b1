"""Lengths in other units than metres."""

from dataclasses import replace

import pytest
from scipy.spatial.transform import RigidTransform

from airborne.cameras import Rig
from airborne.cameras.units import check_baselines, check_scales
from tests.support import wand_waving as waving


def grown(rig, scale):
    def place(camera):
        old = camera.camera_from_world
        return RigidTransform.from_components(old.translation * scale, old.rotation)

    return Rig(tuple(replace(camera, camera_from_world=place(camera)) for camera in rig))


RIG = waving.hall()


def test_a_hall_and_a_table_are_plausible():
    assert check_baselines(RIG) == []
    assert check_baselines(grown(RIG, 0.01)) == []
    assert check_baselines(RIG.select(["cam1"])) == []


@pytest.mark.parametrize(("scale", "told"), [(1000.0, "21937 m apart"), (0.0005, "0.011 m apart")])
def test_cameras_implausibly_far_or_near_are_reported(scale, told):
    [found] = check_baselines(grown(RIG, scale))
    assert told in found.sentence
    assert "not in metres" in found.sentence


@pytest.mark.parametrize(("scale", "unit"), [(1000, "mm"), (100, "cm"), (39.37, "inches"), (3.281, "feet")])
@pytest.mark.parametrize("is_wand", [True, False])
def test_the_unit_of_one_source_is_guessed(scale, unit, is_wand):
    large, small = ("wand", "court") if is_wand else ("court", "wand")
    [found] = check_scales({large: grown(RIG, 1.03 * scale), small: RIG})
    assert f"times as far apart by the {large} as by the {small}" in found.sentence
    assert f"the lengths of the {large} seem to be in {unit}" in found.sentence


def test_a_wrong_length_without_a_unit_is_reported_as_that():
    [found] = check_scales({"wand": grown(RIG, 1.5), "board": RIG})
    assert "cameras are 1.5 times as far apart" in found.sentence
    assert "one length is wrong" in found.sentence


def test_starts_that_agree_or_share_too_little_tell_nothing():
    assert check_scales({"wand": grown(RIG, 1.08), "board": RIG}) == []
    assert check_scales({"wand": RIG.select(["cam1", "cam2"]), "board": RIG.select(["cam2", "cam3"])}) == []
