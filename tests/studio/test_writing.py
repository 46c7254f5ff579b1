"""Files of a trial are written whole, edits are undone and done again, earlier versions are kept."""

import subprocess
import sys
import time

import numpy as np
import pytest

from airborne.errors import AirborneError, TrialError
from airborne.studio.session import Session
from airborne.studio.writing import FOLDER, KEPT, Editor

N_KILLS = 6


@pytest.fixture
def editor(tmp_path):
    return Editor(tmp_path)


def test_edits_are_undone_and_done_again_in_their_order(editor, tmp_path):
    path = tmp_path / "trial.toml"
    editor.write("trial.toml", "a = 1\n", "first")
    editor.write("trial.toml", "a = 2\n", "second")
    assert editor.undo() == "second (trial.toml)"
    assert path.read_text() == "a = 1\n"
    assert editor.undo() == "first (trial.toml)"
    assert not path.exists()
    assert (editor.redo(), editor.redo()) == ("first (trial.toml)", "second (trial.toml)")
    assert path.read_text() == "a = 2\n"
    with pytest.raises(TrialError, match="nothing to redo"):
        editor.redo()


def test_a_new_edit_ends_what_could_be_done_again(editor):
    editor.write("a.csv", "1", "first")
    editor.undo()
    editor.write("a.csv", "2", "other")
    assert (editor.last, editor.next) == ("other (a.csv)", None)


def test_what_others_changed_since_is_not_undone(editor, tmp_path):
    editor.write("a.csv", "1", "click")
    (tmp_path / "a.csv").write_text("by hand")
    with pytest.raises(TrialError, match=r"a\.csv was changed elsewhere since"):
        editor.undo()
    assert (tmp_path / "a.csv").read_text() == "by hand"


def test_the_last_versions_are_kept(editor, tmp_path):
    for number in range(KEPT + 5):
        editor.write("a.csv", str(number), "click")
    kept = sorted((tmp_path / FOLDER / "versions").iterdir(), key=lambda path: int(path.suffix[1:]))
    assert [path.read_text() for path in kept] == [str(number) for number in range(4, KEPT + 4)]
    assert not list(tmp_path.glob("*.part"))


def test_what_others_changed_stands_in_the_way_of_no_other_file(editor, tmp_path):
    editor.write("b.csv", "1", "other click")
    editor.write("a.csv", "1", "click")
    editor.write("a.csv", "2", "click")
    (tmp_path / "a.csv").write_text("by hand")
    with pytest.raises(TrialError, match="can no longer be undone"):
        editor.undo()
    assert editor.undo() == "other click (b.csv)"
    assert not (tmp_path / "b.csv").exists()


def test_what_a_command_writes_is_kept_and_undone(editor, tmp_path):
    path, has_ended = tmp_path / "trial.toml", []
    editor.write("trial.toml", "a = 1\n", "first")
    editor.expect("trial.toml", "offsets found", lambda: bool(has_ended))
    editor.write("trial.toml", "a = 2\n", "meanwhile")
    path.write_text("a = 2\noffset_s = 0.1\n")
    has_ended.append(True)
    assert editor.undo() == "offsets found (trial.toml)"
    assert path.read_text() == "a = 2\n"
    assert (editor.undo(), editor.undo()) == ("meanwhile (trial.toml)", "first (trial.toml)")
    for _ in range(3):
        editor.redo()
    assert path.read_text() == "a = 2\noffset_s = 0.1\n"


def test_a_file_that_a_command_overwrites_keeps_its_earlier_version(editor, tmp_path):
    path = tmp_path / "calib_studio.toml"
    path.write_text("old cameras")
    editor.expect(path.name, "cameras calibrated", lambda: True)
    path.write_text("new cameras")
    assert [each.read_text() for each in (tmp_path / FOLDER / "versions").iterdir()] == ["old cameras"]
    editor.undo()
    assert path.read_text() == "old cameras"


def test_a_command_that_writes_nothing_is_no_edit(editor):
    editor.expect("trial.toml", "offsets found", lambda: True)
    editor.settle()
    assert editor.last is None


@pytest.mark.parametrize("name", ["../a.toml", "/tmp/a.toml", "link.toml", "inside/../../a.toml"])
def test_nothing_is_written_outside_the_folder(tmp_path, name):
    folder = tmp_path / "trial"
    folder.mkdir()
    (tmp_path / "other.toml").write_text("theirs")
    (folder / "link.toml").symlink_to(tmp_path / "other.toml")
    with pytest.raises(TrialError, match="leads out of"):
        Editor(folder).write(name, "x", "attack")
    assert (tmp_path / "other.toml").read_text() == "theirs"


def test_a_file_is_whole_whenever_its_writer_is_killed(tmp_path):
    code = (
        "import sys; from pathlib import Path; from airborne.studio.writing import Editor\n"
        "editor = Editor(Path(sys.argv[1]))\n"
        "for number in range(10**9): editor.write('a.csv', f'{number}\\n' * 20_000, 'click')"
    )
    path, rng = tmp_path / "a.csv", np.random.default_rng(0)
    for _ in range(N_KILLS):
        before = path.stat().st_mtime_ns if path.exists() else 0
        with subprocess.Popen([sys.executable, "-c", code, str(tmp_path)]) as process:
            while not path.exists() or path.stat().st_mtime_ns == before:
                time.sleep(0.01)
            time.sleep(rng.uniform(0, 0.1))
            process.kill()
        lines = path.read_text().splitlines()
        assert len(lines) == 20_000
        assert len(set(lines)) == 1
        assert 1 <= len(list((tmp_path / FOLDER / "versions").iterdir())) <= KEPT + 1


@pytest.mark.parametrize("link", [FOLDER, f"{FOLDER}/versions", f"{FOLDER}/track.log"])
def test_nothing_is_kept_through_a_link_that_leads_elsewhere(tmp_path, link):
    folder, elsewhere = tmp_path / "trial", tmp_path / "elsewhere"
    (folder / link).parent.mkdir(parents=True)
    elsewhere.mkdir()
    (folder / link).symlink_to(elsewhere)
    with pytest.raises(AirborneError, match="link"):
        Session(folder, folder / "trial.toml")
    assert not list(elsewhere.iterdir())


def test_a_file_that_is_no_text_is_one_line(tmp_path):
    (tmp_path / "trial.toml").write_bytes(b"name = '\xff'")
    with pytest.raises(
        TrialError, match=r"trial\.toml cannot be read \(it is not a text file in UTF-8; save it as UTF-8\)"
    ):
        Editor(tmp_path).write("trial.toml", "x", "edit")
