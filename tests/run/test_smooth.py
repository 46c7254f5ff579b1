"""A run is smoothed from the command line: new tables beside the raw ones, which stay as they are."""

import csv
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from airborne.errors import ResultError
from airborne.motion import MotionWriter
from airborne.motion.smoothing.settings import Smoothing
from airborne.run.smooth import smooth_run
from tests.cli.test_cli import in_process, refusal
from tests.support.docs import DOCS, named, table_of
from tests.support.motions import somersault
from tests.support.players_trial import write_run
from tests.support.run_files import contents_of, files_of

pytestmark = pytest.mark.usefixtures("_plain_figures")

NEW = {
    *("tables/smooth_motion.csv", "tables/smooth_joints.csv", "tables/smooth_events.csv"),
    *("figures/residuals.png", "smooth.json"),
}


@pytest.fixture
def run(tmp_path, thrown_cross):
    """A run of a cross that spins for 0.8 s and is lost in two frames, with noise of 1 mm."""
    folder, rng = tmp_path / "run", np.random.default_rng(0)
    folder.mkdir()
    estimates, _ = somersault(40)
    with MotionWriter(folder / "motion.csv") as writer:
        for k, item in enumerate(estimates):
            lost = {"pose": None, "covariance": None, "status": type(item.status)("lost"), "n_views": 0}
            moved = item.pose.move(1e-3 * rng.normal(size=3), 1e-3 * rng.normal(size=3))
            writer.append(replace(item, **lost) if k in (20, 21) else replace(item, pose=moved))
    shutil.copyfile(thrown_cross / "cross.toml", folder / "body.toml")
    return folder


def table(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_new_tables_lie_beside_the_raw_ones_which_stay(run, capsys):
    before = contents_of(run)
    assert in_process("smooth", run, "--butterworth", "10") == 0
    output = capsys.readouterr().out
    assert "-3 dB of both at 10 Hz" in output and "gaps are not filled" in output and "Winter" in output
    assert before.items() <= contents_of(run).items()
    assert set(files_of(run)) - set(before) == NEW
    rows = table(run / "tables/smooth_motion.csv")
    assert len(rows) == 40
    assert rows[20]["x_m"] == rows[21]["vz_m_s"] == "" and rows[20]["status"] == "lost"
    assert float(rows[10]["vx_m_s"]) == pytest.approx(5.0, abs=0.2)
    assert float(rows[10]["x_m_sd"]) < 1e-3


def test_gaps_are_filled_on_request_into_another_folder(run, tmp_path, capsys):
    out = tmp_path / "new" / "out"
    assert in_process("smooth", run, "--spline", "--fill", "0.1", "-o", out) == 0
    assert set(files_of(out)) == NEW
    assert f"wrote into {out}: tables/smooth_motion.csv" in capsys.readouterr().out
    rows = table(out / "tables/smooth_motion.csv")
    assert rows[20]["is_filled"] == "1" and float(rows[20]["x_m"]) == pytest.approx(2.0, abs=0.05)


def test_auto_takes_the_cutoff_of_the_residual_analysis_and_json_says_all(run, capsys):
    assert in_process("smooth", run, "--butterworth", "auto", "--events", "0.2,0.20", "--json") == 0
    result = json.loads(capsys.readouterr().out)
    assert result == json.loads((run / "smooth.json").read_text())
    assert result["cutoff_hz"] == result["residual_analysis"]["chosen_hz"]
    assert result["events"] == {"": [{"name": "given", "time_s": 0.2}]}
    assert [row["segment"] for row in table(run / "tables/smooth_motion.csv")[8:12]] == ["0", "0", "1", "1"]


def test_players_are_smoothed_too(tmp_path, capsys):
    run = write_run(tmp_path / "run")
    assert in_process("smooth", run, "--kalman", "--events", "none") == 0
    rows = table(run / "tables/smooth_joints.csv")
    assert len(rows) == 12 * 2 * 6
    assert {row["player"] for row in rows} == {"Anna", "number 7"}
    assert float(rows[0]["sd_m"]) < 0.02
    events = table(run / "tables/smooth_events.csv")
    assert {row["event"] for row in events if row["player"] == "Anna"} == {"highest"}


def test_events_of_players_are_found_unless_given(tmp_path):
    run = write_run(tmp_path / "run", n=40)
    result = smooth_run(run, Smoothing(method="butterworth", cutoff_hz=8), out=tmp_path / "out")
    assert set(result.events) == {"Anna", "number 7"}


def test_without_a_way_it_is_the_kalman_smoother_and_says_so(run, tmp_path, capsys):
    assert in_process("smooth", run, "-o", tmp_path / "plain") == 0
    assert "no method was given" in capsys.readouterr().err
    assert in_process("smooth", run, "--kalman", "-o", tmp_path / "kalman") == 0
    assert "no method" not in capsys.readouterr().err
    plain, kalman = (sorted((tmp_path / each).rglob("*.csv")) for each in ("plain", "kalman"))
    assert len(plain) == len(kalman) > 1
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(plain, kalman, strict=True))


