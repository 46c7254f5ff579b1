"""The page "A study, from filming to figures" is done from its first command to its last, on synthetic athletes."""

import csv
import re

import matplotlib as mpl
import pytest

from tests.support.athletes import ATHLETES, CONDITIONS, write_season
from tests.support.batch_work import work_here
from tests.support.pages import STEPS, run
from tests.support.places import ROOT

PAGE = ROOT / "docs" / "how-to" / "study.md"

pytestmark = pytest.mark.usefixtures("_plain_figures")


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder in which everything was done, and what each command printed."""
    folder, printed = tmp_path_factory.mktemp("study"), {}
    write_season(folder, n_trials=1, n_pictures=4)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        work_here(patch)
        mpl.use("Agg")
        for _, language, text in STEPS.findall(PAGE.read_text(encoding="utf-8")):
            if language == "bash":
                printed |= {line: run(line) for line in text.splitlines()}
            elif language == "toml":
                session = folder / "study" / "session.toml"
                session.write_text(f"{session.read_text()}\n{text}")
    return folder, printed


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_throw_is_tracked(done):
    folder, printed = done
    rows = rows_of(folder / "results" / "trials.csv")
    assert len(rows) == len(ATHLETES) * len(CONDITIONS)
    assert {row["status"] for row in rows} == {"done"}
    assert {row["share_lost"] for row in rows} == {"0.0"}
    planned = printed["airborne batch study -o results --dry-run"].splitlines()
    assert planned and all(line.endswith(": track") for line in planned)


def test_fast_throws_turn_faster(done):
    folder, _ = done
    number, curve = rows_of(folder / "comparison" / "differences.csv")
    assert (number["a"], number["b"], number["level"]) == ("slow", "fast", "within athletes")
    assert float(number["low"]) > 0
    assert float(curve["difference"]) > 0


def test_every_file_and_column_of_a_batch_is_documented(done):
    folder, _ = done
    page = PAGE.read_text(encoding="utf-8")
    cells = " ".join(re.findall(r"^\| (`.*?) \|", page, re.MULTILINE))
    known = set(re.findall(r"`([^`]+)`", cells))
    assert {path.name for path in (folder / "results").iterdir()} - {"index.html", "trials.csv", "trials.parquet"} == {
        "logs",
        "thumbnails",
        *(path.stem for path in (folder / "study" / "trials").iterdir()),
    }
    for path in (folder / "comparison").iterdir():
        assert re.sub(r"^somersault_(rev|deg)", "<variable>", path.name) in known, path.name
    assert set(rows_of(folder / "results" / "trials.csv")[0]) <= known | {"athlete", "condition", "number"}


def test_the_page_of_a_batch_links_to_its_reports(done):
    folder, _ = done
    page = (folder / "results" / "index.html").read_text()
    links = re.findall(r'(?:href|src)="([^"]+)"', page)
    assert len(links) > 15
    assert all((folder / "results" / link).is_file() for link in links)
