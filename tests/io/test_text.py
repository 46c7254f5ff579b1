"""TOML, JSON and YAML of any content are read, or refused as broken files are, in little time."""

import os
import time
import tomllib
from pathlib import Path

import pytest

from airborne.io.text import parse_toml, read_bytes, read_csv, read_flat_yaml, read_json, read_toml


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


def flat_yaml(folder, text):
    (folder / "a.yml").write_text(text)
    return read_flat_yaml(folder / "a.yml")


def test_flat_yaml_is_keys_and_values_as_text(tmp_path):
    assert flat_yaml(tmp_path, "# measured\na: 1.5\nb: 1e-2\n'c d': 2001-13-45\n") == [
        ("a", "1.5"),
        ("b", "1e-2"),
        ("c d", "2001-13-45"),
    ]
    assert flat_yaml(tmp_path, '{"a": 1, "b": "x"}') == [("a", "1"), ("b", "x")]
    assert flat_yaml(tmp_path, "") == flat_yaml(tmp_path, "- 1\n") == []


ALIASES = "a0: &a0 {k: 1}\n" + "".join(f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}\n" for i in range(1, 12))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (ALIASES, "line 1: no anchor is read"),
        ("a: *b\n", "line 1: no alias is read"),
        *(
            (f"a: 1\nb: !!{tag} x\n", "line 2: no tag is read")
            for tag in ("int", "float", "timestamp", "binary", "set")
        ),
        ("a: !!python/object/apply:os.system [x]\n", "line 1: no tag is read"),
        ("a: [1, 2]\n", "line 1: expected one value"),
        ("a:\n  b: 1\n", "line 2: expected one value"),
        ("[" * 90_000, "it holds lists and tables"),
        ("a: " * 30_000, "mapping values are not allowed here"),
        ("a: 1\n" * 30_000, "larger than 0.1 MB"),
    ],
)
def test_yaml_that_is_not_flat_is_refused_in_one_line_and_soon(tmp_path, text, expected):
    before = time.process_time()
    with pytest.raises(ValueError, match=expected) as caught:
        flat_yaml(tmp_path, text)
    assert "\n" not in str(caught.value)
    assert time.process_time() - before < 4


def test_what_is_no_file_is_not_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", tmp_path, "/dev/zero", "/dev/null"):
        with pytest.raises(OSError, match=r"it is (not a file|a folder)"):
            read_bytes(Path(path), 1000)
    if os.path.exists("/proc/kmsg"):
        assert read_bytes(Path("/proc/kmsg"), 1000) == b""  # of 0 bytes, says the system; reading would wait for ever


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("point;x_m\nü;1,5\n".encode(), "columns are separated by semicolons; save it with commas"),
        (b"point\tx_m\na\t1.5\n", "columns are separated by tabs; save it with commas"),
        ("point,x_m\nü,1.5\n".encode("latin-1"), "not a text file in UTF-8; save it as UTF-8"),
        ("point,x_m\na,1.5\n".encode("utf-16"), "not a text file in UTF-8; save it as UTF-8"),
        (b"\x89PNG\r\n\x1a\n", "not a text file; expected a table"),
    ],
)
def test_of_a_table_in_another_form_it_is_said_how_to_save_it(tmp_path, data, said):
    (tmp_path / "a.csv").write_bytes(data)
    with pytest.raises(ValueError, match=said):
        read_csv(tmp_path / "a.csv", "expected a table", ValueError)


@pytest.mark.parametrize("text", ["a = 1,74\n", "b = 1\na = [0,033, 0.3]", "a = -0,5"])
def test_a_decimal_comma_in_toml_is_named(text):
    with pytest.raises(tomllib.TOMLDecodeError, match="a comma stands for a decimal point"):
        parse_toml(text)


def test_a_cell_may_hold_a_semicolon(tmp_path):
    (tmp_path / "a.csv").write_text("\ufeffpoint,note\na,b;c\n", encoding="utf-8")
    assert read_csv(tmp_path / "a.csv", "", ValueError) == [(1, ["point", "note"]), (2, ["a", "b;c"])]


def test_a_file_that_is_replaced_by_a_longer_one_is_read_whole(tmp_path, monkeypatch):
    path, longer, open_path = tmp_path / "a.toml", tmp_path / "longer.toml", Path.open
    path.write_text("a = 1\n")
    longer.write_text("a = [1, 2, 3]\n")

    def replace_and_open(self, *args):
        longer.replace(path)
        return open_path(self, *args)

    monkeypatch.setattr(Path, "open", replace_and_open)
    assert read_toml(path) == {"a": [1, 2, 3]}
