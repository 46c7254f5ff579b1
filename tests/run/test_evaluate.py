"""A finished run is compared with what is known, and its summary keeps the comparison."""

import csv
import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

from airborne.body import Inertia
from airborne.body.files import read_body, write_body
from airborne.cameras import read_rig, write_pose2sim
from airborne.errors import BodyError, ResultError
from airborne.motion import Motion, MotionWriter, write_joints
from airborne.motion.covariance_file import write_covariances
from airborne.run.evaluate import assess, evaluate_agreement
from tests.support.commands import in_process
from tests.support.docs import DOCS
from tests.support.motions import estimate
from tests.support.players_trial import PLAYERS, write_run, write_truth
from tests.support.run_files import contents_of, files_of

pytestmark = pytest.mark.usefixtures("_plain_figures")


@pytest.fixture
def run(tmp_path, thrown_cross):
    """A finished run of three frames, and the paths of its joints 10 mm higher."""
    folder = tmp_path / "run"
    folder.mkdir()
    estimates = [estimate(k) for k in range(3)]
    with MotionWriter(folder / "motion.csv") as writer:
        for item in estimates:
            writer.append(item)
    shutil.copyfile(thrown_cross / "cross.toml", folder / "body.toml")
    counts = '"n_frames": 1, "n_tracked": 1, "n_uncertain": 0, "n_lost": 0'
    (folder / "summary.json").write_text(f'{{"name": "run", {counts}}}\n')
    motion, body = Motion.collect(estimates), read_body(folder / "body.toml")
    write_joints(tmp_path / "higher.csv", replace(motion, position=motion.position + np.array([0, 0, 0.01])), body)
    return folder


def test_paths_of_joints_are_compared_and_kept_in_the_summary(run):
    result = assess(run, None, None, run.parent / "higher.csv")
    assert list(result) == ["joints"]
    assert result["joints"].whole.mean_mm == pytest.approx(10)
    remaining = json.loads((run / "summary.json").read_text())
    assert remaining["joints"]["whole"]["bias_mm"] == pytest.approx([0, 0, -10], abs=1e-9)
    assert remaining["name"] == "run"


def test_with_a_folder_of_its_own_a_comparison_leaves_the_run_as_it_is(run):
    before = contents_of(run)
    out = run.parent / "out"
    assert in_process("evaluate", run, "--joints", run.parent / "higher.csv", "-o", out) == 0
    assert contents_of(run) == before
    assert "agreement_methods.txt" in files_of(out)


def test_a_flight_is_compared_and_kept_in_the_summary(run, capsys):
    flight, body = run.parent / "flight.csv", read_body(run / "body.toml")
    times = Motion.collect([estimate(k) for k in range(3)]).time_s
    flight.write_text("time_s,somersault_deg\n" + "".join(f"{t},0\n" for t in times))
    with pytest.raises(BodyError, match="has no mass"):
        assess(run, None, None, flight=flight)
    heavy = tuple(replace(each, inertia=Inertia(3.0, np.zeros(3), np.eye(3))) for each in body.segments)
    write_body(run / "body.toml", replace(body, segments=heavy))
    assert in_process("evaluate", run, "--flight", flight) == 0
    assert "against the flight\n3 of 3 reference times matched" in capsys.readouterr().out
    assert json.loads((run / "summary.json").read_text())["reference_flight"]["quantities"]["somersault"]["n"] == 3


def test_nothing_to_compare_with_is_refused(run):
    with pytest.raises(ResultError, match=r"give a truth\.csv"):
        assess(run, None, None)


def test_a_table_that_was_cut_is_refused(run):
    summary = (run / "summary.json").read_text()
    (run / "summary.json").write_text(summary.replace('"n_frames": 1', '"n_frames": 5'))
    with pytest.raises(ResultError, match=r"motion\.csv holds 3 of 5 frames: it was cut"):
        assess(run, None, None, run.parent / "higher.csv")


def test_a_run_without_the_errors_that_its_self_check_found_to_last_is_refused(run):
    summary = (run / "summary.json").read_text()
    (run / "summary.json").write_text(summary.replace('"n_lost": 0', '"n_lost": 0, "has_lasting_errors": true'))
    with pytest.raises(ResultError, match=r"lasting\.bin is missing or cut"):
        assess(run, None, None, run.parent / "higher.csv")
    write_covariances(run / "lasting.bin", np.broadcast_to(1e-6 * np.eye(6), (3, 6, 6)))
    assert assess(run, None, None, run.parent / "higher.csv")["joints"].whole.mean_mm == pytest.approx(10)


