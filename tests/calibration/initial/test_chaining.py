"""Where cameras begin from what they see of a board."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.bundle import adjust
from airborne.calibration.initial.chaining import Views, board_poses, board_source, chain_cameras, initial_lens
from airborne.calibration.intrinsics.lens_selection import choose_lens
from airborne.calibration.sources.boards import NO_CORNERS
from airborne.cameras import Rig
from airborne.errors import CalibrationError
from tests.support.rigs import BOARD, FISHEYE, SIZE, apart, boards, observe_board, ring


@pytest.mark.parametrize("lens", ["brown", "fisheye"])
def test_a_focal_length_is_begun_near_the_true_one(lens):
    rig = Rig(ring(1, distortion=FISHEYE if lens == "fisheye" else np.zeros(5), lens=lens).cameras)
    views = observe_board(np.random.default_rng(0), rig, boards(np.random.default_rng(1), 40)).of_camera(0)
    camera, places = initial_lens(views, SIZE, lens=lens)
    assert camera.K[0, 0] == pytest.approx(rig.cameras[0].K[0, 0], rel=0.25)
    assert camera.lens == lens
    assert len(places) == views.n_moments


def test_cameras_are_linked_along_shared_views():
    rng = np.random.default_rng(2)
    rig = ring(4)
    views = observe_board(rng, rig, boards(rng, 80))
    found, places = chain_cameras(rig.cameras, views)
    np.testing.assert_allclose(apart(found), apart(rig), atol=0.08)
    assert len(places) == 80
    fit = adjust(found, [board_source(views, places)])
    np.testing.assert_allclose(apart(fit.rig), apart(rig), atol=0.03)


def test_cameras_without_shared_views_are_named():
    rng = np.random.default_rng(3)
    rig = ring(3)
    views = observe_board(rng, rig, boards(rng, 40))
    rows = [list(row) for row in views.detections]
    for moment in range(40):
        if moment % 2:
            rows[2][moment] = NO_CORNERS
        else:
            rows[0][moment] = rows[1][moment] = NO_CORNERS
    apart_views = replace(views, detections=tuple(map(tuple, rows)))
    assert sorted(map(len, apart_views.groups())) == [1, 2]
    with pytest.raises(CalibrationError, match=r"shared between cam2 and .*cam"):
        chain_cameras(rig.cameras, apart_views)


def test_boards_are_placed_by_a_known_rig():
    rng = np.random.default_rng(4)
    rig = ring(3, distortion=np.zeros(5))
    places = boards(rng, 20)
    views = observe_board(rng, rig, places, noise_px=0.05)
    found = board_poses(rig, views)
    seen = (views.n_corners > 0).any(axis=0)
    off = np.linalg.norm(found.translation - places.translation, axis=1)[seen]
    assert np.median(off) < 0.003


def test_a_camera_that_never_sees_the_board_is_named():
    views = Views(BOARD, ("left",), ((NO_CORNERS,) * 5,))
    with pytest.raises(CalibrationError, match="camera 'left' shows the board in 0 images"):
        choose_lens(views.of_camera(0), SIZE)


def test_no_more_of_a_lens_is_found_than_held_out_images_tell():
    rng = np.random.default_rng(5)
    for distortion, expected in ((np.zeros(5), "focal"), (np.array([-0.25, 0, 0, 0, 0]), "focal + k1")):
        rig = Rig(ring(1, distortion=distortion).cameras)
        fit = choose_lens(observe_board(rng, rig, boards(rng, 30)).of_camera(0), SIZE)
        assert fit.model == expected
        assert fit.camera.K[0, 0] == pytest.approx(rig.cameras[0].K[0, 0], rel=0.02)
        assert len(fit.held_out_rms_px) == 5
