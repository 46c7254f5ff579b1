"""The image regions, and what is learned from the first of them."""

import numpy as np
import pytest

from airborne.appearance.hue_saturation import OUTSIDE, hsv_bins
from airborne.tracking.particle.image_regions import LEARNING_MARGIN_M, is_in_image, region_of, regions_of
from airborne.tracking.particle.observations import observe
from airborne.tracking.particle.parts import N_PARTS, PARTS, PELVIS, SHANKS, SHOES, ends_of
from airborne.tracking.particle.parts import SKIN as SKIN_CLASS
from airborne.tracking.particle.references import learn_references
from tests.support.courts import FLOOR, SIZE, SKIN, Court, Player
from tests.support.courts import SHORTS as SHORTS_RGB

COURT = Court(players=(Player("one"),))
POINTS = COURT.players[0].points(0)
ENDS = ends_of(POINTS[None])[0]
ALL = np.ones((N_PARTS, 3), bool)
OUT, UP = np.array([0.1, 0, 0]), np.array([0, 0, 0.1])


def learned(used=ALL, leave_out=None, ends=ENDS, **more):
    regions = regions_of(COURT.frames(0), POINTS, LEARNING_MARGIN_M)
    if leave_out is not None:
        regions[leave_out] = None
    return learn_references(regions, ends, PARTS, used=used, **more)


def bin_of(rgb):
    return hsv_bins(np.array(rgb) // 8 * 8 + 3.5)


def test_a_region_holds_all_points_and_is_where_it_says():
    frames = COURT.frames(0)
    for view, region in zip(frames.views, regions_of(frames, POINTS), strict=True):
        px = view.camera.px_from_world(POINTS) - region.corner
        assert (px >= 0).all() and (px <= np.array(region.rgb.shape[1::-1]) - 1).all()
        x, y = region.corner.astype(int)
        assert np.array_equal(region.rgb[0, 0], view.rgb[y, x])


@pytest.mark.parametrize("state", ["none", "dark"])
def test_without_an_image_or_in_the_dark_there_is_no_region(state):
    blind = Court(players=COURT.players, state=lambda index, name: state)
    assert regions_of(blind.frames(0), POINTS) == [None] * 3


@pytest.mark.parametrize("away", [(80.0, 0.0, 0.0), (0.0, -30.0, 0.0)], ids=["beside the image", "behind the camera"])
def test_points_that_the_image_does_not_show_have_no_region(away):
    behind = COURT.frames(0).views[2]
    assert region_of(behind, POINTS + away) is None
    assert not is_in_image(COURT.frames(0), POINTS + away)[2]


def test_one_far_hypothesis_does_not_make_the_region_the_whole_image():
    behind = COURT.frames(0).views[2]
    region = region_of(behind, np.concatenate([POINTS, [[3.0, 0.0, 1.0]]]))
    assert region.rgb.shape[1] < SIZE[0] / 2


def test_parts_are_learned_with_their_own_colours():
    roots = learned().roots
    assert (roots[:, list(PELVIS), bin_of(SHORTS_RGB)] > 0.4).all()
    assert (roots[:, list(SHANKS), bin_of(SKIN)] > 0.4).all()
    assert np.allclose(np.sum(roots**2, axis=-1), 1, atol=1e-5)


def test_the_background_shows_neither_skin_nor_shoes():
    references = learned()
    assert (references.background_share[:, [*SHANKS, *SHOES]] < 0.01).all()
    assert references.parts.classes[list(SHANKS)].tolist() == [SKIN_CLASS] * 2


def test_a_camera_without_a_region_borrows_what_the_others_show():
    roots = learned(leave_out=0).roots
    counts = (learned().roots ** 2)[1:].mean(axis=0)
    assert np.allclose(roots[0] ** 2, counts, atol=1e-5)


def test_a_part_occluded_in_one_camera_borrows_and_one_occluded_in_all_is_learned_from_all():
    used = ALL.copy()
    used[0, 1] = used[1] = False
    roots, plain = learned(used).roots, learned().roots
    assert np.allclose(roots[1, 0] ** 2, (plain[[0, 2], 0] ** 2).mean(axis=0), atol=1e-5)
    assert np.array_equal(roots[:, 1], plain[:, 1])
    assert np.array_equal(roots[:, 2:], plain[:, 2:])


def test_colours_of_the_background_can_be_left_out():
    beside = ENDS + np.array([0.06, 0, 0])  # half on the legs, half on the floor
    plain, dropped = (learned(ends=beside, drops_background=drops).roots for drops in (False, True))
    floor = hsv_bins(np.array(FLOOR))
    assert (plain[2, list(SHANKS), floor] > 0.3).all()
    assert not dropped[2, list(SHANKS), floor].any() and not dropped[..., OUTSIDE].any()
    assert (dropped[2, list(SHANKS), bin_of(SKIN)] > 0.4).all()


def test_the_first_frame_is_likelier_than_a_body_a_hands_width_away():
    observation = observe(learned(), regions_of(COURT.frames(0), POINTS, LEARNING_MARGIN_M), ALL)
    bodies = np.stack([POINTS, POINTS + OUT, POINTS + UP, POINTS - UP])
    here, *elsewhere = observation.log_likelihood(ends_of(bodies), range(N_PARTS)).sum(axis=-1)
    assert here > max(elsewhere) + 1


def test_a_view_that_a_part_does_not_use_does_not_change_its_score():
    regions = regions_of(COURT.frames(0), POINTS, LEARNING_MARGIN_M)
    used = ALL.copy()
    used[3, 2] = False
    references, away = learned(), ENDS[None] + OUT / 2
    some, all_ = (observe(references, regions, u).log_likelihood(away, range(N_PARTS))[0] for u in (used, ALL))
    assert some[3] != all_[3]
    assert np.array_equal(np.delete(some, 3), np.delete(all_, 3))
