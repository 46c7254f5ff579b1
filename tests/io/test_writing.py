"""A full disk: the line names the file and what is free; what was whole before stays."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from airborne.errors import AirborneError, ResultError
from airborne.io.figures import names_not_drawn
from airborne.io.writing import explain_full_disk, replace_text, write_text
from airborne.video import VideoWriter
from tests.support.run_files import contents_of

FULL = Path("/dev/full")
needs_full = pytest.mark.skipif(not FULL.exists(), reason="a system without /dev/full")


@needs_full
def test_a_full_disk_is_told_with_the_file_and_the_free_space():
    with pytest.raises(ResultError, match=r"/dev/full cannot be written \(No space left on device\): \d+ MB are free"):
        write_text(FULL, "x")
    with pytest.raises(AirborneError, match="/dev/full cannot be written"):
        VideoWriter(FULL, size=(64, 48), rate=Fraction(50))


def test_other_errors_are_left_to_who_knows_them(tmp_path):
    with pytest.raises(PermissionError), explain_full_disk(tmp_path / "a"):
        raise PermissionError


def test_names_that_the_font_cannot_draw_are_told_once():
    assert names_not_drawn(["left", "Zoë", "Łukasz", "Ελένη", "Андрей"]) == []
    (line,) = names_not_drawn(["left", "選手", "選手", "김"])
    assert "boxes" in line and "選手, 김" in line


def test_a_file_that_is_written_anew_stays_as_it_was_until_it_is_whole(tmp_path):
    path = tmp_path / "overlay_cam1.mp4"
    image = np.zeros((48, 64, 3), np.uint8)
    for level in (0, 9):
        with VideoWriter(path, size=(64, 48), rate=Fraction(50)) as writer:
            before = contents_of(tmp_path)
            for _ in range(3 + level):
                writer.write(image + np.uint8(level))
            assert level == 0 or contents_of(tmp_path)["overlay_cam1.mp4"] == before["overlay_cam1.mp4"]
    whole = contents_of(tmp_path)
    assert list(whole) == ["overlay_cam1.mp4"]
    with pytest.raises(RuntimeError), VideoWriter(path, size=(64, 48), rate=Fraction(50)) as writer:
        writer.write(image)
        raise RuntimeError
    assert contents_of(tmp_path) == whole


def test_a_file_is_replaced_through_no_link_and_over_a_killed_writers_rest(tmp_path):
    other = tmp_path / "other.txt"
    other.write_text("theirs")
    (tmp_path / "a.txt.part").symlink_to(other)
    replace_text(tmp_path / "a.txt", "ours")
    (tmp_path / "a.txt.part").write_text("torn")
    replace_text(tmp_path / "a.txt", "again", is_durable=False)
    assert other.read_text() == "theirs"
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "again", "other.txt": "theirs"}


def test_a_file_that_could_not_be_written_leaves_no_rest(tmp_path):
    with pytest.raises(UnicodeEncodeError):
        replace_text(tmp_path / "a.txt", "\ud800")
    assert contents_of(tmp_path) == {}
