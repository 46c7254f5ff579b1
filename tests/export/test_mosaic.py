import cv2
import numpy as np
import pytest

from airborne.export.mosaic import ColumnTitle, write_mosaic

RED = np.full((20, 40, 3), (200, 0, 0), np.uint8)


def mosaic(tmp_path, rows, names=("left", "right"), titles=("before", "after"), **options):
    path = tmp_path / "mosaic.png"
    write_mosaic(path, rows, names, [ColumnTitle(text) for text in titles], **options)
    return cv2.imread(str(path))[..., ::-1]


def test_an_image_keeps_its_shape_and_a_missing_one_leaves_its_cell_white(tmp_path):
    page = mosaic(tmp_path, [[RED, None], [None, RED]])
    is_red = (page == (200, 0, 0)).all(axis=-1)
    rows, columns = np.flatnonzero(is_red.any(axis=1)), np.flatnonzero(is_red[: page.shape[0] // 2].any(axis=0))
    assert len(columns) == pytest.approx(len(rows), abs=2)  # two images of half a width, one below the other
    assert np.count_nonzero(is_red) == len(rows) * len(columns)


def test_titles_and_names_of_any_length_and_letters_stay_in_their_own_place(tmp_path):
    plain = mosaic(tmp_path, [[RED, RED]], names=["cam"], titles=["a", "b"])
    odd = mosaic(tmp_path, [[RED, RED]], names=["日" * 200], titles=["x" * 300, "b"])
    assert odd.shape == plain.shape
    half = plain.shape[1] // 2 + 20
    np.testing.assert_array_equal(odd[:, half:], plain[:, half:])


def test_with_fewer_columns_than_fill_the_width_the_picture_is_narrower(tmp_path):
    assert mosaic(tmp_path, [[RED]], names=["a"], titles=["b"], n_columns=8).shape[1] < 300
