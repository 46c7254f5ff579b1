"""A flight is compared with a reference: centre of mass, angular momentum, rotation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Ellipsoid, Inertia, Part, Segment
from airborne.errors import ResultError
from airborne.evaluation import compare_flight, read_flight_paths
from airborne.motion import Motion, measure_flight, write_flight
from tests.support.motions import somersault

ROD = Segment(
    "rod",
    None,
    np.zeros(3),
    (Part("rod", Ellipsoid(np.array([0.1, 0.1, 0.5])), RigidTransform.identity(), None),),
    inertia=Inertia(3.0, np.array([0.0, 0.0, 0.1]), np.diag([0.2, 0.2, 0.02])),
)
BODY = BodyModel("rod", (ROD,))


@pytest.fixture(scope="module")
def motion():
    return Motion.collect(somersault(12)[0])


@pytest.fixture
def flight(motion, tmp_path):
    """The run's own flight, as a reference."""
    path = tmp_path / "flight.csv"
    write_flight(path, motion, measure_flight(motion, BODY))
    return read_flight_paths(path)


def test_a_flight_agrees_with_itself(motion, flight):
    found = compare_flight(motion, BODY, flight)
    assert found.n_matched == len(motion)
    assert [each.rms for each in found.quantities.values()] == pytest.approx([0] * 9, abs=1e-6)
    assert [*found.quantities][:4] == ["centre of mass x", "centre of mass y", "centre of mass z", "angular momentum x"]
    assert found.turns["somersault"].measured_rev == pytest.approx(found.turns["somersault"].reference_rev)
    assert found.quantities["centre of mass x"].within_2sd == 1
    assert not found.questions


def test_errors_are_measured_minus_reference_in_their_units(motion, flight):
    moved = replace(
        flight, com=flight.com - [0.01, 0, 0], angular_momentum=flight.angular_momentum + np.array([0, 2, 0])
    )
    found = compare_flight(motion, BODY, moved).quantities
    assert found["centre of mass x"].bias == pytest.approx(10)
    assert found["centre of mass x"].rms_without_bias == pytest.approx(0, abs=1e-6)
    assert found["angular momentum y"].bias == pytest.approx(-2)
    assert found["angular momentum y"].largest == pytest.approx(2)


def test_whole_turns_do_not_count(motion, flight):
    turned = replace(flight, rotation_deg={"somersault": flight.rotation_deg["somersault"] + 720})
    assert compare_flight(motion, BODY, turned).quantities["somersault"].rms == pytest.approx(0, abs=1e-6)


def test_a_shifted_clock_is_asked_about(motion, flight):
    t = flight.time_s
    path = np.stack([3 * t, 0 * t, 1 + 4 * t - 4.905 * t**2], axis=1)
    moving = replace(motion, position=motion.position * 0 + path)
    true = replace(flight, com=measure_flight(moving, BODY)["com"].to_numpy(), time_s=t + 2 * (t[1] - t[0]))
    found = compare_flight(moving, BODY, true)
    assert found.better_shift_s == pytest.approx(-2 * (t[1] - t[0]))
    assert "do both clocks start at the same frame?" in found.describe()


def test_something_elsewhere_is_asked_about(motion, flight):
    far = compare_flight(motion, BODY, replace(flight, com=1000 * flight.com + 1))
    assert "is the reference of this recording, in metres" in far.questions[0]


def test_parts_of_a_flight_are_enough_and_blank_cells_unknown(motion, tmp_path):
    path = tmp_path / "turns.csv"
    path.write_text(
        "time_s,twist_rev\n" + "\n".join(f"{t},{'' if k == 3 else 0.25}" for k, t in enumerate(motion.time_s))
    )
    found = compare_flight(motion, BODY, read_flight_paths(path))
    assert list(found.quantities) == ["twist"]
    assert found.quantities["twist"].n == len(motion) - 1
    assert np.isnan(found.com_mm) and np.isnan(found.quantities["twist"].within_2sd)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time_s,com_x_m,com_y_m\n0,1,2\n", "has no column com_z_m"),
        ("time_s,x_m\n0,1\n", "has no column com_x_m"),
        ("com_x_m,com_y_m,com_z_m\n0,1,2\n", "has no column time_s"),
        ("time_s,tilt_deg\n1,1\n0,2\n", "time_s must grow"),
    ],
)
def test_wrong_tables_are_refused(tmp_path, text, said):
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    with pytest.raises(ResultError, match=said):
        read_flight_paths(path)


def test_a_flight_at_other_times_is_refused(motion, flight):
    with pytest.raises(ResultError, match="give the flight of this recording"):
        compare_flight(motion, BODY, replace(flight, time_s=flight.time_s + 100))
