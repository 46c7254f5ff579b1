"""Overlay videos of players: the paper's rectangles lie on the legs, the broadcast graphic tells the height."""

from dataclasses import replace
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from airborne.body.legs import RODS, THIGH_WIDTH_M
from airborne.cameras import Rig
from airborne.export.broadcast import ACCENT, UNSURE, Height, Heights, Jumper, draw_heights
from airborne.export.lettering import draw_text, text_width
from airborne.export.palette import STATUS_RGB
from airborne.export.players_overlay import GREEN_RGB, PlayersOverlayVideos, place_name, rectangle_px
from airborne.tracking import Status
from airborne.tracking.players import PlayerStart
from airborne.video import Frames, View
from tests.support.players_trial import LEG_POINTS, PLAYERS, StandIn, camera, points_of

GREY = 120
BIG = camera("left").resample(scale=(0.25, 0.25), offset=(-0.375, -0.375), size=(640, 480))
STARTS = [
    PlayerStart(name=name, joints_m=dict(zip(LEG_POINTS, points_of(x), strict=True))) for name, x in PLAYERS.items()
]


def frames(index=0, *, cameras=(BIG,), missing=False):
    views = [View(each, np.full((each.size[1], each.size[0], 3), GREY, np.uint8)) for each in cameras]
    return Frames(index, Fraction(index, 50), (None,) * len(views) if missing else tuple(views))


def last_picture(folder, shots, style, **kwargs):
    """The last picture of the video of one camera, as it can be seen."""
    folder.mkdir(exist_ok=True)
    with PlayersOverlayVideos(folder, Rig((BIG,)), Fraction(50), style=style, starts=STARTS, **kwargs) as videos:
        for observed, estimates in shots:
            videos.write(observed, LEG_POINTS, estimates)
    with av.open(str(folder / "overlay_left.mp4")) as video:
        return [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)][-1].astype(int)


def player_estimate(index=0, **changes):
    """What the stand-in finds; `changes` are of the first player."""
    first, second = StandIn().step(0, frames(index))[1]
    return replace(first, **changes), second


def is_near(picture, rgb, tolerance=60):
    return np.abs(picture - np.array(rgb)).max(axis=-1) < tolerance


def test_a_rectangle_has_the_rods_axis_and_the_limbs_width():
    upper, lower = np.array([0.1, 0.0, 0.9]), np.array([0.1, 0.0, 0.5])
    corners = rectangle_px(BIG, upper, lower, THIGH_WIDTH_M)
    ends = BIG.px_from_world(np.stack([upper, lower]))
    np.testing.assert_allclose([corners[:2].mean(axis=0), corners[2:].mean(axis=0)], ends, atol=1e-9)
    aside = upper + np.array([THIGH_WIDTH_M, 0, 0])  # across an upright rod that faces the camera
    beside = BIG.px_from_world(aside) - ends[0]
    assert np.linalg.norm(corners[1] - corners[0]) == pytest.approx(np.linalg.norm(beside), rel=1e-9)
    assert rectangle_px(BIG, upper, np.array([0.1, -40.0, 0.5]), 0.1) is None


def test_a_rod_seen_from_its_end_still_has_a_rectangle():
    away = BIG.centre + np.array([0.0, 1.0, 0.0])
    corners = rectangle_px(BIG, away, away + np.array([0.0, 0.5, 0.0]), 0.1)
    assert np.isfinite(corners).all() and np.ptp(corners[:, 0]) > 1


def test_the_papers_rectangles_lie_round_the_legs_in_green(tmp_path):
    picture = last_picture(tmp_path, [(frames(), player_estimate())], "paper")
    green = is_near(picture, GREEN_RGB, 100)
    for x in PLAYERS.values():
        points = points_of(x)
        for (a, b), width_m in zip(RODS, (0.15, 0.15, 0.11, 0.11), strict=True):
            corners = rectangle_px(BIG, points[a], points[b], width_m)
            left = corners[[0, 3]].mean(axis=0).round().astype(int)
            right = corners[[1, 2]].mean(axis=0).round().astype(int)
            middle = corners.mean(axis=0).round().astype(int)
            assert green[left[1] - 2 : left[1] + 3, left[0] - 2 : left[0] + 3].any()
            assert green[right[1] - 2 : right[1] + 3, right[0] - 2 : right[0] + 3].any()
            assert np.abs(picture[middle[1], middle[0]] - GREY).max() < 40


def test_uncertain_players_are_amber_and_lost_ones_are_omitted(tmp_path):
    amber = last_picture(tmp_path / "a", [(frames(), player_estimate(joint_status=6 * (Status.UNCERTAIN,)))], "paper")
    lost = last_picture(
        tmp_path / "b",
        [(frames(), player_estimate(joint_status=6 * (Status.LOST,), points=np.full((6, 3), np.nan)))],
        "paper",
    )
    half = 320
    for picture, shows_amber in ((amber, True), (lost, False)):
        body = picture[80:, :half]  # the first player stands on the left
        assert is_near(body, STATUS_RGB[Status.UNCERTAIN]).any() == shows_amber
        assert not is_near(body, GREEN_RGB, 100).any()
        assert is_near(picture[80:, half:], GREEN_RGB, 100).any()


