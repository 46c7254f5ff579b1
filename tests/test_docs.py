"""The documentation says what the program does: commands, keys, files, columns, constants, links."""

import csv
import importlib
import json
import os
import re
import shlex
import subprocess
import tomllib
from dataclasses import fields

import pytest
from typer.testing import CliRunner

from airborne.body import files as bodies
from airborne.body.files import read_body
from airborne.body.human import BALL_LIMITS_DEG, HINGE_LIMITS_DEG, PARENTS
from airborne.cli import app, command_tree
from airborne.evaluation import PlayerErrors, PlayersComparison
from airborne.evaluation.jump_errors import JumpErrors
from airborne.evaluation.players import PartErrors
from airborne.export.figures import write_figures
from airborne.motion import covariance_file, flight_summary, measure_flight
from airborne.motion.files import _header
from airborne.motion.frame_file import FRAME_SD_FILE
from airborne.motion.run_folder import SMOOTH_JOINTS, SMOOTH_RECORD, TABLES, TRACKED_MOTION, figures_of
from airborne.run import smooth
from airborne.run.body_tables import write_tables
from airborne.run.evaluate import assess
from airborne.run.own_body import PICTURE
from airborne.run.track import track_trial
from airborne.trial.body import BodyTable
from airborne.trial.calibration import CalibrationTable
from airborne.trial.cameras import CameraTable
from airborne.trial.file import Trial, read_trial
from airborne.trial.keys import KeyTable
from airborne.trial.lights import LampTable, LightsTable
from airborne.trial.masks import MaskTable
from airborne.trial.players import PlayerTable
from airborne.trial.settings import PLAYERS_METHODS, BodySettings, ParticleSettings
from airborne.trial.start import StartTable
from tests.support.export_scenes import PERSON, person_run
from tests.support.places import ROOT
from tests.support.run_files import files_of

pytestmark = pytest.mark.usefixtures("_plain_figures")

DOCS = ROOT / "docs"
RESULTS = DOCS / "reference" / "results.md"
TRIAL = DOCS / "reference" / "trial.md"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted(DOCS.rglob("*.md"))]
TREE = command_tree()
LARGEST_IMAGES_BYTES = 700_000


def commands_below(command, name="airborne"):
    """Every command that does something, by its full name."""
    below = getattr(command, "commands", {})
    if not below:
        yield name, command
    for word, child in below.items():
        yield from commands_below(child, f"{name} {word}")


COMMANDS = dict(commands_below(TREE))


def fences(text, language):
    """The fenced blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def shown_commands(page):
    """Every `airborne ...` of a page: lines of its shell blocks, and inline code."""
    text = page.read_text(encoding="utf-8")
    lines = [part.strip() for block in fences(text, "bash") for line in block.splitlines() for part in line.split("&&")]
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    lines += [" ".join(code.split()) for code in re.findall(r"`(airborne [^`]*)`", prose)]
    return [line.removeprefix(".venv/bin/") for line in lines if re.match(r"(\.venv/bin/)?airborne\b", line)]


def complaint(line):
    """What is wrong with a command line as the program understands it; None where nothing is."""
    words, command, name = shlex.split(line)[1:], TREE, "airborne"
    while words and words[0] in getattr(command, "commands", {}):
        name = f"{name} {words[0]}"
        command = command.commands[words.pop(0)]
    if name not in COMMANDS and (words or name == "airborne"):
        return f"no command {' '.join([name, *words[:1]])}"
    options = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    unknown = [word for word in words if word.startswith("-") and word not in options]
    return f"{name} has no {', '.join(unknown)}" if unknown else None


def table_of(page, heading):
    """The rows below a heading, as lists of cells."""
    text = page.read_text(encoding="utf-8")
    found = re.search(rf"^#+ {re.escape(heading)}\n(.*?)(?=^#|\Z)", text, re.MULTILINE | re.DOTALL)
    assert found, f"{page.name} has no heading {heading}"
    rows = [line.strip().strip("|").split(" | ") for line in found[1].splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row] for row in rows[2:]]


def named(cell):
    """The names in a table's cell, spans such as `r00` … `r22` written out by their ends."""
    return re.findall(r"`([^`]+)`", cell)


