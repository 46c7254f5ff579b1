"""The documentation says what the program does: commands, keys, files, columns, constants, links."""

import importlib
import os
import re
import shlex
import subprocess
import tomllib

import pytest
from typer.testing import CliRunner

from airborne.body import files as bodies
from airborne.body.files import read_body
from airborne.cli import app, command_tree
from airborne.trial.body import BodyTable
from airborne.trial.calibration import CalibrationTable
from airborne.trial.cameras import CameraTable
from airborne.trial.file import Trial
from airborne.trial.keys import KeyTable
from airborne.trial.lights import LampTable, LightsTable
from airborne.trial.masks import MaskTable
from airborne.trial.players import PlayerTable
from airborne.trial.settings import BodySettings, ParticleSettings
from airborne.trial.start import StartTable
from tests.support.docs import DOCS, TRIAL, fences, table_of
from tests.support.places import ROOT

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
