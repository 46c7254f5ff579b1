"""TRC files read back by OpenSim and by our own reader: places, gaps, times, rates."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.evaluation import read_joint_paths
from airborne.export.takes import player_takes
from airborne.export.trc import write_trc
from tests.support.export_scenes import PERSON
from tests.support.takes import hidden, jumping, take_of, tumbling

TOLERANCE_M = 1e-6


@pytest.fixture(scope="module")
def take():
    return hidden(take_of(tumbling(7, lost=(3,), first=10), PERSON), [0, 2], [0, 5])


def test_our_own_reader_gives_the_world_positions_back(take, tmp_path):
    write_trc(tmp_path / "run.trc", take)
    paths = read_joint_paths(tmp_path / "run.trc")
    assert paths.names == take.markers
    np.testing.assert_allclose(paths.points, take.points, atol=TOLERANCE_M)
    np.testing.assert_allclose(paths.time_s, take.time_s, atol=1e-9)


def test_points_that_the_images_do_not_show_are_gaps(take, tmp_path):
    sd = take.sd.copy()
    sd[1, 4] = np.inf
    write_trc(tmp_path / "run.trc", replace(take, sd=sd))
    expected = take.points.copy()
    expected[1, 4] = np.nan
    np.testing.assert_allclose(read_joint_paths(tmp_path / "run.trc").points, expected, atol=TOLERANCE_M)


def test_opensim_gives_them_back_with_y_up(take, opensim, tmp_path):
    write_trc(tmp_path / "run.trc", take)
    table = opensim.TimeSeriesTableVec3(str(tmp_path / "run.trc"))
    rows = [table.getRowAtIndex(k) for k in range(table.getNumRows())]
    result = np.array([[[row[m][axis] for axis in range(3)] for m in range(row.size())] for row in rows])
    np.testing.assert_allclose(result, take.points[..., [1, 2, 0]], atol=TOLERANCE_M)
    assert table.getColumnLabels() == take.markers
    np.testing.assert_allclose(table.getIndependentColumn(), take.time_s, atol=1e-9)
    assert table.getTableMetaDataString("Units") == "m"
    assert float(table.getTableMetaDataString("DataRate")) == 60000 / 1001


def test_opensims_older_reader_takes_gaps_too(take, opensim, tmp_path):
    write_trc(tmp_path / "run.trc", take)
    data = opensim.MarkerData(str(tmp_path / "run.trc"))
    assert (data.getNumFrames(), data.getNumMarkers()) == (7, 20)
    assert data.getDataRate() == pytest.approx(60000 / 1001)


def test_every_line_has_its_tabs_and_no_cell_is_blank(take, tmp_path):
    write_trc(tmp_path / "run.trc", take)
    lines = (tmp_path / "run.trc").read_text().split("\n")
    assert lines[0] == "PathFileType\t4\t(X/Y/Z)\trun.trc"
    assert lines[3].split("\t")[:6] == ["Frame#", "Time", "hip_left", "", "", "knee_left"]
    assert [line.count("\t") for line in lines[3:5]] == [61, 61]
    assert lines[5] == lines[-1] == ""
    rows = [line.split("\t") for line in lines[6:-1]]
    assert [len(row) for row in rows] == [62] * 7
    assert all(cell for row in rows for cell in row)
    assert [row[0] for row in rows] == [str(k) for k in range(11, 18)]
    assert rows[3][2:] == ["NaN"] * 60
    assert rows[0][2:5] == ["NaN"] * 3


def test_a_player_has_a_file_of_his_own(tmp_path):
    motion = jumping(lost=(4,))
    for take in player_takes(motion):
        write_trc(tmp_path / f"{take.name}.trc", take)
    paths = read_joint_paths(tmp_path / "number_7.trc")
    assert paths.names == motion.joints
    np.testing.assert_allclose(paths.points, motion.points[:, 1], atol=TOLERANCE_M)
