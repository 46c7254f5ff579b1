"""A camera whose place is wrong is put right by points that the others agree on, and only then."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.initial.resection import (
    find_exchanged_detections,
    find_misplaced_cameras,
    resect,
    resect_cameras,
)
from airborne.cameras import Rig
from airborne.errors import CalibrationError
from tests.support.people_seen import four_cameras, knocked, seen, walking
from tests.support.tolerances import SOLVED

TRUE = four_cameras()


def miss(camera, name):
    true = TRUE[name]
    turn = camera.camera_from_world.rotation * true.camera_from_world.rotation.inv()
    return np.linalg.norm(camera.centre - true.centre), np.degrees(turn.magnitude())


def test_camera_is_put_back_by_exact_points():
    points = walking()
    wrong = knocked(TRUE, "side")["side"]
    mending = resect(wrong, points, TRUE["side"].px_from_world(points))
    position_m, turn_deg = miss(mending.camera, "side")
    assert position_m < SOLVED
    assert turn_deg < SOLVED
    assert mending.after_px < SOLVED < 10 < mending.before_px
    moved_m, turned_deg = miss(wrong, "side")
    assert mending.shift_m == pytest.approx(moved_m, abs=SOLVED)
    assert np.degrees(mending.rotation_rad) == pytest.approx(turned_deg, abs=SOLVED)


@pytest.mark.parametrize("seed", range(4))
def test_new_place_is_as_near_as_its_standard_deviation_says(seed):
    detections = seen(TRUE, walking(seed=seed), sd_px=1.0, seed=seed)
    rig, (mending,) = resect_cameras(knocked(TRUE, "side"), detections, ["side"])
    position_m, turn_deg = miss(rig["side"], "side")
    assert position_m < 3 * mending.shift_sd_m
    assert 0.02 < mending.shift_sd_m < 0.08
    assert turn_deg < 1
    assert mending.after_px < 3 < 10 < mending.before_px
    assert 0 < rig["side"].shift_sd_px < 1, "26 points whose steady errors average out"


def test_resection_twice_changes_nothing():
    detections = seen(TRUE, walking(), sd_px=2.0)
    rig, _ = resect_cameras(knocked(TRUE, "back"), detections, ["back"])
    _, (again,) = resect_cameras(rig, detections, ["back"])
    assert again.shift_m < SOLVED
    assert again.before_px == pytest.approx(again.after_px, abs=0.01)


def test_other_cameras_and_the_lens_stay():
    wrong = knocked(TRUE, "left")
    rig, _ = resect_cameras(wrong, seen(TRUE, walking()), ["left"])
    for name in ("right", "side", "back"):
        assert rig[name] is wrong[name]
    np.testing.assert_array_equal(rig["left"].K, wrong["left"].K)
    np.testing.assert_array_equal(rig["left"].distortion, wrong["left"].distortion)


def test_a_fifth_of_wild_detections_does_not_matter():
    detections = seen(TRUE, walking(), sd_px=1.0)
    rng = np.random.default_rng(3)
    is_wild = rng.random(detections.px.shape[:2]) < 0.2
    px = detections.px.copy()
    px[:, :, 2][is_wild] += rng.normal(0, 200, (is_wild.sum(), 2))
    rig, _ = resect_cameras(knocked(TRUE, "side"), replace(detections, px=px), ["side"])
    clean, _ = resect_cameras(knocked(TRUE, "side"), detections, ["side"])
    assert np.linalg.norm(rig["side"].centre - clean["side"].centre) < 0.01


def test_unsure_detections_and_faces_do_not_move_a_camera():
    detections = seen(TRUE, walking(), sd_px=1.0)
    px, visibility = detections.px.copy(), detections.visibility.copy()
    px[:, :3] += 50  # nose and eyes
    px[:, 10, 2] += 50
    visibility[:, 10, 2] = 0.5
    rig, _ = resect_cameras(knocked(TRUE, "side"), replace(detections, px=px, visibility=visibility), ["side"])
    px[:, :3] = px[:, 10, 2] = np.nan
    without, _ = resect_cameras(knocked(TRUE, "side"), replace(detections, px=px), ["side"])
    np.testing.assert_array_equal(rig["side"].centre, without["side"].centre)


def test_two_cameras_may_be_resected_at_once_by_two_others():
    wrong = knocked(knocked(TRUE, "side"), "back", (-0.05, 0.04, 0.05), (-1.0, 0.5, 0.4))
    rig, done = resect_cameras(wrong, seen(TRUE, walking(), sd_px=0.5), ["side", "back"])
    assert [mending.camera.name for mending in done] == ["side", "back"]
    for mending in done:
        assert miss(rig[mending.camera.name], mending.camera.name)[0] < 3 * mending.shift_sd_m < 0.15


def test_resection_is_reported_in_one_line_with_its_numbers():
    _, (mending,) = resect_cameras(knocked(TRUE, "side"), seen(TRUE, walking()), ["side"])
    said = mending.describe()
    assert "\n" not in said
    assert said.startswith(f"side: moved by {mending.shift_m:.3f} m (sd ")
    assert f"{mending.before_px:.1f} px off before, {mending.after_px:.1f} px after" in said


def test_camera_that_was_knocked_is_named_and_no_other():
    found = find_misplaced_cameras(knocked(TRUE, "side"), seen(TRUE, walking(), sd_px=2.0))
    assert [mending.camera.name for mending in found] == ["side"]
    assert found[0].before_px > 10


def test_three_cameras_are_enough_to_tell_which_was_knocked():
    wrong = knocked(TRUE, "side").select(["left", "right", "side"])
    found = find_misplaced_cameras(wrong, seen(TRUE, walking(), sd_px=1.0))
    assert [mending.camera.name for mending in found] == ["side"]


@pytest.mark.parametrize("sd_px", [1.0, 15.0])
def test_cameras_in_their_places_are_not_named_however_scattered_the_detections(sd_px):
    assert find_misplaced_cameras(TRUE, seen(TRUE, walking(), sd_px=sd_px)) == ()


def test_two_cameras_cannot_tell():
    pair = knocked(TRUE, "side").select(["left", "side"])
    assert find_misplaced_cameras(pair, seen(TRUE, walking())) == ()


def exchanged(detections, *pair):
    """Detections in which two cameras, by their columns, have each other's."""
    px, columns = detections.px.copy(), list(pair)
    px[:, :, columns] = px[:, :, columns[::-1]]
    return replace(detections, px=px)


