"""The documentation says what a run leaves: files, columns, numbers; segments, landmarks and methods."""

import csv
import json
import re
from dataclasses import fields

import pytest

from airborne.body.human import BALL_LIMITS_DEG, HINGE_LIMITS_DEG, PARENTS
from airborne.evaluation import FlightComparison, FlightErrors, PlayerErrors, PlayersComparison
from airborne.evaluation.flight import Turns
from airborne.evaluation.jump_errors import JumpErrors
from airborne.evaluation.players import PartErrors
from airborne.export.figures import write_figures
from airborne.motion import covariance_file, flight_summary, measure_flight
from airborne.motion.files import _header
from airborne.motion.frame_file import FRAME_SD_FILE
from airborne.motion.jumps.table import JUMP_COLUMNS
from airborne.motion.run_folder import SMOOTH_JOINTS, SMOOTH_RECORD, TABLES, TRACKED_MOTION, figures_of
from airborne.run import smooth
from airborne.run.body_tables import write_tables
from airborne.run.evaluate import assess
from airborne.run.own_body import PICTURE
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from airborne.trial.settings import PLAYERS_METHODS
from tests.support.docs import DOCS, RESULTS, named, table_of
from tests.support.export_scenes import PERSON, person_run
from tests.support.places import ROOT
from tests.support.run_files import files_of

