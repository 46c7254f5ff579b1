"""The tutorial is done from its first line to its last: every file written, every command and snippet run."""

import re

import matplotlib as mpl
import numpy as np
import pytest

from tests.support.pages import STEPS, run
from tests.support.places import ROOT

pytestmark = pytest.mark.usefixtures("_plain_figures")

PAGE = ROOT / "docs" / "tutorials" / "first-trial.md"
FILES = {"my-throw/body.toml", "my-throw/start.csv", "my-throw/trial.toml"}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder in which everything was done, and what each command printed."""
    folder, printed, written = tmp_path_factory.mktemp("tutorial"), {}, set()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        mpl.use("Agg")
        for name, language, text in STEPS.findall(PAGE.read_text(encoding="utf-8")):
            if language == "bash":
                printed |= {line: run(line) for line in text.splitlines()}
            elif language == "python":
                exec(compile(text, str(PAGE), "exec"), {})
            else:
                (folder / name).write_text(text, encoding="utf-8")
                written.add(name)
    assert written == FILES
    return folder, printed


def test_the_tutorial_leaves_what_it_says(done):
    folder, printed = done
    for name in (
        "calib.toml",
        "results/report.html",
        "results/agreement_methods.txt",
        "results/tables/smooth_motion.csv",
    ):
        assert (folder / name).is_file(), name
    assert (folder / "results" / "export" / "results.c3d").is_file()
    assert (folder / "angles.png").stat().st_size > 10_000
    assert "34 tracked" in printed["airborne track my-throw/trial.toml -o results"]


def test_the_tutorial_states_its_errors_rightly(done):
    _, printed = done
    text = printed["airborne evaluate results --digitised my-throw/digitised.csv"]
    mm = [float(each) for each in re.findall(r"^  [xyz] +([\d.]+) ", text, re.MULTILINE)][:3]
    deg = [float(each) for each in re.findall(r"^  (?:somersault|tilt|twist) +([\d.]+) ", text, re.MULTILINE)][:3]
    np.testing.assert_allclose(mm, 2.0, atol=0.5)
    np.testing.assert_allclose(deg, 0.5, atol=0.15)


def test_every_file_that_the_tutorial_leaves_is_documented(done):
    folder, _ = done
    page = (ROOT / "docs" / "reference" / "results.md").read_text(encoding="utf-8")
    cells = " ".join(re.findall(r"^\| (`.*?) \|", page, re.MULTILINE))
    known = re.escape(" ".join(re.findall(r"`([^`]+)`", cells))).replace("<camera>", "cam\\d")
    known = re.sub("<reference>", "(truth|digitised)", known).split("\\ ")
    left = [
        path.relative_to(folder / "results").as_posix()
        for path in (folder / "results").rglob("*")
        if path.is_file() and path.parent.name != "export"
    ]
    assert [name for name in sorted(left) if not any(re.fullmatch(each, name) for each in known)] == []
