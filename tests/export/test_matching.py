import cv2

from airborne.export.matching import TITLES, MatchingPicture, _row
from airborne.tracking import Status
from tests.support.export_scenes import RIG, SCENE_GREY, frames, posed


def test_the_first_tracked_frame_is_drawn_and_no_other(tmp_path):
    path = tmp_path / "matching.png"
    with MatchingPicture(path, RIG) as picture:
        picture.write(frames(0), posed(), Status.UNCERTAIN)
        assert not path.exists()
        picture.write(frames(1), posed(), Status.TRACKED)
        first = path.read_bytes()
        picture.write(frames(2), posed(), Status.TRACKED)
    assert path.read_bytes() == first
    height, width = cv2.imread(str(path)).shape[:2]
    assert width / height > len(TITLES) / (len(RIG) + 1)


def test_through_the_mask_is_the_image_inside_and_black_elsewhere():
    observed, _, mask, through, match = _row(frames().views[0], RIG.cameras[0], posed())
    assert (through[mask > 0] == observed[mask > 0]).all()
    assert not through[mask == 0].any() and not match[mask == 0].any()
    assert (observed == SCENE_GREY).all()


def test_a_missing_view_leaves_its_row_empty():
    assert _row(None, RIG.cameras[0], posed()) == [None] * len(TITLES)