def test_a_fall_alone_leaves_no_lasting_errors(run):
    """Nobody misses a file that such a run never had."""
    summary = (run / "summary.json").read_text()
    finding = '"self_check": [{"subject": "fall", "sentence": "it falls too slowly", "is_alarm": true}]'
    (run / "summary.json").write_text(summary.replace('"n_lost": 0', f'"n_lost": 0, {finding}'))
    assert assess(run, None, None, run.parent / "higher.csv")["joints"].whole.mean_mm == pytest.approx(10)


def test_a_truth_of_players_in_millimetres_is_asked_about(tmp_path, capsys):
    run, truth = write_run(tmp_path / "run"), write_truth(tmp_path / "truth.csv")
    lines = [line.split(",") for line in truth.read_text().splitlines()]
    scaled = [line if k == 0 else line[:3] + [str(1e3 * float(x)) for x in line[3:]] for k, line in enumerate(lines)]
    truth.write_text("\n".join(map(",".join, scaled)) + "\n")
    assert in_process("evaluate", run, truth) == 0
    said = capsys.readouterr()
    assert "are its numbers millimetres that are read as metres?" in said.out
    assert (
        said.err
        == "airborne: doubt: what was found against the truth is doubtful: see the question below its numbers\n"
    )
    assert "Doubtful: " in (run / "agreement_methods.txt").read_text()
    assert json.loads((run / "summary.json").read_text())["truth"]["questions"]


def test_a_truth_given_as_joints_is_refused_in_one_line(run, thrown_cross):
    with pytest.raises(ResultError, match="no column joint"):
        assess(run, None, None, thrown_cross / "truth.csv")


def test_players_are_compared_with_their_truth_and_the_summary_keeps_it(tmp_path):
    run, truth = write_run(tmp_path / "run"), write_truth(tmp_path / "truth.csv", off_m=0.03)
    result = assess(run, truth, None)
    assert list(result) == ["truth"]
    assert [errors.parts["all"].mean_mm for errors in result["truth"].players.values()] == pytest.approx([30, 30])
    remaining = json.loads((run / "summary.json").read_text())
    assert list(remaining["truth"]["players"]) == list(PLAYERS)
    assert remaining["name"] == "a block"


def test_a_broken_list_of_jumps_beside_the_truth_is_refused(tmp_path):
    run, truth = write_run(tmp_path / "run"), write_truth(tmp_path / "truth.csv")
    (tmp_path / "players.json").write_text("[")
    with pytest.raises(ResultError, match=r"players\.json"):
        assess(run, truth, None)


def test_players_without_a_summary_are_compared_and_none_is_made(tmp_path):
    run = write_run(tmp_path / "run")
    (run / "summary.json").unlink()
    assert assess(run, write_truth(tmp_path / "truth.csv"), None)["truth"].n_matched == 12
    assert not (run / "summary.json").exists()


def test_players_have_a_truth_only(tmp_path):
    run, truth = write_run(tmp_path / "run"), write_truth(tmp_path / "truth.csv")
    for given in ((None, None, None), (truth, truth, None), (truth, None, truth), (None, None, truth)):
        with pytest.raises(ResultError, match=r"a run of players.*give a truth\.csv"):
            assess(run, *given)


def test_truths_of_players_and_of_a_body_are_distinguished(run, thrown_cross, tmp_path):
    with pytest.raises(ResultError, match="expected a truth table of players"):
        assess(write_run(tmp_path / "players"), thrown_cross / "truth.csv", None)
    with pytest.raises(ResultError, match="no column x_m"):
        assess(run, write_truth(tmp_path / "truth.csv"), None)


def agreements(found, against):
    return {row.name: row for row in found.agreements[against]}


def test_agreement_of_joints_is_reported_in_tables_figures_and_a_paragraph(run, tmp_path):
    before = contents_of(run)
    result = evaluate_agreement(run, joints=run.parent / "higher.csv", out=tmp_path / "agreement")
    rows = agreements(result, "the joints")
    assert rows["all joints z"].bias.value == pytest.approx(-10)
    assert rows["all joints x"].rmse.value == pytest.approx(0, abs=1e-9)
    assert set(files_of(tmp_path / "agreement")) == set(result.files)
    assert set(result.files) == {
        "tables/agreement.csv",
        "figures/agreement_joints.png",
        "figures/identity_joints.png",
        "agreement_methods.txt",
    }
    text = (tmp_path / "agreement" / "agreement_methods.txt").read_text()
    assert "Bland" in text and "McGraw" in text and "bias -10.00" in text and "airborne" in text
    assert contents_of(run) == before


