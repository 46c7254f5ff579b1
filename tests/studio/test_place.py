"""The studio opens again where it was, and with every edit, whenever it is killed."""

import os
import random
import shutil

import pytest

from airborne.studio.place import LastView, read_place, write_place
from airborne.studio.session import Session
from airborne.studio.writing import FOLDER
from tests.support.commands import refusal
from tests.support.places import THROWN_CROSS
from tests.support.studio import fork_studio
from tests.support.studio_edits import edits_found, kill_while_editing

N_KILLS = 2  # more: benchmarks/kills.py studio


def test_page_and_frame_are_found_again(tmp_path):
    session = Session(tmp_path, tmp_path / "trial.toml")
    assert session.place == LastView("/", 0)
    session.go(page="/review")
    session.go(frame=17)
    assert Session(tmp_path, tmp_path / "trial.toml").place == LastView("/review", 17)


@pytest.mark.parametrize(
    "text", ["", "[", "[1]", '{"page": 3, "frame": 1}', '{"page": "/", "frame": -1}', '{"page": "/"}']
)
def test_a_place_that_is_none_is_the_beginning(tmp_path, text):
    write_place(tmp_path, LastView("/track", 3))
    (tmp_path / FOLDER / "place.json").write_text(text)
    assert read_place(tmp_path) == LastView()


def test_no_edit_is_lost_when_the_studio_is_killed(tmp_path):
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    rng = random.Random(5)
    for _ in range(N_KILLS):
        last = kill_while_editing(folder, 0.3, rng)
        click, start, draft, frame = edits_found(folder)
        assert last <= frame <= draft <= start <= click <= last + 1


def test_the_address_that_is_printed_is_the_page_that_was_open(tmp_path):
    write_place(tmp_path, LastView("/videos/../etc", 3))
    with fork_studio(tmp_path) as address:
        assert "/?token=" in address
    write_place(tmp_path, LastView("/review", 3))
    with fork_studio(tmp_path) as address:
        assert "/review?token=" in address


def test_a_folder_is_open_in_one_studio_at_a_time(tmp_path, capsys):
    (folder := tmp_path / "A").mkdir()
    with fork_studio(folder) as address:
        says = refusal(capsys, "studio", folder, "--no-browser")
        assert (folder / FOLDER / "address").stat().st_mode & 0o077 == 0  # it holds the token
    assert "is open in another studio (process " in says
    assert f"; open {address}, or end it first" in says
    with fork_studio(folder):
        pass


def test_a_folder_that_may_not_be_written_is_refused_with_what_to_do(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: mode != os.W_OK)
    assert "copy the folder to where you may write" in refusal(capsys, "studio", tmp_path, "--no-browser")
    monkeypatch.chdir(tmp_path)
    assert "copy the folder to where you may write" in refusal(capsys, "studio", "--demo", "--no-browser")
    assert list(tmp_path.iterdir()) == []


def test_a_trial_that_is_half_written_is_refused_with_its_line_and_where_older_ones_are(tmp_path, capsys):
    path = tmp_path / "trial.toml"
    session = Session(tmp_path, path)
    session.edit("trial.toml", 'name = "a"\n', "first")
    path.write_text('name = "a"\n\n[[camera]]\nname = "le')
    assert "at line 4, the end of the file" in (says := refusal(capsys, "studio", path, "--no-browser"))
    assert "earlier versions" not in says
    session.edit("trial.toml", 'name = "b"\n', "second")
    path.write_text('name = "a"\n[[camera\n')
    assert "at line 2, column 9" in (says := refusal(capsys, "studio", path, "--no-browser"))
    assert says.rstrip().endswith("; its earlier versions are in .airborne/versions")
