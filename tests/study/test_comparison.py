"""Conditions compared across trials: curves between events, tests of curves, tables, figures, text."""

import csv
import re

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from airborne.errors import AirborneError
from airborne.study.comparison import compare_trials
from airborne.study.curves import RunCurve, event_times, normalise_time, read_curve
from airborne.study.random_effects import Cells, estimate_difference
from airborne.study.spm import compare_curves
from airborne.study.text import describe_study
from airborne.study.trials import read_study
from airborne.study.write import write_comparison
from tests.support.athletes import write_results
from tests.support.commands import in_process
from tests.support.tolerances import ROUNDTRIP

ATHLETES = ("anna", "berta", "carla", "dora", "eva")


def season(folder, *, effect=40.0, n=3, seed=0):
    """Results of athletes who turn 400 degrees in a second when dry, and more when wet, from the half of it on."""
    rng, time_s = np.random.default_rng(seed), np.arange(101) / 100
    rows, curves = [], {}
    for athlete in ATHLETES:
        own = rng.normal(0, 20)
        for condition in ("dry", "wet"):
            for number in range(n):
                more = effect * (condition == "wet") * np.maximum(time_s - 0.5, 0) / 0.5
                noise = gaussian_filter1d(rng.normal(0, 20, 101), 8)
                name = f"{athlete}_{condition}_{number}"
                curves[name] = (400 + own) * time_s + more + noise
                last = curves[name][-1]
                labels = {"trial": name, "athlete": athlete, "condition": condition}
                rows.append(labels | {"turned_deg": last, "turned_deg_sd": 2.0, "takeoff_s": 0.1, "landing_s": 0.9})
    return write_results(folder, rows, curves)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return season(tmp_path_factory.mktemp("season"))


def test_a_number_is_compared_within_athletes(results):
    (contrast,) = compare_trials(read_study(results), "turned_deg", ()).contrasts
    assert (contrast.a, contrast.b, contrast.difference.level) == ("dry", "wet", "within athletes")
    half = (contrast.difference.high[0] - contrast.difference.low[0]) / 2
    assert abs(contrast.difference.value[0] - 40) < 2 * half
    assert contrast.p_holm == contrast.difference.p[0] < 0.01


def test_of_a_number_that_is_the_same_in_all_trials_no_interval_is_stated(tmp_path):
    labels = [(athlete, condition) for athlete in ATHLETES for condition in ("dry", "wet")]
    rows = [{"trial": f"{a}_{c}", "athlete": a, "condition": c, "turns": 1.0, "turns_sd": 0.0} for a, c in labels]
    compared = compare_trials(read_study(write_results(tmp_path, rows)), "turns", ())
    text = describe_study([compared], (), real_time=False)
    assert "wet minus dry is 0 and could not be tested: too few, or all the same; within 5 athletes" in text


def test_an_athlete_in_both_of_two_groups_is_named(tmp_path):
    labels = [("ann", "dry"), ("bob", "dry"), ("ann", "wet"), ("cid", "wet")]
    rows = [
        {"trial": f"{a}_{c}", "athlete": a, "condition": c, "turns": float(k), "turns_sd": 0.1}
        for k, (a, c) in enumerate(labels)
    ]
    compared = compare_trials(read_study(write_results(tmp_path, rows)), "turns", ())
    text = describe_study([compared], (), real_time=False)
    assert "between athletes (2 and 2, of whom ann is in both and counts in each), as too few" in text


def test_without_repeated_trials_no_spread_of_trials_is_stated(tmp_path):
    assert in_process("compare", season(tmp_path / "in", n=1), "-o", tmp_path, "--variable", "turned_deg") == 0
    (row,) = csv.DictReader((tmp_path / "differences.csv").read_text().splitlines())
    assert (row["sd_trials"], float(row["sd_measurement"]), row["mdc"]) == ("", 2, "")
    text = (tmp_path / "comparison.txt").read_text()
    assert "need two trials of an athlete in a condition, and none has two" in text and "pooled within" not in text


def test_a_cell_that_is_no_number_is_refused_by_its_row_and_column(tmp_path):
    text = (season(tmp_path) / "trials.csv").read_text()
    (tmp_path / "trials.csv").write_text(text.replace(",2.0,", ",abc,", 1))
    expected = r"row of trial anna_dry_0, column turned_deg_sd: .* \(found 'abc'\)"
    with pytest.raises(AirborneError, match=expected):
        compare_trials(read_study(tmp_path), "turned_deg", ())


