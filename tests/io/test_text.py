"""TOML and JSON of any content are read, or refused as broken files are, in little time."""

import time
import tomllib

import pytest

from airborne.io.text import parse_toml, read_json, read_toml


def test_plain_files_are_read(tmp_path):
    (tmp_path / "a.toml").write_text("\ufeffa.b.c = [1, 2.5]\n[d]\ne = '1.2.3'\n", encoding="utf-8")
    (tmp_path / "a.json").write_text('{"a": [1]}')
    assert read_toml(tmp_path / "a.toml") == {"a": {"b": {"c": [1, 2.5]}}, "d": {"e": "1.2.3"}}
    assert read_json(tmp_path / "a.json") == {"a": [1]}


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a" + ".a" * 50_000 + " = 1", "a = " + "9" * 5000, "a = {"])
def test_odd_toml_is_broken_toml_and_soon(text):
    before = time.process_time()
    with pytest.raises(tomllib.TOMLDecodeError):
        parse_toml(text)
    assert time.process_time() - before < 2


@pytest.mark.parametrize("text", ["[" * 100_000, "{", "9" * 5000])
def test_odd_json_is_a_value_error(tmp_path, text):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(ValueError):
        read_json(tmp_path / "a.json")


def test_many_numbers_with_points_are_no_deep_key():
    row = ", ".join(["1.5"] * 10_000)
    assert len(parse_toml(f"a = [{row}]")["a"]) == 10_000
