"""Each mistake a user can make, made to the bundled control points."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.diagnosis import flatness
from airborne.calibration.from_points import calibrate
from airborne.errors import CalibrationError
from tests.support.cameras import clicked, restrict_to_cameras


def exchanged(px):
    return px[:, ::-1]


def warnings_of(points, sizes, *cameras):
    return calibrate(restrict_to_cameras(points, *cameras), sizes).warnings


def error_of(points, sizes):
    with pytest.raises(CalibrationError) as error:
        calibrate(points, sizes)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_too_few_points_are_counted_per_camera(points, sizes):
    some = np.isin(points.names, ["P01", "P04", "P05", "P13", "P20", "P23"])[:, None]
    enough = clicked(points, "cam2", lambda px: np.where(some, px, np.nan))
    assert calibrate(restrict_to_cameras(enough, "cam2"), sizes).fits[0].n_points == 6
    few = clicked(points, "cam2", lambda px: np.where(np.arange(24)[:, None] < 5, px, np.nan))
    assert "camera 'cam2' sees 5 control points, at least 6 are needed" in error_of(few, sizes)


def test_a_camera_without_a_size_is_named(points, sizes):
    message = error_of(points, {"cam1": (768, 576)})
    assert message == "no image size for camera 'cam2'; sizes are given for: cam1"


def test_points_in_one_plane_are_refused(points, sizes):
    wall = clicked(points, "cam1", lambda px: np.where(points.world[:, 1:2] < 0, px, np.nan))  # the front row of wires
    message = error_of(replace(wall, world=points.world * [1, 0, 1] + [0, 0.7, 0]), sizes)
    assert "the control points of camera 'cam1' lie in one plane (thickness / extent 0.0000" in message


def test_points_near_one_plane_are_flagged(points, sizes):
    front = clicked(points, "cam1", lambda px: np.where(points.world[:, 1:2] < 0, px, np.nan))
    ratio = flatness(points.world[front.is_seen_by("cam1")])
    assert 0.01 < ratio < 0.1
    assert f"nearly flat (thickness / extent {ratio:.3f})" in " ".join(warnings_of(front, sizes, "cam1"))


def test_exchanged_u_and_v_are_seen_from_the_image_border(points, sizes):
    message = error_of(clicked(points, "cam1", exchanged), sizes)
    assert "camera 'cam1'" in message
    assert "with width and height exchanged they would fit" in message


def test_exchanged_u_and_v_are_seen_from_the_mirrored_camera(points):
    square = dict.fromkeys(points.cameras, (768, 768))
    message = error_of(clicked(points, "cam2", exchanged), square)
    assert message.startswith("camera 'cam2' comes out left-handed while others do not: its u and v are exchanged")


@pytest.mark.parametrize("columns", [[1, 0, 2], [0, 2, 1], [2, 1, 0]])
def test_two_exchanged_world_axes_are_seen_as_a_mirror(points, sizes, columns):
    assert "the world is mirrored" in error_of(replace(points, world=points.world[:, columns]), sizes)


def test_a_wrong_sign_or_v_counted_from_below_is_seen_as_a_mirror(points, sizes):
    assert "one has the wrong sign" in error_of(replace(points, world=points.world * [1, -1, 1]), sizes)
    upward = replace(points, px=points.px * [1, -1] + [0, 575])
    assert "every v counts up from the bottom" in error_of(upward, sizes)


def test_axes_turned_round_leave_the_camera_on_its_side(points, sizes):
    turned = replace(points, world=points.world[:, [2, 0, 1]])
    assert "'cam1' comes out on its side" in " ".join(warnings_of(turned, sizes, "cam1"))


def test_points_outside_the_image_are_counted_and_named(points, sizes):
    assert "1 point outside its 768×576 image (first 'P03' at u=900, v=154.43)" in error_of(
        clicked(points, "cam1", lambda px: np.where(np.arange(24)[:, None] == 2, [900, 154.43], px)), sizes
    )


@pytest.mark.parametrize(("small", "scale"), [((384, 288), 2), ((512, 384), 1.5), ((576, 432), 1.33333)])
def test_clicks_of_a_video_that_was_reduced_since_say_by_how_much(points, small, scale):
    message = error_of(points, dict.fromkeys(points.cameras, small))
    assert "they fit 768×576" in message
    assert "calibrate with --size 768x576; in a trial of reduced videos give the result as file" in message
    assert f"saved_scale = {scale} and saved_offset_px" in message


def test_clicks_outside_that_no_reduction_explains_are_to_be_corrected(points):
    assert error_of(points, dict.fromkeys(points.cameras, (60, 40))).endswith("correct them, or the image size")


def test_one_wrong_click_is_named_and_others_are_not(points, sizes):
    wrong = clicked(points, "cam1", lambda px: px + 12 * np.array([1, -1]) * (np.arange(24)[:, None] == 12))
    [finding] = calibrate(restrict_to_cameras(wrong, "cam1"), sizes).findings
    assert (finding.cameras, finding.points) == (("cam1",), ("P13",))
    warning = finding.sentence
    assert warning.startswith("control point 'P13' misses by 1")
    assert "in camera 'cam1' when left out: check its clicked pixels" in warning


def test_two_exchanged_points_are_both_named(points, sizes):
    order = np.arange(24)
    order[[4, 5]] = 5, 4
    warnings = " ".join(warnings_of(clicked(points, "cam2", lambda px: px[order]), sizes, "cam2"))
    assert "'P05' misses" in warnings
    assert "'P06' misses" in warnings


def test_a_wrong_survey_is_told_from_a_wrong_click(points, sizes):
    world = points.world.copy()
    world[9, 2] += 0.1
    [warning] = warnings_of(replace(points, world=world), sizes, "cam1", "cam2")
    assert warning.startswith("control point 'P10' misses by")
    assert "check its x_m, y_m, z_m" in warning


def test_millimetres_given_as_metres_are_refused(points, sizes):
    message = error_of(replace(points, world=points.world * 1000), sizes)
    assert message == (
        "the control points span 3368 m, expected a scene in metres: they would span 34 m if in cm (divide by 100), "
        "3.4 m if in mm (divide by 1000), 86 m if in inches (multiply by 0.0254)"
    )


def test_a_unit_that_makes_no_scene_is_not_proposed(points, sizes):
    message = error_of(replace(points, world=points.world * 20_000), sizes)
    assert "67 m if in mm" in message
    assert " cm " not in message
    assert "inches" not in message
    assert error_of(replace(points, world=points.world * 1e6), sizes).endswith("correct x_m, y_m, z_m")


def test_a_single_point_in_millimetres_is_named(points, sizes):
    world = points.world.copy()
    world[6] *= 1000
    message = error_of(replace(points, world=world), sizes)
    assert message.startswith("a control point lies 2520 m from the others, which span 3.4 m (P07)")


def test_a_hundred_metres_are_flagged(points, sizes):
    warnings = warnings_of(replace(points, world=points.world * 100), sizes, "cam3")
    assert "the control points span 337 m: are they in metres? they would span 3.4 m if in cm" in " ".join(warnings)


def test_a_wrong_image_size_shows_as_an_axis_off_the_middle(points):
    [warning] = warnings_of(points, {"cam1": (1536, 1152)}, "cam1")
    assert "expected near the middle (768, 576): is 1536×1152 its size" in warning


def test_pixels_that_are_not_square_are_reported(points):
    stretched = clicked(points, "cam1", lambda px: px * [720 / 768, 1])
    assert "pixels that are not square" in " ".join(warnings_of(stretched, {"cam1": (720, 576)}, "cam1"))


def test_a_rough_fit_is_reported(points, sizes):
    noise = np.random.default_rng(0).normal(0, 4, (24, 2))
    rough = clicked(points, "cam1", lambda px: np.clip(px + noise, 0, [767, 575]))
    assert "fits its control points only to" in " ".join(warnings_of(rough, sizes, "cam1"))


@pytest.mark.parametrize(("axis", "stretch"), [(0, 0.9), (1, 1.1), (2, 0.9)])
def test_a_stretched_axis_of_the_world_is_named_and_no_pixels_are_blamed(points, sizes, axis, stretch):
    world = points.world * np.where(np.arange(3) == axis, stretch, 1.0)
    findings = calibrate(replace(points, world=world), sizes).findings
    [found] = [each for each in findings if each.kind == "stretched"]
    assert (
        found.what == f"with {'xyz'[axis]}_m multiplied by {1 / stretch:.2f}, the pixels of all cameras would be square"
    )
    assert "squeezed" not in [each.kind for each in findings]


def test_pixels_of_all_cameras_that_are_not_square_are_no_stretched_world(points, sizes):
    flat = replace(points, px=points.px * [1, 0.8])
    kinds = [each.kind for each in calibrate(flat, {name: (768, 461) for name in sizes}).findings]
    assert kinds.count("squeezed") == len(sizes) and "stretched" not in kinds