def test_a_folder_of_a_run_gets_no_comparison(results, tmp_path):
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(AirborneError, match=r"holds a run; give another folder"):
        write_comparison(results, tmp_path, ["turned_deg"])


def test_a_curve_differs_where_it_does(results):
    compared = compare_trials(read_study(results), "somersault_deg", ("start", "end"))
    (contrast,) = compared.contrasts
    ((low, high, p),) = contrast.test.clusters
    assert 50 < low < 90 and high == 100 and p < 0.01
    assert compared.axis[[0, -1]].tolist() == [0, 100]


def test_events_cut_and_stretch_a_curve(results):
    study = read_study(results)
    trial = study.trials[0]
    curve = read_curve(trial, "somersault_deg")
    takeoff, turn, landing = event_times(trial, curve, ("take-off", "turn-1", "end"))
    assert (takeoff, landing) == (0.1, 1.0)
    values = np.interp([takeoff, turn], curve.time_s, curve.values)
    np.testing.assert_allclose(values[1] - values[0], 360, rtol=1e-6)
    at_nodes, variance = normalise_time(curve, [takeoff, turn, landing])
    np.testing.assert_allclose(at_nodes[[0, 100]], values, rtol=ROUNDTRIP)
    assert len(at_nodes) == 201 and (variance == 1).all()


def test_a_straight_line_stays_one_between_two_events():
    curve = RunCurve(np.array([0.0, 0.3, 1.0]), np.array([0.0, 3.0, 10.0]), np.full(3, np.nan))
    values, variance = normalise_time(curve, [0.1, 0.9])
    np.testing.assert_allclose(values, np.linspace(1, 9, 101), rtol=ROUNDTRIP)
    assert not variance.any(), "an unknown standard deviation counts as none"


def test_real_time_goes_as_far_as_the_shortest_trial(results):
    compared = compare_trials(read_study(results), "somersault_deg", ("take-off", "landing"), real_time=True)
    np.testing.assert_allclose(compared.axis[[0, 1, -1]], [0, 0.01, 0.8], atol=1e-9)