def test_a_rod_with_an_uncertain_end_is_amber_and_the_others_stay_green(tmp_path):
    hidden = player_estimate(joint_status=(*5 * (Status.TRACKED,), Status.UNCERTAIN))
    picture = last_picture(tmp_path, [(frames(), hidden)], "paper")[80:, :320]
    knee_px = BIG.px_from_world(points_of(PLAYERS["Anna"])[[3]])[0][1] - 80
    is_amber = is_near(picture, STATUS_RGB[Status.UNCERTAIN])
    assert is_amber[int(knee_px) + 20 :].any() and is_near(picture, GREEN_RGB, 100).any()


@pytest.mark.parametrize("style", ["paper", "broadcast"])
def test_a_missing_view_is_grey_and_has_no_graphic(tmp_path, style):
    picture = last_picture(
        tmp_path, [(frames(), player_estimate()), (frames(1, missing=True), player_estimate(1))], style
    )
    assert not is_near(picture, GREEN_RGB, 100).any()
    assert not is_near(picture, ACCENT).any()


def draw(jumpers):
    picture = np.full((480, 640, 3), GREY, np.uint8)
    draw_heights(picture, BIG, jumpers)
    return picture.astype(int)


def test_the_bar_on_the_ruler_ends_at_the_height():
    def top_of_bar(height_m):
        picture = draw([Jumper("Anna", points_of(0.0, height_m), Height(height_m), is_sure=True)])
        column = round(BIG.px_from_world(np.array([0.5, 0.0, 0.3]))[0])
        return np.flatnonzero(is_near(picture[:400, column], ACCENT)).min()

    for height_m in (0.3, 0.6, 0.9):
        expected = BIG.px_from_world(np.array([0.5, 0.0, height_m]))[1]
        assert top_of_bar(height_m) == pytest.approx(expected, abs=4)


def test_the_line_lies_on_the_floor_below_a_player_in_the_air():
    picture = draw([Jumper("Anna", points_of(0.0, 0.5), Height(0.5), is_sure=True)])
    row = round(BIG.px_from_world(np.zeros(3))[1])
    on_line = is_near(picture[row - 1 : row + 2], ACCENT).any(axis=0)
    ends = BIG.px_from_world(np.array([[-0.35, 0, 0], [0.35, 0, 0]]))[:, 0].round().astype(int)
    assert on_line[ends[0] + 2 : ends[1] - 2].all() and not on_line[: ends[0] - 4].any()


def test_uncertain_heights_are_grey():
    picture = draw([Jumper("Anna", points_of(0.0), Height(0.2), is_sure=False)])
    assert not is_near(picture, ACCENT).any()
    assert is_near(picture, UNSURE, 5).any()


def test_rulers_of_two_players_stand_outside_of_both():
    both = [Jumper(name, points_of(x), Height(0.5), is_sure=True) for name, x in PLAYERS.items()]
    picture = draw(both)
    for x, side in zip(PLAYERS.values(), (-1, 1), strict=True):
        column, row = BIG.px_from_world(np.array([x + side * 0.5, 0.0, 0.25])).round().astype(int)
        assert is_near(picture[row, column - 2 : column + 3], ACCENT).any()


def test_heights_count_from_the_feet_at_the_start_and_the_peak_holds_until_the_next_jump():
    heights = Heights(STARTS)
    path = [0.0, 0.02, 0.08, 0.3, 0.5, 0.2, 0.01, 0.06, 0.0, 0.2, 0.35, 0.1, 0.0]
    displayed = [heights.update({"Anna": (points_of(-0.6, z), Status.TRACKED)})["Anna"] for z in path]
    np.testing.assert_allclose([height.now_m for height in displayed], path, atol=1e-12)
    peaks = [height.peak_m for height in displayed]
    assert peaks[:3] == [None] * 3
    np.testing.assert_allclose(peaks[3:], [0.3, 0.5, 0.5, 0.5, 0.5, 0.5, 0.2, 0.35, 0.35, 0.35], atol=1e-12)


def test_an_uncertain_height_is_no_peak():
    heights = Heights(STARTS)
    for z, status in ((0.2, Status.TRACKED), (0.9, Status.UNCERTAIN), (0.3, Status.TRACKED)):
        height = heights.update({"Anna": (points_of(-0.6, z), status)})["Anna"]
    assert height.peak_m == pytest.approx(0.3)


def test_letters_stand_on_their_line_with_their_width_and_holes():
    picture = np.zeros((60, 120, 3), np.uint8)
    draw_text(picture, "O8", (10, 45), size_px=40, rgb=(255, 255, 255), bold=True)
    rows, columns = np.nonzero(picture[..., 0] > 128)
    assert 44 <= rows.max() <= 46 and 14 <= rows.min() <= 18
    assert columns.max() == pytest.approx(10 + text_width("O8", size_px=40, bold=True), abs=1.5)
    n_holes = cv2.connectedComponents((picture[..., 0] < 128).astype(np.uint8))[0] - 2
    assert n_holes == 3
    assert text_width("", size_px=40) == 0


def test_names_that_would_overlap_stand_above_each_other():
    first = place_name(10, 50, (60, 12), [])
    second = place_name(40, 48, (60, 12), [first])
    third = place_name(30, 52, (60, 12), [first, second])
    assert first == (10, 38, 70, 50)
    assert second == (40, 26, 100, 38)
    assert third == (30, 14, 90, 26)
    assert place_name(200, 50, (60, 12), [first, second, third]) == (200, 38, 260, 50)
