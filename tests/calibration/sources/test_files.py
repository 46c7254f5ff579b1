"""The file of sources: every key is documented with its default, the page's examples are valid."""

import re
import tomllib

import pytest

from airborne.calibration.sources import files as tables
from airborne.calibration.sources.files import Sources, read_sources
from airborne.errors import CalibrationError
from tests.support.places import ROOT

PAGE = ROOT / "docs" / "reference" / "calibration.md"
MODELS = {
    "[[camera]]": tables.CameraSource,
    "[start]": tables.StartSource,
    "[world]": tables.WorldTable,
    "[control_points]": tables.PointsSource,
    "[board]": tables.BoardSource,
    "[wand]": tables.WandSource,
    "[court]": tables.CourtSource,
    "[detections]": tables.DetectionsSource,
}


@pytest.mark.parametrize("name", MODELS)
def test_every_key_is_documented_with_its_default(name):
    text = PAGE.read_text(encoding="utf-8")
    section = re.search(rf"^### `{re.escape(name)}`\n(.*?)(?=^#|\Z)", text, re.MULTILINE | re.DOTALL)
    assert section, name
    rows = [
        [cell.strip() for cell in line.strip("|").split(" | ")] for line in section[1].splitlines() if line[:3] == "| `"
    ]
    documented = {row[0].strip("`"): row[1].strip("`") for row in rows}
    assert list(documented) == list(MODELS[name].model_fields)
    for key, field in MODELS[name].model_fields.items():
        if field.is_required():
            assert documented[key] == "required", key
        elif field.default is None:
            assert documented[key] == "none", key
        else:
            assert tomllib.loads(f"value = {documented[key]}")["value"] == field.default, key


def test_every_table_has_a_section():
    assert {name.strip("[]") for name in MODELS} == set(Sources.model_fields)


def test_examples_of_the_page_are_valid():
    blocks = re.findall(r"^```toml\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    given = [list(Sources.model_validate(tomllib.loads(block)).tables) for block in blocks]
    assert given == [["board", "court"], ["detections"]]


@pytest.mark.parametrize("text", ["", "camera = 3", "[[camera]]", "\x00", "[board", "[[camera]]\nname='a'\nsize=[0,1]"])
def test_a_file_that_is_none_is_refused_in_one_line(tmp_path, text):
    path = tmp_path / "sources.toml"
    path.write_text(text)
    with pytest.raises(CalibrationError, match=r"sources\.toml") as caught:
        read_sources(path)
    assert "\n" not in str(caught.value)
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_sources(tmp_path / "none.toml")


def test_another_kind_of_file_is_reported(tmp_path):
    path = tmp_path / "sources.toml"
    for text, found in (("[cam1]\nmatrix = 1", "cam1"), ('name = "x"\n[[camera]]\n[body]', "name, camera, body")):
        path.write_text(text)
        with pytest.raises(CalibrationError, match=rf"is not a sources file: expected .* \(found {found}\)"):
            read_sources(path)


@pytest.mark.parametrize(("net", "said"), [('"boys"', "expected 'men' or 'women'"), ("-1", "expected more than 0")])
def test_a_choice_that_is_none_names_its_place_and_no_inner_kind(tmp_path, net, said):
    path = tmp_path / "sources.toml"
    path.write_text(f'[[camera]]\nname = "a"\nsize = [100, 100]\n[court]\nfile = "x"\nnet = {net}\n')
    with pytest.raises(CalibrationError, match=rf"sources\.toml: court\.net: .*{said}") as caught:
        read_sources(path)
    assert "more mistake" not in str(caught.value)
