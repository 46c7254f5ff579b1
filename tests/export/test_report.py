import re
from dataclasses import replace

import numpy as np
import pytest

from airborne.errors import ResultError
from airborne.evaluation import JointPaths, Truth, compare_joints, compare_motion
from airborne.export import headline, page
from airborne.export.figures import write_figures, write_flight_figure
from airborne.export.page import format_value, label
from airborne.export.report import write_report
from airborne.motion import Motion, flight_summary, landmarks, measure_flight
from airborne.motion.run_folder import figures_of
from tests.support.browser import open_file
from tests.support.export_scenes import BOX, HALF_TURN, PERSON, person_run, run

pytestmark = pytest.mark.usefixtures("_plain_figures")


def html_of(folder, motion, **more):
    return write_report(folder, {"name": "a throw", **headline(motion), **more}).read_text("utf-8")


def test_the_page_needs_nothing_but_itself(tmp_path):
    write_figures(figures_of(tmp_path), run(), BOX)
    html = html_of(tmp_path, run())
    sources = re.findall(r'(?:src|href)\s*=\s*"([^"]{0,30})', html)
    assert len(sources) == 2
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    for word in ("http:", "https:", "<script", "@import", "url("):
        assert word not in html.replace("<!doctype html>", "")


def test_text_of_the_user_is_escaped_wherever_it_stands(tmp_path):
    bad = '<img src=x onerror="alert(1)">&'
    html = html_of(
        tmp_path,
        run(),
        name=bad,
        uncertainty=bad,
        warnings=[bad],
        events=[bad],
        method={bad: bad},
        cameras=[{"name": bad, bad: [bad]}],
        versions={bad: bad},
        inputs={bad: bad},
        timings_s={bad: 1.0},
    )
    assert "<img" not in html
    assert html.count("&lt;img") >= 13


def test_headline_numbers_stand_on_the_page(tmp_path):
    html = html_of(tmp_path, run(21, uncertain=(3,), lost=(20,)))
    for words in ("21 frames: 19 tracked, 1 uncertain, 1 lost", "± 2 mm", "± 0.57°", "0.9500 ± 0.0023 turns", "0.4 s"):
        assert words in html


def test_the_page_fits_a_telephone(tmp_path):
    numbers = {f"{name}_rms_mm": 1.2345 for name in ("calibration", "held_out", "another", "measurement")}
    cameras = [{"name": "cam1", "position_m": [1.4602, -1.9092, 1.8965], **numbers}]
    html_of(tmp_path, run(), cameras=cameras)
    with open_file(tmp_path / "report.html") as page:
        page.set_viewport_size({"width": 390, "height": 844})
        assert page.evaluate("document.documentElement.scrollWidth") == 390


def test_corrections_stand_on_the_page_where_there_are_some(tmp_path):
    assert "Corrections" not in html_of(tmp_path, run())
    html = html_of(tmp_path, run(), keys=[{"frame": 7, "gives": ["clicks by hand"], "sd_px": 5.0}])
    assert "The pose was corrected in 1 frame: 7 (clicks by hand, ± 5 px)." in html


def test_the_unobservable_is_named_and_has_no_number(tmp_path):
    html = html_of(tmp_path, run(unseen=range(20)))
    assert "<b>cannot be seen</b>" in html
    assert "In 20 of 20 frames with a pose" in html
    assert "somersault, first to last pose" not in html
    assert "somersault, first to last pose" in html_of(tmp_path, run(unseen=range(19)))
    assert "inf" not in re.sub(r"infinite|Infinite", "", html)


def test_only_a_run_without_faults_is_called_fine(tmp_path):
    words = "Every frame was tracked"
    assert words in html_of(tmp_path, run())
    for weak in (run(lost=(4,)), run(unseen=(4,)), Motion.collect([])):
        assert words not in html_of(tmp_path, weak)
    assert words not in html_of(tmp_path, run(), warnings=["cam2 does not fit its calibration"])


def test_a_comparison_with_the_truth_becomes_a_table(tmp_path):
    motion = run()
    truth = Truth(
        index=motion.index, time_s=motion.time_s, position=motion.position + np.array([0.003, 0, 0]), R=motion.R
    )
    html = html_of(tmp_path, motion, truth=compare_motion(motion, truth, [np.eye(3), HALF_TURN]).to_dict())
    assert "Compared with the truth" in html
    assert "<th>x [mm]</th><td>3.00</td><td>3.00</td>" in html
    assert "20 of 20 reference times matched" in html