def test_what_cannot_be_done_is_refused_in_one_line(run, tmp_path, capsys):
    assert "give one way to smooth" in refusal(capsys, "smooth", run, "--kalman", "--spline")
    assert "below 25 Hz" in refusal(capsys, "smooth", run, "--butterworth", "25")
    assert "--butterworth is 'six'" in refusal(capsys, "smooth", run, "--butterworth", "six")
    assert "ends, 0.000 and 0.780 s" in refusal(capsys, "smooth", run, "--spline", "--events", "0.2,7")
    assert "--events is 'x'" in refusal(capsys, "smooth", run, "--spline", "--events", "x")
    assert "0 to 0.5 s" in refusal(capsys, "smooth", run, "--spline", "--fill", "2")
    assert "holds no run" in refusal(capsys, "smooth", tmp_path, "--spline")
    assert not (run / "smooth.json").exists()


def test_a_motion_too_short_to_choose_by_is_refused(tmp_path):
    run = write_run(tmp_path / "run", n=6)
    with pytest.raises(ResultError, match="give one in Hz"):
        smooth_run(run, Smoothing(method="butterworth"), events_s=[])


def documented_columns(page, heading):
    return [name for row in table_of(DOCS / "how-to" / page, heading) for name in named(row[0])]


def test_every_column_is_documented(run, tmp_path):
    smooth_run(run, Smoothing(method="spline"))
    players = write_run(tmp_path / "players")
    smooth_run(players, Smoothing(method="spline"), events_s=[])
    assert set(table(run / "tables/smooth_motion.csv")[0]) == set(
        documented_columns("signals.md", "`smooth_motion.csv`")
    )
    assert set(table(players / "tables/smooth_joints.csv")[0]) == set(
        documented_columns("signals.md", "`smooth_joints.csv`")
    )
    text = (DOCS / "how-to" / "signals.md").read_text(encoding="utf-8")
    assert all(
        f"`{name}`" in text for name in (run / "tables/smooth_events.csv").read_text().splitlines()[0].split(",")
    )


def test_two_frames_are_too_few_and_nothing_is_written(run, capsys):
    table = run / "motion.csv"
    table.write_text("".join(table.read_text().splitlines(keepends=True)[:3]))
    before = files_of(run)
    assert "no stretch has 5 frames with a pose (the run has 2 frames)" in refusal(capsys, "smooth", run, "--kalman")
    assert files_of(run) == before


def test_smoothed_joints_are_compared_beside_those_that_were_tracked(run, capsys):
    assert in_process("smooth", run, "--kalman", "--events", "none") == 0
    reference = shutil.copyfile(run / "tables/smooth_joints.csv", run.parent / "reference.csv")
    assert in_process("evaluate", run, "--joints", reference, "--json") == 0
    compared = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert compared["smooth_joints"]["whole"]["largest_mm"] == 0
    assert 0 < compared["joints"]["whole"]["mean_mm"] < 2
    assert in_process("evaluate", run, "--joints", reference) == 0
    assert "the smoothed joints against them" in capsys.readouterr().out
