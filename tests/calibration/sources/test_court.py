"""The court's points against the rules, and tables that use their names."""

import numpy as np
import pytest

from airborne.calibration.sources.control_points import read_control_points
from airborne.calibration.sources.court import closest_names, court_points
from airborne.errors import CalibrationError
from airborne.synthetic.block.court import COURT_M


def place(name, net="men"):
    return court_points(net)[name].position_m


def test_the_court_reaches_to_the_outer_edges_of_its_lines():
    assert place("corner_far_right_outer") - place("corner_near_left_outer") == pytest.approx([9, 18, 0])
    assert place("corner_far_right_inner") - place("corner_near_left_inner") == pytest.approx([8.9, 17.9, 0])
    assert place("corner_near_left_middle") == pytest.approx([-4.475, -8.975, 0])


def test_the_world_is_that_of_the_synthetic_halls():
    assert COURT_M == (9.0, 18.0)  # x along the net, y across
    assert place("net_right_top")[0] == COURT_M[0] / 2
    assert place("corner_far_left_outer")[1] == COURT_M[1] / 2


def test_an_attack_line_ends_three_metres_from_the_net():
    assert place("attack_near_left_inner_rear") == pytest.approx([-4.45, -3.0, 0])
    assert place("attack_near_left_inner_front") == pytest.approx([-4.45, -2.95, 0])


def test_the_net_has_the_height_of_the_rules_or_the_one_given():
    for net, height in (("men", 2.43), ("women", 2.24), (2.0, 2.0)):
        assert 0 <= place("net_left_top", net)[2] - height <= 0.02
        assert place("antenna_left_top", net)[2] - place("net_left_top", net)[2] == pytest.approx(0.8)
        assert place("net_left_top", net)[2] - place("net_left_bottom", net)[2] == pytest.approx(1.0)
    with pytest.raises(CalibrationError, match=r'net = 243\.0: expected "men", "women"'):
        court_points(243.0)


def test_left_and_right_near_and_far_are_mirror_images():
    known = court_points("men")
    for name, point in known.items():
        other = known[name.replace("left", "LEFT").replace("right", "left").replace("LEFT", "right")]
        assert np.allclose(point.position_m * [-1, 1, 1], other.position_m)
        if "near" in name:
            assert np.allclose(point.position_m * [1, -1, 1], known[name.replace("near", "far")].position_m)


def test_every_coordinate_states_how_exactly_it_is_known():
    assert all((point.sd_m > 0).all() and (point.sd_m < 0.2).all() for point in court_points("men").values())


def test_a_table_of_names_needs_no_coordinates(tmp_path):
    (tmp_path / "court.csv").write_text("point,a_u,a_v\ncorner_near_left_outer,10,20\nnet_left_top,,\n")
    points = read_control_points(tmp_path / "court.csv", court_points("women"))
    assert np.array_equal(points.world, [place("corner_near_left_outer"), place("net_left_top", "women")])
    assert points.sd_m[0].tolist() == [0.01, 0.01, 0.01]
    assert points.is_seen_by("a").tolist() == [True, False]


def test_own_surveyed_points_stand_beside_the_courts(tmp_path):
    (tmp_path / "court.csv").write_text("point,x_m,y_m,z_m,a_u,a_v\ncentre_left_outer,,,,1,2\nchair,5,1,0.4,3,4\n")
    points = read_control_points(tmp_path / "court.csv", court_points("men"))
    assert points.world.tolist() == [[-4.5, 0, 0], [5, 1, 0.4]]
    assert points.sd_m[1].tolist() == [0, 0, 0]


def test_a_table_without_a_point_of_the_court_is_refused(tmp_path):
    (tmp_path / "points.csv").write_text("point,x_m,y_m,z_m,a_u,a_v\nP1,5,1,0.4,3,4\nnet_left_top,1,2,3,4,5\n")
    with pytest.raises(CalibrationError, match="no point takes its position from the court"):
        read_control_points(tmp_path / "points.csv", court_points("men"))


def test_an_unknown_name_is_answered_with_the_nearest(tmp_path):
    (tmp_path / "court.csv").write_text("point,a_u,a_v\ncorner_near_left,10,20\n")
    with pytest.raises(CalibrationError, match=r"'corner_near_left' .* nearest names: corner_near_left_"):
        read_control_points(tmp_path / "court.csv", court_points("men"))
    assert closest_names("Net_top_left", court_points("men")).split(", ")[0].startswith("net_")


def test_half_a_place_is_refused(tmp_path):
    (tmp_path / "court.csv").write_text("point,x_m,y_m,z_m,a_u,a_v\nchair,5,,0.4,3,4\n")
    with pytest.raises(CalibrationError, match="row 2, column y_m: '' is not a number"):
        read_control_points(tmp_path / "court.csv", court_points("men"))