def test_a_body_with_joints_gets_their_angles_and_its_flight_and_another_does_not(tmp_path):
    motion = person_run()
    write_figures(figures_of(tmp_path), motion, PERSON)
    html = html_of(tmp_path, motion, flight=flight_summary(motion, measure_flight(motion, PERSON)).to_dict())
    words = (
        "<h2>Joints</h2>",
        "<h2>Centre of mass and angular momentum</h2>",
        "<dt>Joint angles</dt>",
        "a free fall [mm]",
        "mean over the frames, standard deviation of one",
        "scatter of the frames about x",
    )
    assert [word for word in words if word not in html] == []
    assert html.count("<img") == 5
    (tmp_path / "rigid").mkdir()
    write_figures(figures_of(tmp_path / "rigid"), run(), BOX)
    assert [word for word in words if word in html_of(tmp_path / "rigid", run())] == []


def test_of_too_few_poses_or_a_body_that_does_not_fall_no_free_fall_is_shown(tmp_path):
    for motion in (person_run(2), replace(run := person_run(60), position=np.tile(run.position[:1], (60, 1)))):
        write_flight_figure(figures_of(tmp_path) / "flight.png", motion, PERSON)
        html = html_of(tmp_path, motion, flight=flight_summary(motion, measure_flight(motion, PERSON)).to_dict())
        assert "<th>free fall</th><td>none found</td>" in html and "downward acceleration" not in html


def test_a_comparison_with_paths_of_joints_becomes_a_table(tmp_path):
    motion = person_run()
    points, _ = landmarks(motion, PERSON)
    names = tuple(mark.name for mark in PERSON.landmarks)
    paths = JointPaths(time_s=motion.time_s, names=names, points=points - [0.004, 0, 0])
    html = html_of(tmp_path, motion, joints=compare_joints(motion, PERSON, paths).to_dict())
    assert "Compared with the paths of the joints" in html
    assert html.count("<td>4</td><td>4</td><td>4</td>") == len(names) + 2  # all, and all tracked
    assert "Joints tracked: 100%; of these more than 100 mm off: 0." in html


@pytest.mark.parametrize("key", ["n_lost", "turns_s", "angular_momentum_sd_kg_m2_s"])
def test_a_number_missing_from_the_summary_is_named(tmp_path, key):
    motion = person_run()
    flight = flight_summary(motion, measure_flight(motion, PERSON)).to_dict()
    summary = {"name": "a throw", **headline(motion), "flight": flight}
    del (flight if key in flight else summary)[key]
    with pytest.raises(ResultError, match=f"has no {key}, as of an older version; track again"):
        write_report(tmp_path, summary)


def test_keys_become_words_with_their_unit():
    assert label("reprojection_rms_px") == "reprojection rms [px]"
    assert label("rate_hz") == "rate [1/s]"
    assert label("range_mm") == "range [mm]"
    assert label("body") == "body"


def test_values_are_shown_as_a_reader_would_write_them():
    assert [format_value(v) for v in (None, True, 3, 0.123456, 12345.6, [768, 576], "x")] == [
        "not known",
        "yes",
        "3",
        "0.1235",
        "12350",
        "768, 576",
        "x",
    ]


def test_the_method_shows_only_the_settings_that_it_used():
    record = {"method": "refined", "every": 1, "stop": None, "prediction": "smooth", "steps_mm": [50], "colour": "raw"}
    shown = dict(page.settings_table(record).rows)
    assert {"prediction", "every"} <= set(shown)
    assert not {page.label("steps_mm"), "colour"} & set(shown)
    assert page.label("steps_mm") in dict(page.settings_table({**record, "method": "stepping"}).rows)


@pytest.mark.parametrize(
    ("value", "sd", "text"),
    [
        (0.54, 0.0025, "0.5400 ± 0.0025"),
        (-0.18, 0.0099, "−0.1800 ± 0.0099"),
        (12.3, 14.2, "12 ± 14"),
        (1.25, None, "1.25"),
        (1.25, 0.0, "1.25"),
        (None, None, "not known"),
    ],
)
def test_a_number_has_the_digits_of_its_standard_deviation(value, sd, text):
    assert page.format_with_sd(value, sd) == text