def test_a_folder_that_holds_another_run_is_left_alone(run, tmp_path):
    other = shutil.copytree(run, tmp_path / "other")
    before = contents_of(other)
    with pytest.raises(ResultError, match="other holds another run"):
        evaluate_agreement(run, joints=run.parent / "higher.csv", out=other)
    assert contents_of(other) == before


def test_a_repeat_that_is_the_run_itself_is_said_to_tell_nothing(run, tmp_path):
    again = shutil.copytree(run, tmp_path / "again")
    said = evaluate_agreement(run, repeats=[again], out=tmp_path / "out").doubts
    assert [f"{again} is {run} to the last digit" in each for each in said] == [True]


def test_a_second_reference_leaves_the_results_of_the_first(run, tmp_path):
    truth = shutil.copyfile(run / "motion.csv", tmp_path / "truth.csv")
    for references in ({"joints": run.parent / "higher.csv"}, {"truth": truth}, {"truth": truth}):
        evaluate_agreement(run, out=tmp_path, **references)
    with (tmp_path / "tables/agreement.csv").open() as file:
        rows = [(row["against"], row["variable"]) for row in csv.DictReader(file)]
    assert {against for against, _ in rows} == {"the joints", "the truth"}
    assert len(set(rows)) == len(rows)
    text = (tmp_path / "agreement_methods.txt").read_text()
    assert [text.count(head) for head in ("Against the joints:", "Against the truth:", "References")] == [1, 1, 1]
    assert "bias -10.00" in text
    assert "Bland JM, Altman DG (2007)" in text and "Bland JM, Altman DG (1999)" not in text  # nothing was repeated


