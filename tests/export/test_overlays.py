from fractions import Fraction

import av
import numpy as np
import pytest

from airborne.body import surface_arrays
from airborne.cameras import Rig
from airborne.errors import VideoError
from airborne.export.overlays import LONGEST_SIDE_PX, OverlayVideos, draw_label
from airborne.export.palette import STATUS_RGB
from airborne.export.views import resample_view
from airborne.rendering import FLAT, render
from airborne.tracking import Status
from airborne.video import View
from tests.support.export_scenes import BOX, RIG, SCENE_GREY, camera, frames, posed

CODED = 30  # grey levels that 4:2:0 coding may move a thin coloured line


def pictures(path):
    with av.open(str(path)) as video:
        return [frame.to_ndarray(format="rgb24").astype(int) for frame in video.decode(video=0)]


def write_videos(folder, shots, rig=RIG):
    with OverlayVideos(folder, rig, Fraction(50)) as videos:
        for shot in shots:
            videos.write(*shot)
    return [pictures(folder / f"overlay_{name}.mp4") for name in rig.names]


def far_from(picture, rgb):
    return np.abs(picture - np.array(rgb)).max(axis=-1)


@pytest.mark.parametrize("status", [Status.TRACKED, Status.UNCERTAIN])
def test_the_outline_has_the_colour_of_the_status_and_hides_none_of_the_body(tmp_path, status):
    rig = Rig((camera(size=(960, 720)),))
    body = posed(position=(0.1, 0.0, -0.1))
    ((picture,),) = write_videos(tmp_path, [(frames(rig=rig), body, status)], rig)
    mask = render(surface_arrays(BOX), body, rig.cameras[0], FLAT).mask
    rows, columns = np.nonzero(mask)
    middle, left = round(rows.mean()), columns.min()
    line = picture[middle, left - 2]
    others = [rgb for other, rgb in STATUS_RGB.items() if other is not status] + [(SCENE_GREY,) * 3, (0, 0, 0)]
    assert far_from(line, STATUS_RGB[status]) < min(far_from(line, rgb) for rgb in others)
    inside = picture[rows.min() + 4 : rows.max() - 3, columns.min() + 4 : columns.max() - 3]
    assert far_from(inside, [SCENE_GREY] * 3).max() < CODED


def test_a_segment_that_is_in_doubt_has_the_colour_of_an_uncertain_frame(tmp_path):
    rig = Rig((camera(size=(960, 720)),))
    shots = [(frames(k, rig=rig), posed(), Status.TRACKED, np.array([k == 1])) for k in range(2)]
    ((sure, doubtful),) = write_videos(tmp_path, shots, rig)
    mask = render(surface_arrays(BOX), posed(), rig.cameras[0], FLAT).mask
    rows, columns = np.nonzero(mask)
    at = round(rows.mean()), columns.min() - 2
    for picture, status in ((sure, Status.TRACKED), (doubtful, Status.UNCERTAIN)):
        off = {each: far_from(picture[at], rgb) for each, rgb in STATUS_RGB.items()}
        assert min(off, key=off.__getitem__) is status


@pytest.mark.parametrize("height", [48, 240, 1080])
def test_a_label_holds_the_cameras_name_where_it_fits_and_never_hides_the_time(height):
    blank, near, far, long = (np.full((height, 4 * height, 3), SCENE_GREY, np.uint8) for _ in range(4))
    for image, name in ((blank, ""), (near, "cam1"), (far, "日本"), (long, "x" * 80)):
        draw_label(image, "frame 3", name, STATUS_RGB[Status.TRACKED])
    is_box = (blank != SCENE_GREY).any(axis=2)
    numbers = int(np.flatnonzero(is_box.any(axis=0)).max()) - np.count_nonzero(is_box.any(axis=1)) // 2  # their end
    for image in (near, far, long):
        np.testing.assert_array_equal(image[:, :numbers], blank[:, :numbers])
        assert image[:, numbers:].max() > SCENE_GREY + 50
    assert not np.array_equal(near, far)


@pytest.mark.parametrize("size", [(1280, 720), (1280, 725), (640, 360)])
def test_a_label_fits_into_an_upright_image_with_its_name(size):
    image = np.full((*size, 3), SCENE_GREY, np.uint8)
    draw_label(image, "frame 100   1.667 s   uncertain", "cam01", STATUS_RGB[Status.UNCERTAIN])
    columns = np.flatnonzero((image != SCENE_GREY).any(axis=(0, 2)))
    assert columns.max() < size[1] - columns.min()


def test_a_lost_frame_has_a_border_and_no_outline(tmp_path):
    ((lost, result), _) = write_videos(tmp_path, [(frames(0), None, Status.LOST), (frames(1), posed(), Status.TRACKED)])
    assert far_from(lost[1, 100:-100], STATUS_RGB[Status.LOST]).mean() < CODED
    assert far_from(result[1, 100:-100], STATUS_RGB[Status.LOST]).mean() > 3 * CODED
    assert far_from(lost[60:-10, 10:-10], [SCENE_GREY] * 3).max() < CODED
    assert far_from(result[60:-10, 10:-10], [SCENE_GREY] * 3).max() > CODED


def test_a_missing_view_is_a_dark_image_of_the_same_size_that_says_so(tmp_path):
    observed, missing = write_videos(tmp_path, [(frames(missing=(1,)), posed(), Status.TRACKED)])
    assert observed[0].shape == missing[0].shape
    assert np.median(missing[0]) < SCENE_GREY / 2
    assert missing[0][60:-60].max() > SCENE_GREY  # the words


def test_every_time_gives_one_frame_in_every_video(tmp_path):
    shots = [(frames(i, missing=(i % 2,)), None, Status.LOST) for i in range(5)]
    assert [len(video) for video in write_videos(tmp_path, shots)] == [5, 5]


def test_large_images_are_reduced_in_proportion(tmp_path):
    rig = Rig((camera(size=(2 * LONGEST_SIDE_PX, LONGEST_SIDE_PX)),))
    ((picture,),) = write_videos(tmp_path, [(frames(rig=rig), posed(), Status.TRACKED)], rig)
    assert picture.shape == (LONGEST_SIDE_PX // 2, LONGEST_SIDE_PX, 3)


def test_a_static_scene_does_not_move_between_its_fields():
    whole = camera()
    rows = np.arange(whole.size[1], dtype=float)[:, None, None]
    scene = np.broadcast_to(128 + 100 * np.sin(rows / 15), (whole.size[1], whole.size[0], 3)).round().astype(np.uint8)
    for parity in (0, 1):
        displayed = resample_view(View(whole.field(parity), scene[parity::2]), whole)
        assert displayed.shape == scene.shape
        np.testing.assert_array_equal(displayed[parity::2][1:-1], scene[parity::2][1:-1])
        assert np.abs(displayed[2:-2].astype(int) - scene[2:-2]).max() <= 2


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(VideoError, match="overlay_cam1"):
        OverlayVideos(tmp_path / "missing", RIG, Fraction(50))
