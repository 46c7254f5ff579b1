"""The guide for calibrating says what the program does: names, kinds of findings, examples."""

import contextlib
import io
import re
import tomllib
from itertools import product
from pathlib import Path

import numpy as np

from airborne.calibration import calibrate_from, sources_from
from airborne.calibration.sources.court import court_points
from tests.support.places import ROOT

TEXT = (ROOT / "docs" / "how-to" / "calibrate-your-cameras.md").read_text(encoding="utf-8")
SOURCES = ROOT / "src" / "airborne"
DIAGNOSIS = [*(SOURCES / "calibration" / "diagnosis").glob("*.py"), SOURCES / "cameras" / "units.py"]


def fences(language):
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)


def test_every_point_of_the_court_is_named():
    told = set()
    for row in re.findall(r"^\| (`[a-z_<]+.*?) \|", TEXT, re.MULTILINE):
        words = re.findall(r"`([^`]+)`", row)
        stem = words[0].partition("<side>")[0] + "<side>"
        for word in words:
            whole = stem + word if word.startswith("_") else word
            for half, side in product(("near", "far"), ("left", "right")):
                told.add(whole.replace("<half>", half).replace("<side>", side))
    assert {name for name in told if re.match("corner|attack|centre|net|antenna|post", name)} == set(
        court_points("men")
    )


def test_points_of_the_example_are_points_of_the_court():
    rows = fences("text")[0].splitlines()[1:]
    assert {row.split(",")[0] for row in rows} <= set(court_points("men"))


def test_the_example_of_the_court_gives_its_cameras(tmp_path):
    (tmp_path / "court_clicks.csv").write_text(fences("text")[0])
    sources = sources_from(tomllib.loads(fences("toml")[0]), tmp_path, "the page")
    found = calibrate_from(sources, lambda what, done, total: None)
    assert found.adjustment.rms_px() < 1
    assert np.allclose(found.rig["left"].centre, (-6.2, -13.5, 3.6), atol=0.1)
    assert np.allclose(found.rig["right"].centre, (7.1, -12.8, 4.1), atol=0.1)


def test_four_points_a_camera_do_not_claim_more_than_clicks_can_say(tmp_path):
    (tmp_path / "court_clicks.csv").write_text("\n".join(fences("text")[0].splitlines()[:5]))
    sources = sources_from(tomllib.loads(fences("toml")[0]), tmp_path, "the page")
    sd_m = calibrate_from(sources, lambda what, done, total: None).adjustment.camera_sd[:, 3:6]
    assert (np.linalg.norm(sd_m, axis=1) > 0.05).all()


def test_every_kind_of_finding_is_explained():
    kinds = set()
    for path in DIAGNOSIS:
        kinds |= set(re.findall(r'kind(?:, advice)? ?= ?"([a-z ]+)"', path.read_text(encoding="utf-8")))
    explained = set(re.findall(r"^\| `([a-z ]+)` \|", TEXT, re.MULTILINE))
    assert kinds == explained


def test_examples_of_sources_are_valid():
    court, wand = fences("toml")
    assert sources_from(tomllib.loads(court), Path(), "the page").tables.keys() == {"court"}
    assert sources_from(tomllib.loads(court + wand), Path(), "the page").tables.keys() == {"court", "wand"}


def test_the_example_of_a_finding_runs():
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(fences("python")[0], {})
    assert said.getvalue().startswith("left: its image numbers fall from 65535 to 0 after image 35")
