"""A name is a name, a path a path, and a file named after a name stays in its folder."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airborne.io.names import check_column, check_name, check_path, file_stem

BAD = [
    "",
    " ",
    ".",
    "..",
    ".hidden",
    "a/b",
    "../a",
    "a\\b",
    "a\nb",
    "a\0b",
    "a\x1b[31m",
    "\u202eevil",
    "a\u2028b",
    "x" * 81,
]
GOOD = ["left", "cam 1", "Anna-Lena", "Zoë", "選手", "number 7", "x" * 80, "😀" * 80, "a.b", "http:", "CON", "%s{0}"]


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_name_is_refused_with_the_mend(name):
    with pytest.raises(ValueError, match="rename"):
        check_name(name)


@pytest.mark.parametrize("name", GOOD)
def test_names_of_any_script_are_names(name, tmp_path):
    assert check_name(name) == name
    (tmp_path / f"overlay_{file_stem(name)}.part.mp4").touch()


@given(st.text(max_size=100))
def test_a_file_named_after_any_name_stays_in_its_folder(tmp_path_factory, name):
    folder = tmp_path_factory.getbasetemp()
    try:
        stem = file_stem(name)
    except ValueError:
        return
    path = folder / f"overlay_{stem}.part.mp4"
    assert path.resolve().parent == folder.resolve()
    path.touch()
    path.unlink()


def test_long_names_that_begin_alike_are_told_apart():
    names = ["選" * 79 + end for end in "ab"]
    assert file_stem(names[0]) != file_stem(names[1])
    assert max(len(file_stem(name).encode()) for name in names) <= 160


def test_a_column_has_no_comma_and_no_quote():
    assert check_column("knee left") == "knee left"
    for name in ("a,b", 'a"b'):
        with pytest.raises(ValueError, match="comma or a quote"):
            check_column(name)


@pytest.mark.parametrize("path", ["", "  ", "a\0b", "a\nb", "x" * 256, "ä" * 128, "a/" * 600])
def test_what_no_file_can_be_called_is_no_path(path):
    with pytest.raises(ValueError, match=r"empty|control character|bytes"):
        check_path(path)