def test_each_number_of_the_table_has_its_interval(run, tmp_path):
    evaluate_agreement(run, joints=run.parent / "higher.csv", out=tmp_path)
    with (tmp_path / "tables/agreement.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert rows[0]["against"] == "the joints"
    for name in ("bias", "lower_limit", "upper_limit", "rmse", "nrmse_percent", "icc_a1", "icc_c1", "sem", "mdc"):
        assert {f"{name}_low", f"{name}_high"} <= set(rows[0])


def test_runs_of_one_trial_are_compared_with_one_another(run, tmp_path):
    others = [shutil.copytree(run, tmp_path / name) for name in ("other", "third")]
    result = evaluate_agreement(run, repeats=others, out=tmp_path)
    rows = {row.name: row for row in result.repeats["runs"]}
    assert rows["x"].n_ways == 3 and rows["x"].within_sd.value == pytest.approx(0, abs=1e-9)
    assert {"somersault", "tilt", "twist", "all joints x"} <= set(rows)
    assert "between runs" in result.describe()
    assert not result.agreements
    with pytest.raises(ResultError, match="holds no run"):
        evaluate_agreement(run, repeats=[tmp_path])


def test_a_run_of_other_videos_is_no_repetition(run, tmp_path):
    other = shutil.copytree(run, tmp_path / "other")
    for folder, digests in ((run, "ab"), (other, "bc")):
        inputs = {f"cam{k}.mp4": each for k, each in enumerate(digests)} | {"body.toml": "same"}
        (folder / "run.json").write_text(json.dumps({"inputs": inputs}))
    assert evaluate_agreement(run, repeats=[other], out=tmp_path).repeats["runs"]
    (other / "run.json").write_text(json.dumps({"inputs": {"cam0.mp4": "d", "body.toml": "same"}}))
    with pytest.raises(ResultError, match=r"other is a run of other videos \(cam0\.mp4\) than "):
        evaluate_agreement(run, repeats=[other])


def test_nothing_is_compared_with_itself(run, thrown_cross, tmp_path):
    other, clicks = shutil.copytree(run, tmp_path / "other"), thrown_cross / "digitised.csv"
    for repeats in ([run], [other, tmp_path / "run" / ".." / "other"]):
        with pytest.raises(ResultError, match=r"--repeat .* compared with itself"):
            evaluate_agreement(run, repeats=repeats)
    with pytest.raises(ResultError, match=r"--operator .* compared with itself"):
        evaluate_agreement(run, digitised=clicks, operators=[clicks])


@pytest.mark.parametrize("text", ["{", "[]", ""])
def test_a_run_with_a_damaged_record_is_refused(run, text):
    (run / "run.json").write_text(text)
    with pytest.raises(ResultError, match=r"run\.json is damaged"):
        assess(run, None, None, run.parent / "higher.csv")
    players = write_run(run.parent / "players")
    (players / "run.json").write_text(text)
    with pytest.raises(ResultError, match=r"run\.json is damaged"):
        assess(players, write_truth(run.parent / "truth.csv"), None)


def test_a_run_without_its_body_is_refused(run):
    (run / "body.toml").unlink()
    with pytest.raises(ResultError, match=r"body\.toml is missing, .* track again"):
        assess(run, None, None, run.parent / "higher.csv")


def test_people_who_click_the_same_images_are_compared(run, thrown_cross, tmp_path):
    write_pose2sim(run / "calib.toml", read_rig(thrown_cross / "calib_true.toml"))
    clicks = thrown_cross / "digitised.csv"
    others = shutil.copyfile(clicks, tmp_path / "others.csv")
    result = evaluate_agreement(run, digitised=clicks, operators=[others], out=tmp_path)
    assert {row.name for row in result.repeats["operators"]} == {"x", "y", "z", "somersault", "tilt", "twist"}
    assert list(result.agreements) == ["points digitised"]
    with pytest.raises(ResultError, match="give those as --digitised"):
        evaluate_agreement(run, operators=[clicks])


def test_players_and_their_jumps_agree_with_their_truth(tmp_path):
    run, truth = write_run(tmp_path / "run"), write_truth(tmp_path / "truth.csv", off_m=0.03)
    result = evaluate_agreement(run, truth, repeats=[shutil.copytree(run, tmp_path / "again")])
    rows = agreements(result, "the truth")
    assert rows["ankle_left z"].bias.value == pytest.approx(30)
    assert rows["ankle_left z"].n_individuals == 2
    assert rows["all joints z"].n_individuals == 12
    assert [row.name for row in result.repeats["runs"]][:3] == ["hip_left x", "all joints x", "hip_left y"]
    with pytest.raises(ResultError, match="a run of players"):
        evaluate_agreement(run, joints=truth)
    plain = json.dumps(result.to_dict(), allow_nan=False)
    assert "NaN" not in plain


def test_every_number_is_documented(run, tmp_path):
    evaluate_agreement(
        run, joints=run.parent / "higher.csv", repeats=[shutil.copytree(run, tmp_path / "again")], out=tmp_path
    )
    text = (DOCS / "how-to" / "agreement.md").read_text(encoding="utf-8")
    for name in ("agreement.csv", "repeatability.csv"):
        header = (tmp_path / "tables" / name).read_text().splitlines()[0].split(",")
        stems = {column.removesuffix("_low").removesuffix("_high") for column in header}
        assert {stem for stem in stems if f"`{stem}`" not in text} <= {"against", "between", "variable", "unit"}


def test_one_frame_of_joints_has_a_dash_for_what_it_cannot_say(run, tmp_path):
    lines = (run.parent / "higher.csv").read_text().splitlines(keepends=True)
    (tmp_path / "one.csv").write_text("".join(lines[:2]))
    text = assess(run, None, None, tmp_path / "one.csv")["joints"].describe()
    assert "nan" not in text
    assert text.splitlines()[2].split()[-1] == "-"


def test_a_run_that_may_not_be_written_is_compared_into_another_folder(run, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("airborne.run.evaluate.os.access", lambda path, mode: mode != os.W_OK)
    before = contents_of(run)
    assert in_process("evaluate", run, "--joints", run.parent / "higher.csv", "-o", tmp_path / "out") == 0
    assert contents_of(run) == before
    assert f"wrote into {tmp_path / 'out'}: tables/agreement.csv" in capsys.readouterr().out


def test_an_unfinished_run_is_said_to_be_one(run, capsys):
    (run / "summary.json").unlink()
    assert in_process("evaluate", run, "--joints", run.parent / "higher.csv") == 0
    assert "note: the run is not finished" in capsys.readouterr().out
