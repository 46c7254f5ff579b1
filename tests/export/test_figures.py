from dataclasses import replace

import cv2
import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from airborne.evaluation import DigitisedPoses, Truth
from airborne.export import panels
from airborne.export.error_figures import (
    _align_by_symmetry,
    _align_rows,
    _differences,
    _match_revolutions,
    write_digitised,
    write_errors,
)
from airborne.export.figures import (
    JOINT_COLOURS,
    joint_status_figure,
    joints_figure,
    write_figures,
    write_flight_figure,
    write_joints_figure,
    write_pose,
)
from airborne.motion import JointStatus, joint_angles, joint_statuses, landmarks
from airborne.motion.joints import doubtful_segments, main_joints
from tests.support.export_scenes import BOX, HALF_TURN, PERSON, person_run, run
from tests.support.plain_figures import leave_figures_plain
from tests.support.tolerances import ROUNDTRIP

NAMES = ["digitised.png", "errors.png", "pose.png", "score.png"]


@pytest.fixture(autouse=True)
def small_figures(monkeypatch):
    monkeypatch.setattr(panels, "DPI", 50)


@pytest.fixture
def _plain(monkeypatch):
    leave_figures_plain(monkeypatch)


def truth_of(motion):
    return Truth(index=motion.index, time_s=motion.time_s, position=motion.position, R=motion.R)


def digitised_of(motion):
    return DigitisedPoses(index=motion.index, position=motion.position, R=motion.R, residual=np.zeros((len(motion), 4)))


@pytest.mark.parametrize(
    "motion",
    [run(lost=(4, 5), uncertain=(6,), unseen=(9,)), run(1), run(3, lost=(0, 1, 2))],
    ids=["mixed", "one frame", "all lost"],
)
def test_every_figure_is_written_at_report_width_whatever_the_run_holds(tmp_path, motion):
    settings = dict(matplotlib.rcParams)
    sound = run()
    write_figures(tmp_path, motion, BOX)
    write_errors(tmp_path / "errors.png", motion, truth_of(sound), (np.eye(3),))
    write_digitised(tmp_path / "digitised.png", motion, digitised_of(sound), (np.eye(3),))
    assert sorted(path.name for path in tmp_path.iterdir()) == NAMES
    for name in NAMES:
        assert cv2.imread(str(tmp_path / name)).shape[1] == panels.WIDTH_IN * panels.DPI
    assert dict(matplotlib.rcParams) == settings


@pytest.mark.usefixtures("_plain")
def test_an_infinite_deviation_shows(tmp_path):
    observed, unseen = run(), run(unseen=(9,))
    write_pose(tmp_path / "seen.png", observed)
    write_pose(tmp_path / "unseen.png", unseen)
    assert (tmp_path / "seen.png").read_bytes() != (tmp_path / "unseen.png").read_bytes()


@pytest.mark.usefixtures("_plain")
def test_a_motion_rotated_by_a_symmetry_of_the_body_gives_the_same_figure(tmp_path):
    motion = run(lost=(4, 5))
    turned = replace(motion, R=motion.R @ HALF_TURN)
    for name, displayed, symmetries in (
        ("plain", motion, [np.eye(3), HALF_TURN]),
        ("alike", turned, [np.eye(3), HALF_TURN]),
        ("rigid", turned, [np.eye(3)]),
    ):
        write_errors(tmp_path / f"{name}.png", displayed, truth_of(run()), symmetries)
    plain, alike, rigid = ((tmp_path / f"{name}.png").read_bytes() for name in ("plain", "alike", "rigid"))
    assert plain == alike
    assert plain != rigid


def test_differences_are_motion_minus_reference_in_millimetres_and_degrees():
    motion = run(lost=(3,))
    reference = _align_rows(motion, np.arange(20), run().position - [0.001, 0, -0.002], run().R)
    position_mm, angle_deg = _differences(motion, reference)
    assert np.isnan(position_mm[3]).all() and np.isnan(angle_deg[3]).all()
    is_known = np.arange(20) != 3
    np.testing.assert_allclose(position_mm[is_known], np.tile([1.0, 0, -2.0], (19, 1)), atol=ROUNDTRIP)
    np.testing.assert_allclose(angle_deg[is_known], 0, atol=1e-6)  # degrees, through arc functions