pytestmark = pytest.mark.usefixtures("_plain_figures")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of a short run with everything that a run can leave."""
    example = ROOT / "examples" / "thrown_cross"
    folder = tmp_path_factory.mktemp("docs") / "run"
    track_trial(read_trial(example / "trial.toml", {"stop": 2}), folder)
    assess(folder, example / "truth.csv", example / "digitised.csv")
    return folder


def test_every_file_of_a_run_is_documented(run):
    left = {re.sub(r"_cam\d", "_<camera>", name) for name in files_of(run)}
    assert left == {name for row in table_of(RESULTS, "Files") for name in named(row[0])}


def test_every_file_of_a_smoothed_run_is_documented():
    documented = {name for row in table_of(RESULTS, "Files added to a finished run") for name in named(row[0])}
    assert {
        smooth.MOTION,
        SMOOTH_JOINTS,
        smooth.ANGLES,
        smooth.EVENTS,
        smooth.RESIDUALS_FIGURE,
        SMOOTH_RECORD,
    } <= documented
    assert f"`{PICTURE}`" in RESULTS.read_text(encoding="utf-8")


def test_every_number_of_the_summary_is_documented(run):
    keys = list(json.loads((run / "summary.json").read_text(encoding="utf-8")))
    documented = [name for row in table_of(RESULTS, "`summary.json`") for name in named(row[0])]
    assert sorted(keys) == sorted(documented)


@pytest.mark.parametrize("name", ["angles.csv", "joints.csv"])
def test_every_column_is_documented(run, name):
    with next(run.rglob(name)).open(encoding="utf-8") as file:
        header = next(csv.reader(file))
    assert header == [column for row in table_of(RESULTS, f"`{name}`") for column in named(row[0])]


def test_every_column_of_the_jumps_is_documented():
    page = DOCS / "explanation" / "jumps.md"
    rows = [*table_of(page, "Four heights that are not the same"), *table_of(page, "Columns")]
    documented = {name for row in rows for name in named(row[0])}
    plain = {name for name in JUMP_COLUMNS if not name.endswith(("_low", "_high"))}
    assert plain - documented == set(), "add them to the tables of docs/explanation/jumps.md"
    assert documented - plain == set(), "docs/explanation/jumps.md has columns that jumps.csv has not"


def test_every_column_of_the_motion_is_documented():
    documented = [name for row in table_of(RESULTS, "`motion.csv`") for name in named(row[0])]
    header = _header(("<segment>",))
    spans = (("cov_00", "cov_55"), ("r00", "r22"))  # written by their ends
    for first, last in spans:
        del header[header.index(first) + 1 : header.index(last)]
    assert header == documented


@pytest.fixture(scope="module")
def person(tmp_path_factory):
    """The folder of the tables and figures of a body with joints and masses, and its motion."""
    folder, motion = tmp_path_factory.mktemp("docs") / "person", person_run(4)
    folder.mkdir()
    write_tables(folder, motion, PERSON)
    write_figures(figures_of(folder), motion, PERSON)
    return folder, motion


def test_every_file_of_a_body_with_joints_is_documented(person, run):
    left = set(files_of(person[0])) - set(files_of(run))
    rows = table_of(RESULTS, "Files of a body with joints")
    covariances = {covariance_file.COVARIANCE_FILE, f"{TABLES}/{covariance_file.COVARIANCE_FILE}"}
    of_whole_run = {TRACKED_MOTION, FRAME_SD_FILE}
    assert left | covariances | of_whole_run == {name for row in rows for name in named(row[0])}


@pytest.mark.parametrize("name", ["joint_angles.csv", "flight.csv"])
def test_every_column_of_a_body_with_joints_is_documented(person, name):
    header = (person[0] / "tables" / name).read_text(encoding="utf-8").splitlines()[0].split(",")
    assert header == [column for row in table_of(RESULTS, f"`{name}`") for column in named(row[0])]


def test_every_number_of_a_flight_is_documented(person):
    documented = [name for row in table_of(RESULTS, "`flight`") for name in named(row[0])]
    assert sorted(documented) == sorted(flight_summary(person[1], measure_flight(person[1], PERSON)).to_dict())


def test_the_segments_of_a_person_and_their_limits_are_documented():
    rows = {row[0].strip("`"): row[1:] for row in table_of(DOCS / "explanation" / "human.md", "Segments and limits")}
    middle_and_left = {name: parent for name, parent in PARENTS.items() if not name.endswith("_right")}
    assert list(rows) == list(middle_and_left)
    assert {name: row[0].strip("`") for name, row in rows.items()} == middle_and_left | {"pelvis": "the root"}
    limits = BALL_LIMITS_DEG | HINGE_LIMITS_DEG
    documented = {name: tuple(tuple(map(float, cell.split())) for cell in rows[name][1:3]) for name in limits}
    assert documented == limits
    assert {name for name, row in rows.items() if row[3] == "an ellipse"} == set(BALL_LIMITS_DEG)


def test_the_landmarks_of_a_person_are_documented():
    text = (DOCS / "explanation" / "human.md").read_text(encoding="utf-8")
    stems = {landmark.name.removesuffix("_left").removesuffix("_right") for landmark in PERSON.landmarks}
    sentence = re.search(r"Landmarks: (.*?\.)\n", text, re.DOTALL)
    assert sentence and stems == set(named(sentence[1])) - {"_left", "_right"}


@pytest.mark.parametrize(
    ("heading", "values"),
    [
        ("Comparing players", (PlayersComparison,)),
        ("A player's errors", (PlayerErrors, PartErrors)),
        ("A jump's errors", (JumpErrors,)),
    ],
)
def test_every_number_of_a_comparison_of_players_is_documented(heading, values):
    rows = table_of(RESULTS, heading)
    assert {name for row in rows for name in named(row[0])} == {each.name for value in values for each in fields(value)}


def test_every_number_of_a_comparison_of_a_flight_is_documented():
    documented = {name for row in table_of(RESULTS, "Comparing a flight") for name in named(row[0])}
    written = {each.name for value in (FlightComparison, FlightErrors, Turns) for each in fields(value)}
    assert documented == written | {"questions"}


def test_every_method_of_players_stands_in_the_page_on_legs():
    header = next(
        line
        for line in (DOCS / "explanation" / "legs.md").read_text(encoding="utf-8").splitlines()
        if line.startswith("| |")
    )
    assert set(named(header)) == set(PLAYERS_METHODS)