def test_a_wrong_command_is_noticed():
    assert complaint("airborne trick trial.toml") == "no command airborne trick"
    assert complaint("airborne track trial.toml --fast") == "airborne track has no --fast"
    assert complaint("airborne synth cross -o x --seed 3") is None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_command_shown_exists_with_its_options(page):
    assert [wrong for line in shown_commands(page) if (wrong := complaint(line))] == []


def test_every_command_is_shown_somewhere():
    shown = " ".join(f"{line} " for page in PAGES for line in shown_commands(page))
    assert [name for name in COMMANDS if f"{name} " not in shown] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_page_of_help_with_an_example_that_exists(name):
    command = COMMANDS[name]
    example = re.search(r"Example: (airborne .*)", command.help or "")
    assert example, f"{name} --help shows no example"
    assert example[1].startswith(name)
    assert complaint(example[1]) is None
    assert all(getattr(parameter, "help", "") for parameter in command.params if parameter.name != "help")


def test_help_shows_square_brackets():
    text = CliRunner().invoke(app, ["track", "--help"]).output
    assert "frames that new or changed [[key]] and [[mask]] tables touch" in " ".join(text.replace("│", " ").split())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_every_word_that_was_written(name):
    text = CliRunner().invoke(app, [*name.split()[1:], "--help"]).output
    shown = "".join(text.split())
    texts = [COMMANDS[name].help, *(parameter.help for parameter in COMMANDS[name].params)]
    assert [each for each in texts if "".join(each.split()) not in shown] == []