def test_one_symmetry_is_chosen_for_the_whole_run():
    motion = run()
    R = motion.R.copy()
    R[:5] = R[:5] @ HALF_TURN
    reference = _align_rows(motion, np.arange(20), motion.position, motion.R)
    chosen = _align_by_symmetry(replace(motion, R=R), reference, [np.eye(3), HALF_TURN])
    np.testing.assert_allclose(chosen.R, R)


def test_reference_angles_lie_in_the_revolution_of_the_tracked_ones():
    tracked = np.array([[370.0, 1.0, -350.0], [np.nan] * 3, [380.0, 1.0, -340.0]])
    reference = np.array([[12.0, 1.0, 9.0], [15.0, 1.0, 15.0], [21.0, 1.0, 22.0]])
    np.testing.assert_allclose(_match_revolutions(tracked, reference), reference + np.array([360, 0, -360]))


def test_the_line_breaks_where_frames_are_lost_and_the_gap_is_shaded():
    motion = run(lost=(4, 5))
    axes = Figure().subplots()
    panels.draw_estimate(axes, motion, motion.position[:, 0])
    line, tracked, uncertain = axes.lines
    assert np.flatnonzero(np.isnan(np.asarray(line.get_ydata()))).tolist() == [4, 5]
    assert len(np.asarray(tracked.get_xdata())) == 18
    assert len(np.asarray(uncertain.get_xdata())) == 0
    (span,) = axes.patches
    x = span.get_extents().transformed(axes.transData.inverted())
    assert (x.x0, x.x1) == pytest.approx((0.07, 0.11))


def test_the_band_is_two_standard_deviations_wide_and_absent_where_they_are_infinite():
    axes = Figure().subplots()
    panels.draw_band(axes, np.arange(5.0), np.full(5, 3.0), np.array([0.5, 0.5, np.inf, 0.5, 0.5]))
    (band,) = axes.collections
    corners = np.concatenate([path.vertices for path in band.get_paths()])
    assert corners[:, 1].min() == 2.0
    assert corners[:, 1].max() == 4.0
    assert 2.0 not in corners[:, 0]


def test_a_frame_alone_has_a_band_that_can_be_seen():
    axes = Figure().subplots()
    panels.draw_band(axes, np.arange(4.0), np.full(4, 3.0), np.array([np.inf, 0.5, np.inf, np.inf]))
    _, band = axes.collections
    box = band.get_paths()[0].get_extents()
    assert box.extents.tolist() == [0.75, 2.0, 1.25, 4.0]


@pytest.fixture
def plotted(monkeypatch):
    """Everything plotted as an estimate: panel label -> values; labels are set after plotting."""
    by_axes, plotted = {}, {}
    draw_estimate, label_panel = panels.draw_estimate, panels.label_panel

    def draw(axes, motion, values, *statuses):
        by_axes[axes] = values
        draw_estimate(axes, motion, values, *statuses)

    def label(axes, text):
        plotted[text] = by_axes[axes]
        label_panel(axes, text)

    monkeypatch.setattr(panels, "draw_estimate", draw)
    monkeypatch.setattr(panels, "label_panel", label)
    return plotted


@pytest.mark.parametrize(
    "motion", [person_run(lost=(3,), unseen=(5,)), person_run(1), person_run(3, lost=(0, 1, 2))],
    ids=["mixed", "one frame", "all lost"],
)  # fmt: skip
def test_a_body_with_joints_and_masses_gets_three_more_figures(tmp_path, motion):
    write_figures(tmp_path, motion, PERSON)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["flight.png", "joint_status.png", "joints.png", "pose.png", "score.png"]
    for name in names:
        assert cv2.imread(str(tmp_path / name)).shape[1] == panels.WIDTH_IN * panels.DPI


@pytest.mark.usefixtures("_plain")
def test_joints_without_masses_get_no_flight(tmp_path):
    weightless = replace(PERSON, segments=tuple(replace(segment, inertia=None) for segment in PERSON.segments))
    write_figures(tmp_path, person_run(), weightless)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["joint_status.png", "joints.png", "pose.png", "score.png"]


@pytest.mark.usefixtures("_plain")
def test_flexion_is_positive_in_every_joint_plotted(tmp_path, plotted):
    write_joints_figure(tmp_path / "joints.png", person_run(), PERSON)
    assert len(plotted) == 8
    bent = np.degrees(0.05 * np.arange(12))
    for label, values in plotted.items():
        expected = bent if label in ("knee left [°]", "elbow left [°]") else 0 * bent
        np.testing.assert_allclose(values, expected, atol=1e-9, err_msg=label)


