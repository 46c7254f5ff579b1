"""C3D files read back in other programs' readers: places, gaps, residuals, rates, names."""

import struct
import warnings
from dataclasses import replace

import numpy as np
import pytest

from airborne.errors import ResultError
from airborne.export.c3d import LARGEST_RESIDUAL_MM, write_c3d
from airborne.export.takes import player_takes
from tests.support.export_scenes import PERSON
from tests.support.takes import NTSC, hidden, jumping, take_of, tumbling

TOLERANCE_MM = 1e-3  # of 32-bit floats some metres from the origin


@pytest.fixture(scope="module")
def take():
    """A person with a lost frame and two markers that are unknown for a while."""
    return hidden(take_of(tumbling(7, lost=(3,), first=10), PERSON), [1, 2], [0, 5])


@pytest.fixture
def read(ezc3d, tmp_path):
    """Write takes and read them with ezc3d: parameters, header, points (n, markers, 3) [mm]."""

    def write_and_read(*takes):
        write_c3d(tmp_path / "run.c3d", takes)
        file = ezc3d.c3d(str(tmp_path / "run.c3d"))
        return file["parameters"], file["header"]["points"], file["data"]["points"][:3].T

    return write_and_read


@pytest.fixture
def words(plain_c3d, tmp_path):
    """Write takes and read them with the package c3d: places and residuals [mm], (n, markers, 4)."""

    def write_and_read(*takes):
        write_c3d(tmp_path / "run.c3d", takes)
        with (tmp_path / "run.c3d").open("rb") as file, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that there are no analogue channels
            reader = plain_c3d.Reader(file)
            frames = list(reader.read_frames())
        return reader, np.array([points[:, :4] for _, points, _ in frames])

    return write_and_read


def test_positions_and_gaps_read_back(take, read):
    _, _, points = read(take)
    np.testing.assert_allclose(points, 1e3 * take.points, atol=TOLERANCE_MM)  # NaN where NaN


def test_names_units_axes_and_frames_read_back(take, read):
    parameters, header, _ = read(take)
    point = parameters["POINT"]
    assert point["LABELS"]["value"] == list(take.markers)
    assert point["UNITS"]["value"] == ["mm"]
    assert (point["X_SCREEN"]["value"], point["Y_SCREEN"]["value"]) == (["+X"], ["+Z"])
    assert point["FRAMES"]["value"] == [7]
    assert parameters["ANALOG"]["USED"]["value"] == [0]
    assert (header["first_frame"], header["last_frame"]) == (10, 16)  # counted from 0 there
    assert list(parameters["TRIAL"]["ACTUAL_START_FIELD"]["value"]) == [11, 0]


def test_the_rate_is_not_rounded(take, read):
    parameters, header, _ = read(take)
    assert parameters["POINT"]["RATE"]["value"][0] == np.float32(60000 / 1001)
    assert header["frame_rate"] == np.float32(60000 / 1001)


def test_the_residual_is_the_standard_deviation(take, words):
    reader, result = words(take)
    is_known = np.isfinite(take.sd)
    step_mm = abs(reader.point_scale)
    assert step_mm < 0.2
    np.testing.assert_allclose(result[is_known][:, 3], 1e3 * take.sd[is_known], atol=step_mm / 2 + 1e-6)
    np.testing.assert_array_equal(result[~is_known][:, 3], -1)
    np.testing.assert_allclose(result[is_known][:, :3], 1e3 * take.points[is_known], atol=TOLERANCE_MM)


def test_tiny_unknown_and_infinite_deviations_differ(take, words):
    sd = take.sd.copy()
    sd[0, :4] = [1e-9, np.nan, np.inf, 3.0]
    reader, result = words(replace(take, sd=sd))
    smallest, unknown, unseen, huge = result[0, :4, 3]
    assert smallest == pytest.approx(abs(reader.point_scale))
    assert unknown == 0
    assert unseen == huge == pytest.approx(LARGEST_RESIDUAL_MM)


def test_the_file_holds_no_nan_and_whole_blocks(take, tmp_path):
    write_c3d(tmp_path / "run.c3d", [take])
    data = (tmp_path / "run.c3d").read_bytes()
    assert len(data) % 512 == 0
    (block,) = struct.unpack_from("<H", data, 16)
    numbers = np.frombuffer(data, "<f4", offset=512 * (block - 1))
    assert np.isfinite(numbers).all()
    first_lost = np.reshape(numbers[: take.points.shape[1] * 4 * len(take)], (len(take), -1, 4))[3]
    np.testing.assert_array_equal(first_lost, np.tile([0, 0, 0, -1], (len(first_lost), 1)))
    assert struct.unpack_from("<f", data, 12)[0] < 0  # floats; its size is that of POINT:SCALE


def test_players_share_a_file_under_their_names(read):
    motion = jumping(lost=(4,))
    parameters, _, points = read(*player_takes(motion))
    labels = parameters["POINT"]["LABELS"]["value"]
    assert labels[:1] + labels[9:10] == ["Anna:hip_left", "number_7:hip_left"]
    np.testing.assert_allclose(points, 1e3 * motion.points.reshape(10, 18, 3), atol=TOLERANCE_MM)
    subjects = parameters["SUBJECTS"]
    assert subjects["USED"]["value"] == [2]
    assert subjects["NAMES"]["value"] == ["Anna", "number_7"]
    assert subjects["LABEL_PREFIXES"]["value"] == ["Anna:", "number_7:"]


def long_take(take, n, n_markers):
    rng = np.random.default_rng(0)
    return replace(
        take,
        frame=np.arange(11, 11 + n),
        time_s=np.arange(n) / float(NTSC),
        markers=tuple(f"marker_{k}" for k in range(n_markers)),
        points=rng.normal(0, 1, (n, n_markers, 3)),
        sd=np.full((n, n_markers), 0.01),
    )


@pytest.mark.parametrize(("n", "n_markers"), [(70_001, 1), (65_536, 2), (65_525, 1)])
def test_more_frames_than_the_header_can_count_are_all_read(take, read, n, n_markers):
    long = long_take(take, n, n_markers)
    parameters, _, points = read(long)
    assert points.shape == (n, n_markers, 3)
    np.testing.assert_allclose(points, 1e3 * long.points, atol=TOLERANCE_MM)
    low, high = parameters["TRIAL"]["ACTUAL_END_FIELD"]["value"].astype(np.uint16)
    assert int(low) + 65536 * int(high) == (n if n + 10 > 65_535 else n + 10)


def test_more_names_than_one_parameter_can_hold_go_on_in_the_next(take, read):
    many = long_take(take, 2, 600)
    parameters, _, points = read(many)
    point = parameters["POINT"]
    names = [*point["LABELS"]["value"], *point["LABELS2"]["value"], *point["LABELS3"]["value"]]
    assert names == list(many.markers)
    np.testing.assert_allclose(points, 1e3 * many.points, atol=TOLERANCE_MM)


def test_more_names_than_the_file_can_hold_are_refused(take, tmp_path):
    with pytest.raises(ResultError, match="markers are more than a C3D file can name"):
        write_c3d(tmp_path / "run.c3d", [long_take(take, 2, 14_000)])
    assert not (tmp_path / "run.c3d").exists()