def test_a_trial_that_lacks_an_event_is_left_out_and_named(results):
    compared = compare_trials(read_study(results), "somersault_deg", ("start", "turn-1"))
    assert len(compared.cells.values) + len(compared.left_out) == 30
    assert all("no turn-1" in line for line in compared.left_out)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--variable", "height_m"], "height_m is no number .* numbers: turned_deg, .*; curves: somersault_deg$"),
        (["--variable", "turned_rev"], "did you mean turned_deg"),
        (["--variable", "turned_deg", "--events", "take-off"], "give two or more"),
        (["--variable", "turned_deg", "--events", "start,finish"], "event 'finish' is not known"),
        (["--variable", "turned_deg", "--conditions", "dry"], "give two or more to compare"),
        (["--variable", "turned_deg", "--conditions", "hot,icy"], "no trial of condition hot or icy; it has: .*dry"),
        (["--variable", "turned_deg", "--conditions", "dry,icy"], "no finished trial of condition icy"),
    ],
)
def test_what_cannot_be_compared_is_one_line(results, tmp_path, capsys, words, said):
    assert in_process("compare", results, "-o", tmp_path / "out", *words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(said, line)


def test_a_comparison_leaves_tables_figures_and_a_text(results, tmp_path, capsys):
    variables = ["--variable", "turned_deg", "--variable", "somersault_deg"]
    assert in_process("compare", results, "-o", tmp_path, *variables, "--conditions", "wet,dry") == 0
    assert {path.name for path in tmp_path.iterdir()} == {
        "comparison.txt",
        "differences.csv",
        "means.csv",
        "curves.csv",
        "clusters.csv",
        "turned_deg.png",
        "somersault_deg.png",
        "somersault_deg_athletes.png",
    }
    with (tmp_path / "differences.csv").open() as file:
        number, curve = csv.DictReader(file)
    assert (number["a"], number["b"], number["at"]) == ("wet", "dry", "")
    assert float(number["difference"]) < 0 and float(curve["at"]) > 50
    text = (tmp_path / "comparison.txt").read_text()
    assert "Pataky" in text and "Hartung" in text and "dry minus wet" in text
    assert "dry and wet differ, |t| above" in capsys.readouterr().out


def test_a_recording_that_was_given_twice_is_named(tmp_path):
    rows = [{"trial": f"{k}", "athlete": f"a{k % 4}", "condition": "xy"[k // 4], "rise_m": k / 7} for k in range(1, 8)]
    for twins in (False, True):
        folder = tmp_path / str(twins)
        again = [rows[2] | {"trial": "again"}] if twins else []
        text = write_comparison(write_results(folder / "in", [*rows, *again]), folder / "out", ["rise_m"])
        assert ("3 and again have the same numbers to the last digit" in text) == twins


def test_failed_trials_are_named_in_the_text(tmp_path):
    rows = [{"trial": f"{k}", "athlete": f"a{k % 4}", "condition": "xy"[k // 4], "rise_m": 0.1 * k} for k in range(8)]
    rows.append({"trial": "lost", "status": "failed", "error": "no video", "condition": "x", "rise_m": ""})
    text = write_comparison(write_results(tmp_path / "in", rows), tmp_path / "out", ["rise_m"])
    assert "\nLeft out\nlost: failed: no video\n" in text
    sound = write_comparison(write_results(tmp_path / "sound", rows[:-1]), tmp_path / "out", ["rise_m"])
    assert "\nLeft out\nnothing\n" in sound


def test_trials_that_are_mostly_untracked_are_left_out_and_alarms_are_named(tmp_path):
    rows = [{"trial": f"{k}", "athlete": f"a{k % 4}", "condition": "xy"[k // 4], "rise_m": 0.1 * k} for k in range(8)]
    rows[5] |= {"share_tracked": 0.9, "findings": "camera cam2 seems late"}
    rows.append({"trial": "torn", "athlete": "a0", "condition": "x", "rise_m": 7.0, "share_tracked": 0.03})
    text = write_comparison(write_results(tmp_path / "in", rows), tmp_path / "out", ["rise_m"])
    assert "\nLeft out\ntorn: only 3% of its frames are tracked\n" in text
    assert text.startswith("Read this first\n5: camera cam2 seems late\n")


def test_a_folder_without_a_batch_is_one_line(tmp_path):
    with pytest.raises(
        AirborneError, match=r"has no trials\.csv; give the folder of a batch, which `airborne batch` has finished"
    ):
        read_study(tmp_path)
    with pytest.raises(AirborneError, match="nowhere does not exist; give the folder of a batch"):
        read_study(tmp_path / "nowhere")
    (tmp_path / "trials.csv").write_text("trial\nx\n")
    with pytest.raises(AirborneError, match="lacks condition, error, folder, status"):
        read_study(tmp_path)


def test_false_alarms_of_curves_are_as_rare_as_they_say():
    rng, runs, alarms = np.random.default_rng(3), 200, 0
    for _ in range(runs):
        values = gaussian_filter1d(rng.normal(size=(32, 101)), 10, axis=1)
        athlete, condition = np.repeat(np.arange(8), 4), np.tile([0, 0, 1, 1], 8)
        values += gaussian_filter1d(rng.normal(size=(8, 101)), 10, axis=1)[athlete]
        cells = Cells(values=values, variance=np.zeros_like(values), athlete=athlete, condition=condition)
        alarms += bool(compare_curves(estimate_difference(cells, 0, 1), 0.05).clusters)
    assert abs(alarms / runs - 0.05) < 3 * np.sqrt(0.05 * 0.95 / runs)


def test_nodes_where_all_are_the_same_are_left_out_of_a_test():
    rng = np.random.default_rng(4)
    values = gaussian_filter1d(rng.normal(size=(12, 101)), 10, axis=1)
    values[:, :3] = 0
    cells = Cells(
        values=values, variance=np.zeros_like(values), athlete=np.repeat(np.arange(6), 2), condition=np.tile([0, 1], 6)
    )
    test = compare_curves(estimate_difference(cells, 0, 1), 0.05)
    assert np.isnan(test.t[:3]).all() and np.isfinite(test.t[3:]).all()
