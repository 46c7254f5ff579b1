import numpy as np
import pytest

from airborne.video import fill_rows, weave

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("height", [8, 9])
@pytest.mark.parametrize("parity", [0, 1])
def test_own_rows_of_a_filled_field_are_untouched(height, parity):
    image = RNG.integers(0, 256, (height, 5, 3), dtype=np.uint8)
    filled = fill_rows(image[parity::2], parity, height)
    assert filled.shape == image.shape
    assert np.array_equal(filled[parity::2], image[parity::2])


@pytest.mark.parametrize("height", [8, 9])
@pytest.mark.parametrize("parity", [0, 1])
def test_filling_a_ramp_gives_the_ramp_and_copies_the_edge(height, parity):
    ramp = np.broadcast_to(20 * np.arange(height, dtype=np.uint8)[:, None, None], (height, 4, 3))
    filled = fill_rows(ramp[parity::2], parity, height)
    rows = np.arange(height)
    has_both = (rows >= parity) & (rows <= np.arange(parity, height, 2)[-1])
    assert np.array_equal(filled[has_both], ramp[has_both])
    for row in rows[~has_both]:
        assert np.array_equal(filled[row], filled[row + 1 if row == 0 else row - 1])


def test_bright_rows_do_not_overflow_when_filled():
    white = np.full((4, 3, 3), 255, np.uint8)
    assert np.array_equal(fill_rows(white, 0, 8), np.full((8, 3, 3), 255, np.uint8))


def test_weaving_and_taking_rows_are_inverse():
    image = RNG.integers(0, 256, (8, 5, 3), dtype=np.uint8)
    assert np.array_equal(weave(image[0::2], image[1::2]), image)
