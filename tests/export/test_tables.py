"""Wide tables: every number of the run to the last bit, its unit in its name, the unknown left empty."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow import csv

from airborne.export.tables import body_columns, players_columns, write_csv, write_wide_parquet
from airborne.motion import joint_angles, joint_statuses, landmarks, measure_flight
from tests.support.export_scenes import BOX, PERSON
from tests.support.takes import jumping, tumbling


def person_columns(motion):
    table = measure_flight(motion, PERSON)
    com = table["com"].to_numpy(), table["com_sd"].to_numpy()
    return body_columns(motion, PERSON, *landmarks(motion, PERSON), com=com)


@pytest.fixture(scope="module")
def motion():
    return tumbling(6, lost=(2,), first=4)


@pytest.fixture(scope="module")
def columns(motion):
    return person_columns(motion)


def test_a_row_holds_positions_angles_and_the_centre_of_mass_with_their_deviations(motion, columns):
    points, sd = landmarks(motion, PERSON)
    names = [landmark.name for landmark in PERSON.landmarks]
    np.testing.assert_array_equal(columns["knee_left_z_m"].values, points[:, names.index("knee_left"), 2])
    np.testing.assert_array_equal(columns["knee_left_m_sd"].values, sd[:, names.index("knee_left")])
    angles = joint_angles(motion, PERSON).sel(joint="thigh_right", axis="y")
    np.testing.assert_array_equal(columns["thigh_right_y_deg"].values, angles["angle"])
    np.testing.assert_array_equal(columns["thigh_right_y_deg_sd"].values, angles["angle_sd"])
    np.testing.assert_array_equal(columns["com_z_m"].values, measure_flight(motion, PERSON)["com"].to_numpy()[:, 2])
    assert list(columns)[:5] == ["frame", "time_s", "status", "somersault_deg", "somersault_deg_sd"]
    assert all(name.endswith(("_m", "_deg", "_m_sd", "_deg_sd", "_status")) for name in list(columns)[3:])
    status = joint_statuses(motion, PERSON, sd)
    assert columns["knee_left_status"].values.tolist() == status[:, names.index("knee_left")].tolist()


def test_a_body_in_one_piece_has_no_joints_and_no_mass():
    motion = tumbling(3, model=BOX)
    columns = body_columns(motion, BOX, *landmarks(motion, BOX), com=None)
    assert list(columns)[9:] == ["root_x_m", "root_y_m", "root_z_m", "root_m_sd", "root_status"]


def test_players_have_a_row_each_at_every_frame():
    motion = jumping(4, lost=(1,))
    columns = players_columns(motion)
    assert columns["player"].values.tolist() == ["Anna", "number 7"] * 4
    assert columns["frame"].values.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    np.testing.assert_array_equal(columns["knee_left_y_m"].values, motion.points[:, :, 2, 1].ravel())
    assert columns["status"].values.tolist()[3] == "lost"
    np.testing.assert_array_equal(columns["knee_left_status"].values, motion.joint_status[:, :, 2].ravel())


def test_csv_and_parquet_read_back_to_the_last_bit(columns, tmp_path):
    write_csv(tmp_path / "run.csv", columns)
    write_wide_parquet(tmp_path / "run.parquet", columns)
    text, typed = csv.read_csv(tmp_path / "run.csv"), pq.read_table(tmp_path / "run.parquet")
    assert text.column_names == typed.column_names == list(columns)
    for name, column in columns.items():
        for table in (text, typed):
            if column.values.dtype.kind == "f":
                np.testing.assert_array_equal(table[name].to_numpy(), column.values)
            else:
                assert table[name].to_pylist() == column.values.tolist()


def test_the_unknown_is_empty_and_the_unobservable_infinite(columns, tmp_path):
    unseen = np.where(np.arange(6) == 3, np.inf, columns["head_m_sd"].values)
    columns = {**columns, "head_m_sd": columns["head_m_sd"]._replace(values=unseen)}
    write_csv(tmp_path / "run.csv", columns)
    write_wide_parquet(tmp_path / "run.parquet", columns)
    lines = [line.split(",") for line in (tmp_path / "run.csv").read_text().splitlines()]
    assert set(lines[3][3:]) == {"", "lost"}
    assert lines[4][list(columns).index("head_m_sd")] == "inf"
    table = pq.read_table(tmp_path / "run.parquet")
    assert table["head_x_m"].null_count == 1
    assert table["head_m_sd"].to_pylist()[2:4] == [None, float("inf")]


def test_units_stand_in_the_metadata(columns, tmp_path):
    write_wide_parquet(tmp_path / "run.parquet", columns)
    schema = pq.read_schema(tmp_path / "run.parquet")
    units = {field.name: field.metadata[b"units"] for field in schema}
    assert units["time_s"] == b"s"
    assert units["head_x_m"] == units["com_z_m_sd"] == b"m"
    assert units["tilt_deg"] == units["forearm_left_x_deg_sd"] == b"deg"
    assert schema.metadata[b"world"] == b"metres, z up"
    assert pa.types.is_integer(schema.field("frame").type)