@pytest.mark.parametrize("pair", [(0, 1), (1, 3)])
@pytest.mark.parametrize("rig", [TRUE, knocked(TRUE, "side")])
def test_detections_of_two_cameras_that_are_exchanged_are_named(rig, pair):
    found = find_exchanged_detections(rig, exchanged(seen(TRUE, walking(), sd_px=2.0), *pair))
    assert found.cameras == tuple(TRUE.names[k] for k in pair)
    assert "once those of" in found.sentence and "detections_cameras" in found.sentence


@pytest.mark.parametrize("sd_px", [1.0, 15.0])
@pytest.mark.parametrize("rig", [TRUE, knocked(TRUE, "side"), knocked(TRUE, "side").select(["left", "side"])])
def test_of_detections_of_their_own_cameras_none_are_called_exchanged(rig, sd_px):
    assert find_exchanged_detections(rig, seen(TRUE, walking(), sd_px=sd_px)) is None


def test_a_camera_that_stands_nowhere_is_not_mended():
    with pytest.raises(CalibrationError, match=r"camera 'side' cannot be mended: wherever it stands, half of its \d+"):
        resect_cameras(TRUE, exchanged(seen(TRUE, walking()), 0, 1), ["side"])


def test_what_cannot_be_resected_is_refused():
    detections = seen(TRUE, walking())
    with pytest.raises(CalibrationError, match="leaves 1 of 4 cameras; two others at least"):
        resect_cameras(TRUE, detections, ["left", "right", "side"])
    with pytest.raises(CalibrationError, match="camera 'top' not in rig"):
        resect_cameras(TRUE, detections, ["top"])
    few = replace(detections, px=detections.px[:1], visibility=detections.visibility[:1])
    with pytest.raises(CalibrationError, match=r"camera 'side': 23 detections .* expected 50"):
        resect_cameras(TRUE, few, ["side"])
    line = np.linspace([0, 0, 1], [0.2, 0, 2], 26) + np.zeros((40, 1, 1))
    with pytest.raises(CalibrationError, match=r"0\.00 m wide"):
        resect_cameras(TRUE, seen(TRUE, line, sd_px=0.0), ["side"])


def test_rig_keeps_its_order():
    rig, _ = resect_cameras(knocked(TRUE, "left"), seen(TRUE, walking()), ["left"])
    assert rig.names == TRUE.names
    assert isinstance(rig, Rig)
