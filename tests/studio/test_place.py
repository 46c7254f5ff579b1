"""The studio opens again where it was."""

import pytest

from airborne.studio.place import Place, read_place, write_place
from airborne.studio.session import Session
from airborne.studio.writing import FOLDER


def test_page_and_frame_are_found_again(tmp_path):
    session = Session(tmp_path, tmp_path / "trial.toml")
    assert session.place == Place("/", 0)
    session.go(page="/review")
    session.go(frame=17)
    assert Session(tmp_path, tmp_path / "trial.toml").place == Place("/review", 17)


@pytest.mark.parametrize(
    "text", ["", "[", "[1]", '{"page": 3, "frame": 1}', '{"page": "/", "frame": -1}', '{"page": "/"}']
)
def test_a_place_that_is_none_is_the_beginning(tmp_path, text):
    write_place(tmp_path, Place("/track", 3))
    (tmp_path / FOLDER / "place.json").write_text(text)
    assert read_place(tmp_path) == Place()
