import av
import numpy as np
import pytest

from airborne.video.pixels import field_frame, frame_from_rgb, rgb_from_frame, weave_frame

RNG = np.random.default_rng(5)
RED_BLUE_SHARE = {1: (0.2126, 0.0722), 5: (0.299, 0.114), 6: (0.299, 0.114), 9: (0.2627, 0.0593)}  # by matrix tag
UNTAGGED, LIMITED, FULL = 2, 1, 2


def plane_array(plane, dtype=np.uint8):
    n = abs(plane.line_size) // np.dtype(dtype).itemsize
    return np.frombuffer(plane, dtype).reshape(plane.height, n)[:, : plane.width]


def random_frame(pix_fmt, width=64, height=48, low=60, high=190, dtype=np.uint8):
    """A frame of flat blocks of 16 × 16 luma pixels."""
    frame = av.VideoFrame(width, height, pix_fmt)
    for plane in frame.planes:
        rows = np.frombuffer(plane, dtype).reshape(plane.height, -1)
        block = (16 * plane.height // height, 16 * rows.shape[1] // width)
        blocks = RNG.integers(low, high, (height // 16 + 1, width // 16 + 1))
        rows[:] = np.kron(blocks, np.ones(block, int))[: rows.shape[0], : rows.shape[1]]
    return frame


def closed_form_rgb(y, u, v, matrix, is_full):
    """ITU-R BT.601, BT.709 and BT.2020, 8 bits."""
    red, blue = RED_BLUE_SHARE[matrix]
    y, u, v = (np.asarray(a, float) for a in (y, u, v))
    luma, cb, cr = (y / 255, (u - 128) / 255, (v - 128) / 255) if is_full else (
        (y - 16) / 219, (u - 128) / 224, (v - 128) / 224
    )  # fmt: skip
    r, b = luma + 2 * (1 - red) * cr, luma + 2 * (1 - blue) * cb
    g = (luma - red * r - blue * b) / (1 - red - blue)
    return np.clip(255 * np.stack([r, g, b], -1), 0, 255)


@pytest.mark.parametrize("matrix", RED_BLUE_SHARE)
@pytest.mark.parametrize("colour_range", [LIMITED, FULL])
def test_colours_follow_the_files_matrix_and_range(matrix, colour_range):
    frame = random_frame("yuv444p")
    frame.colorspace, frame.color_range = matrix, colour_range
    expected = closed_form_rgb(*map(plane_array, frame.planes), matrix, colour_range == FULL)
    assert np.abs(rgb_from_frame(frame, short_side=48) - expected).max() < 0.51


@pytest.mark.parametrize(("short_side", "matrix"), [(576, 6), (720, 1)])
def test_untagged_colours_are_bt601_up_to_576_lines_and_bt709_above(short_side, matrix):
    frame = random_frame("yuv444p")
    frame.colorspace = UNTAGGED
    expected = closed_form_rgb(*map(plane_array, frame.planes), matrix, is_full=False)
    assert np.abs(rgb_from_frame(frame, short_side=short_side) - expected).max() < 0.51


@pytest.mark.parametrize("pix_fmt", ["yuv420p", "yuv422p"])
def test_subsampled_colours_have_no_bias(pix_fmt):
    frame = random_frame(pix_fmt)
    frame.colorspace = 1
    y, u, v = (np.kron(p, np.ones((48 // p.shape[0], 64 // p.shape[1]))) for p in map(plane_array, frame.planes))
    inside = (np.arange(48) % 16 // 4 % 3 > 0)[:, None] & (np.arange(64) % 16 // 4 % 3 > 0)  # away from block edges
    error = (rgb_from_frame(frame, short_side=720) - closed_form_rgb(y, u, v, 1, is_full=False))[inside]
    assert abs(error.mean()) < 0.1
    assert np.abs(error).max() < 1


def test_ten_bits_come_out_as_the_same_colours_in_eight():
    ten = random_frame("yuv444p10le", low=240, high=760, dtype=np.uint16)
    ten.colorspace = 1
    y, u, v = (plane_array(plane, np.uint16) / 4 for plane in ten.planes)
    assert np.abs(rgb_from_frame(ten, short_side=720) - closed_form_rgb(y, u, v, 1, is_full=False)).max() < 1.01


def test_rgb_and_grey_frames_keep_their_levels():
    image = RNG.integers(0, 256, (48, 64, 3), dtype=np.uint8)
    packed = av.VideoFrame.from_ndarray(image).reformat(format="bgr0")
    assert np.array_equal(rgb_from_frame(packed, short_side=48), image)
    grey = av.VideoFrame.from_ndarray(image[..., 0], format="gray")
    assert np.array_equal(rgb_from_frame(grey, short_side=48), np.repeat(image[..., :1], 3, axis=2))


@pytest.mark.parametrize("pix_fmt", ["yuv420p", "yuv422p", "yuv444p", "yuv420p10le", "nv12", "bgr0", "gray"])
def test_parting_and_weaving_frames_are_inverse(pix_fmt):
    frame = random_frame(pix_fmt)
    again = weave_frame(field_frame(frame, 0), field_frame(frame, 1))
    for before, after in zip(frame.planes, again.planes, strict=True):
        assert bytes(before) == bytes(after)


def test_a_fields_colours_are_those_of_the_whole_frame_where_no_chroma_is_shared():
    frame = random_frame("yuv444p")
    whole = rgb_from_frame(frame, short_side=48)
    for parity in (0, 1):
        assert np.array_equal(rgb_from_frame(field_frame(frame, parity), short_side=48), whole[parity::2])


@pytest.mark.parametrize("pix_fmt", ["yuv420p", "yuv422p"])
def test_chroma_of_the_two_fields_never_mixes(pix_fmt):
    colours = np.array([[200, 30, 30], [30, 30, 200]], np.uint8)
    fields = [frame_from_rgb(np.full((24, 64, 3), c, np.uint8), short_side=48, pix_fmt=pix_fmt) for c in colours]
    frame = weave_frame(*fields)
    for parity, colour in enumerate(colours):
        rgb = rgb_from_frame(field_frame(frame, parity), short_side=48)
        assert np.abs(rgb.astype(int) - colour).max() <= 2


@pytest.mark.parametrize("short_side", [576, 1080])
def test_colours_survive_the_way_to_a_frame_and_back(short_side):
    for colour in RNG.integers(0, 256, (20, 3)):
        image = np.broadcast_to(colour.astype(np.uint8), (16, 16, 3))
        again = rgb_from_frame(frame_from_rgb(image, short_side=short_side), short_side=short_side)
        assert np.abs(again.astype(int) - colour).max() <= 2


def test_a_quarter_turn_is_anticlockwise():
    image = RNG.integers(0, 256, (4, 6, 3), dtype=np.uint8)
    turned = rgb_from_frame(av.VideoFrame.from_ndarray(image), short_side=4, rotation_deg=90)
    assert np.array_equal(turned[-1, 0], image[0, 0])
    assert turned.shape == (6, 4, 3)