def slug(heading):
    """The name by which the repository's page links to a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_link_leads_somewhere(page):
    broken = []
    for link in re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
        if link.startswith("https://") or link.endswith("gallery/index.rst"):  # the gallery is made with the site
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if not target.is_file() or (
            anchor and anchor not in map(slug, re.findall(r"^#+ (.*)", target.read_text(encoding="utf-8"), re.M))
        ):
            broken.append(link)
    assert broken == []


def test_the_readme_links_every_page():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    pages = [page.relative_to(ROOT).as_posix() for page in DOCS.rglob("*.md") if page.name != "index.md"]
    assert [page for page in pages if f"({page})" not in readme] == []


def test_images_are_small():
    assert sum(path.stat().st_size for path in (DOCS / "images").iterdir()) < LARGEST_IMAGES_BYTES


MODELS = {
    "`[[camera]]`": CameraTable,
    "`[calibration]`": CalibrationTable,
    "`[body]`": BodyTable,
    "`[start]`": StartTable,
    "`[[key]]`": KeyTable,
    "`[[mask]]`": MaskTable,
    "`[[start.player]]`": PlayerTable,
    "`[lights]`": LightsTable,
    "`[[lights.lamp]]`": LampTable,
    "Body": bodies._BodyTable,
    "`[[segment]]`": bodies._SegmentTable,
    "`[[segment.part]]`": bodies._PartTable,
    "`[segment.limits]`": bodies._LimitsTable,
    "`[segment.inertia]`": bodies._InertiaTable,
    "`[[landmark]]`": bodies._LandmarkTable,
}


@pytest.mark.parametrize("heading", MODELS)
def test_every_key_is_documented_with_its_default(heading):
    check_keys(heading, MODELS[heading].model_fields)


def test_every_setting_of_a_method_is_documented_with_its_default():
    check_keys("`[track]`", {**ParticleSettings.model_fields, **BodySettings.model_fields})


def check_keys(heading, expected):
    documented = {row[0].strip("`"): row[1].strip("`") for row in table_of(TRIAL, heading)}
    assert set(documented) == set(expected)
    for key, field in expected.items():
        if field.is_required():
            assert documented[key] == "required", key
        elif field.default is None:
            assert documented[key] == "none", key
        else:
            assert tomllib.loads(f"value = {documented[key]}")["value"] == field.default, key


def test_every_table_of_the_trial_file_has_a_section():
    text = (TRIAL).read_text(encoding="utf-8")
    rows = {row[0].strip("`") for row in table_of(TRIAL, "Top level")}
    headings = {slug(heading) for heading in re.findall(r"^## (.*)", text, re.MULTILINE)}
    assert set(Trial.model_fields) == rows | (headings & set(Trial.model_fields))


def test_examples_of_trial_files_are_valid():
    trial, body = fences((TRIAL).read_text(encoding="utf-8"), "toml")
    short, person, players = fences((ROOT / "README.md").read_text(encoding="utf-8"), "toml")
    assert len(Trial.model_validate(tomllib.loads(trial)).camera) == 3
    assert len(Trial.model_validate(tomllib.loads(short)).camera) == 2
    assert len(Trial.model_validate(tomllib.loads(person)).model().segments) == 18
    assert Trial.model_validate(tomllib.loads(players)).has_players
    assert len(bodies._BodyTable.model_validate(tomllib.loads(body)).segment) == 2


def test_the_example_body_is_a_body(tmp_path):
    _, body = fences((TRIAL).read_text(encoding="utf-8"), "toml")
    (tmp_path / "body.toml").write_text(body)
    corners = ["0 0 0", "100 0 0", "0 100 0", "0 0 100"]
    faces = ["1 3 2", "1 2 4", "1 4 3", "2 3 4"]
    (tmp_path / "cap.obj").write_text("\n".join([*(f"v {c}" for c in corners), *(f"f {f}" for f in faces)]) + "\n")
    assert [segment.name for segment in read_body(tmp_path / "body.toml").segments] == ["torso", "head"]


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


def test_every_method_of_players_stands_in_the_page_on_legs():
    header = next(
        line
        for line in (DOCS / "explanation" / "legs.md").read_text(encoding="utf-8").splitlines()
        if line.startswith("| |")
    )
    assert set(named(header)) == set(PLAYERS_METHODS)


@pytest.mark.parametrize(("page", "least"), [("methods.md", 8), ("human.md", 9), ("legs.md", 7)])
def test_constants_in_the_pages_on_methods_are_those_of_the_code(page, least):
    text = (DOCS / "explanation" / page).read_text(encoding="utf-8")
    checked = 0
    for line in text.splitlines():
        for module, name in re.findall(r"`((?:\w+\.)+\w+)\.(_?[A-Z][A-Z0-9_]+)`", line):
            value = getattr(importlib.import_module(f"airborne.{module}"), name)
            values = value if isinstance(value, tuple) else (value,)
            context = text[max(text.index(line) - 120, 0) : text.index(line) + len(line)]
            missing = [v for v in values if not re.search(rf"(?<![\d.]){re.escape(f'{v:g}')}(?![\d]|\.\d)", context)]
            assert missing == [], f"{module}.{name} is {value}"
            checked += 1
    assert checked >= least


def test_continuous_integration_runs_the_command_of_the_readme():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = re.search(r"^<!-- tests -->\n```bash\n(.*)\n```$", text, re.MULTILINE)
    assert shown and "pytest" in shown[1]
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    reading = next(line for line in script.splitlines() if line.startswith("command="))
    done = subprocess.run(["bash", "-c", f'{reading}; echo "$command"'], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == shown[1] + "\n"
    assert 'bash -euo pipefail -c "$command"' in script


def test_constraints_pin_every_package_that_is_asked_for():
    pins = dict(line.split("==") for line in (ROOT / "constraints.txt").read_text().splitlines())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = [*project["dependencies"], *(one for extra in project["optional-dependencies"].values() for one in extra)]
    names = {re.match(r"[\w-]+", one)[0].lower() for one in asked} - {"airborne"}
    assert names <= {name.lower().replace("_", "-") for name in pins}
    assert "airborne" not in pins


def test_all_text_is_free_of_machine_paths():
    texts = {page.name: page.read_text(encoding="utf-8") for page in [*PAGES, ROOT / ".ci" / "run"]}
    assert [name for name, text in texts.items() if re.search(r"(?<![\w.])/(home|tmp|root|opt|usr/local)/", text)] == []
