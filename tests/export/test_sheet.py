import cv2
import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose, human18
from airborne.export.sheet import BACKGROUND_GREY, N_BUFFERED, ContactSheet, _cell
from airborne.export.views import CELL_PX, CROP_MARGIN, _points, crop_camera
from airborne.tracking import Status
from tests.support.export_scenes import BALL, BOX, RIG, SCENE_GREY, camera, frames, posed


def shown_px(camera, position):
    view = frames(rig=[camera]).views[0]
    cell = _cell(view, camera, posed(BALL, position))
    return np.sum(cell[..., 0] != BACKGROUND_GREY)


@pytest.mark.parametrize("distance_m", [3.0, 12.0])
@pytest.mark.parametrize("position", [(0, 0, 0), (0.3, 2.0, -0.2)])
def test_the_body_has_one_size_in_all_cells_however_far_it_is(distance_m, position):
    disc_px = np.pi / 4 * (CELL_PX / CROP_MARGIN) ** 2
    assert shown_px(camera(distance_m=distance_m), position) == pytest.approx(disc_px, rel=0.04)


def test_a_cell_shows_the_scene_inside_the_mask_only():
    cell = _cell(frames().views[0], RIG.cameras[0], posed())
    assert set(np.unique(cell)) == {SCENE_GREY, BACKGROUND_GREY}


def test_fields_and_whole_frames_give_the_same_cell():
    whole = camera()
    observed = [shown_px(view, (0.2, 0, 0.1)) for view in (whole, whole.field(0), whole.field(1))]
    assert observed[1:] == pytest.approx([observed[0]] * 2, rel=0.01)


def test_there_is_no_cell_behind_the_camera_or_without_a_view():
    assert crop_camera(camera(), posed(BALL, (0, -10.0, 0))) is None
    assert _cell(None, camera(), posed()) is None


def test_memory_stays_flat_and_the_times_evenly_spaced(tmp_path):
    with ContactSheet(tmp_path / "sheet.png", RIG) as sheet:
        for i in range(150):
            sheet.write(frames(i), posed(BOX, (0.01 * i, 0, 0)), Status.TRACKED)
            assert len(sheet._columns) <= N_BUFFERED
        held = [int(column.title.text.split()[1]) for column in sheet._columns]
    assert held[0] == 0
    assert set(np.diff(held)) == {8}
    assert held[-1] > 150 - 2 * 8


def test_the_sheet_is_written_with_a_row_for_each_camera_and_missing_views(tmp_path):
    path = tmp_path / "sheet.png"
    with ContactSheet(path, RIG) as sheet:
        for i in range(3):
            sheet.write(frames(i, missing=(i % 2,)), posed(), Status.UNCERTAIN)
    height, width = cv2.imread(str(path)).shape[:2]
    assert height < width


def test_no_sheet_is_left_where_the_body_was_never_found(tmp_path):
    path = tmp_path / "sheet.png"
    path.write_text("of an earlier run")
    with ContactSheet(path, RIG) as sheet:
        sheet.write(frames(), None, Status.LOST)
    assert not path.exists()


@pytest.mark.parametrize("raised_deg", [0, 90, 180])
def test_a_person_with_raised_arms_is_whole(raised_deg):
    person = human18(1.75, 70.0)
    angles = np.zeros((person.n_joints, 3))
    for side in ("left", "right"):
        angles[person.index_of(f"upper_arm_{side}") - 1, 0] = np.radians(raised_deg)
    body = person.with_pose(Pose(world_from_root=RigidTransform.identity(), joint_angles=angles))
    crop = crop_camera(camera(distance_m=8.0), body)
    px = crop.px_from_world(_points(body))
    assert np.all((px > 0) & (px < CELL_PX - 1))
    assert np.ptp(px, axis=0).max() > CELL_PX / 2