@pytest.mark.usefixtures("_plain")
def test_an_unobservable_joint_is_marked(tmp_path):
    write_joints_figure(tmp_path / "seen.png", person_run(), PERSON)
    write_joints_figure(tmp_path / "unseen.png", person_run(unseen=(5, 6)), PERSON)
    assert (tmp_path / "seen.png").read_bytes() != (tmp_path / "unseen.png").read_bytes()


def test_an_angle_is_uncertain_where_a_segment_of_it_is_not_tracked_and_unknown_where_no_image_shows_it():
    motion = person_run(unseen=(5,))
    motion = replace(motion, uncertain_joints=np.zeros((len(motion), len(motion.joints)), bool))
    motion.uncertain_joints[2, motion.joints.index("shank_left")] = True
    shown = joints_figure(motion, PERSON)
    said = [text.get_text() for text in shown.legends[0].get_texts()]
    doubtful = doubtful_segments(motion, PERSON)
    segments = [segment for segment, *_ in main_joints(motion.joints)]
    at = [PERSON.index_of(segment) for segment in segments]
    n = sum(int(doubtful[:, [k, PERSON.parents[k]]].any(axis=1).sum()) for k in at)
    n_unknown = int(np.isinf(joint_angles(motion, PERSON)["angle_sd"].sel(axis="x", joint=segments)).sum())
    assert 0 < n_unknown < n < 8 * len(motion)
    assert f"tracked ({8 * len(motion) - n})" in said and f"uncertain ({n - n_unknown})" in said
    assert f"unknown, in no image ({n_unknown})" in said  # hatched, and without a marker


def test_the_status_of_each_joint_is_drawn_over_the_whole_run():
    motion = person_run(lost=(3,), unseen=(5,))
    (axes,) = joint_status_figure(motion, PERSON).axes
    status = joint_statuses(motion, PERSON, landmarks(motion, PERSON)[1])
    period_s, drawn_s = motion.time_s[1] - motion.time_s[0], {}
    for bars in axes.collections:
        (colour,) = {to_hex(each) for each in bars.get_facecolor()} or {None}
        widths_s = sum(np.ptp(path.vertices[:, 0]) for path in bars.get_paths())
        drawn_s[colour] = drawn_s.get(colour, 0.0) + widths_s
    for each in JointStatus:
        expected_s = np.sum(status == each.value) * period_s
        assert drawn_s.get(JOINT_COLOURS[each], 0.0) == pytest.approx(expected_s), each
    assert [text.get_text() for text in axes.get_yticklabels()] == [mark.name for mark in PERSON.landmarks]


def test_the_legend_lies_within_the_figure_however_much_it_has_to_say(tmp_path, monkeypatch):
    widths = []
    save = Figure.savefig

    def check_legend(figure, path, **options):
        save(figure, path, **options)
        legend = figure.legends[0].get_window_extent()
        widths.append((legend.x0 / figure.bbox.width, legend.x1 / figure.bbox.width))

    monkeypatch.setattr(Figure, "savefig", check_legend)
    motion = person_run(lost=(3,), unseen=(5,), raised=np.pi / 2)
    write_joints_figure(tmp_path / "joints.png", motion, PERSON)
    write_pose(tmp_path / "pose.png", run(lost=(4, 5), uncertain=(6,), unseen=(9,)))
    assert min(left for left, _ in widths) > 0
    assert max(right for _, right in widths) < 1


def test_other_bodies_show_their_first_joints():
    assert main_joints(["flipper", "tail"]) == [("flipper", "flipper, x", 1.0), ("tail", "tail, x", 1.0)]
    assert len(main_joints([f"link {k}" for k in range(30)])) == 8


@pytest.mark.usefixtures("_plain")
def test_the_height_of_a_falling_rigid_body_is_a_parabola_and_its_momentum_is_none(tmp_path, plotted):
    write_flight_figure(tmp_path / "flight.png", person_run(bent=0.0), PERSON)
    height, *momenta = plotted.values()
    np.testing.assert_allclose(np.diff(height, 2), -9.81 / 50**2, atol=1e-9)
    np.testing.assert_allclose(momenta, 0, atol=1e-9)
