"""Trials that share a session: whose tables count, words in braces, paths, and what is refused."""

import pytest

from airborne.errors import TrialError
from airborne.trial.file import read_trial
from airborne.trial.remainder import parse_remainder
from airborne.trial.session import read_tables

SESSION = """
camera = [{ name = "left", video = "videos/{athlete}_{trial}_left.mp4" }]
calibration = { file = "calib.toml" }
body = { file = "body.toml" }
track = { every = 2 }
start = { find = true }
[athletes.berta.body]
preset = "human18"
stature_m = 1.72
mass_kg = 66.0
"""


def write(folder, text, name="throw_3"):
    (folder / "trials").mkdir(exist_ok=True)
    for file in ("calib.toml", "body.toml"):
        (folder / file).touch()
    if not (folder / "session.toml").exists():
        (folder / "session.toml").write_text(SESSION)
    path = folder / "trials" / f"{name}.toml"
    path.write_text(f'session = "../session.toml"\n{text}')
    return path


def test_two_lines_are_a_trial(tmp_path):
    trial = read_trial(write(tmp_path, 'labels = { athlete = "anna", condition = "dry", number = 3 }'))
    assert trial.name == "throw_3"
    assert trial.camera[0].video == "videos/anna_throw_3_left.mp4"
    assert trial.path(trial.camera[0].video) == tmp_path / "videos" / "anna_throw_3_left.mp4"
    assert trial.body.file == "body.toml"
    assert trial.labels == {"athlete": "anna", "condition": "dry", "number": 3}


def test_paths_beside_a_session_behind_a_link_stay_as_they_are(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "study" / "trials").mkdir(parents=True)
    path = write(tmp_path / "study", 'labels = { athlete = "anna" }')
    path.parent.rename(tmp_path / "elsewhere" / "trials")
    (tmp_path / "study" / "session.toml").rename(tmp_path / "elsewhere" / "session.toml")
    (tmp_path / "elsewhere" / "calib.toml").touch()
    (tmp_path / "elsewhere" / "body.toml").touch()
    path.parent.symlink_to(tmp_path / "elsewhere" / "trials")
    assert read_trial(path).path("calib.toml") == path.parent / ".." / "calib.toml"


def test_an_athletes_tables_stand_between_the_trials_and_the_sessions(tmp_path):
    trial = read_trial(write(tmp_path, 'name = "x"\nlabels = { athlete = "berta" }\ntrack = { stop = 9 }'))
    assert trial.body.stature_m == 1.72
    assert (trial.track.every, trial.track.stop) == (1, 9), "a table replaces the session's whole table"
    assert trial.camera[0].video == "videos/berta_x_left.mp4"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('labels = { condition = "dry" }', "needs the label athlete; this trial has: condition, trial; add it"),
        ('labels = { athlete = "anna" }\nathletes = 3', "athletes: unknown key"),
        ('labels = "anna"', "needs the label athlete"),
        ('labels = { athlete = "anna", trial = "3" }', "the label trial is 3, but .trial. .* name, throw_3"),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path, text, said):
    with pytest.raises(TrialError, match=said):
        read_trial(write(tmp_path, text))


@pytest.mark.parametrize("session", ["3", '"../none.toml"', '""', '"a\\u0000b"'])
def test_a_session_that_cannot_be_read_is_one_line(tmp_path, session):
    path = tmp_path / "trial.toml"
    path.write_text(f"session = {session}\n")
    with pytest.raises(TrialError, match=r"session: expected the path|cannot be read"):
        read_trial(path)


def test_what_is_missing_in_both_files_is_said_of_both(tmp_path):
    (tmp_path / "session.toml").write_text(SESSION.replace('file = "body.toml"', 'preset = "human18"'))
    with pytest.raises(TrialError, match=r"throw_3.toml with session.toml: body: .*stature_m"):
        read_trial(write(tmp_path, 'labels = { athlete = "anna" }'))


def test_athletes_that_are_no_tables_are_refused(tmp_path):
    (tmp_path / "session.toml").write_text(f"athletes = {{ anna = 3 }}\n{SESSION.partition('[athletes')[0]}")
    with pytest.raises(TrialError, match="athletes are no tables"):
        read_trial(write(tmp_path, 'labels = { athlete = "anna" }'))


def test_the_rest_of_a_trial_with_mistakes_keeps_its_session(tmp_path):
    rest = parse_remainder(write(tmp_path, 'labels = { athlete = "anna" }\nwrong = 1'))
    assert rest is not None
    assert rest.has_body
    assert rest.trial.path("calib.toml").is_file()


def test_a_short_label_cannot_make_a_short_session_a_huge_text(tmp_path):
    (tmp_path / "session.toml").write_text("x = '" + "{athlete}" * 100_000 + "'")
    (tmp_path / "one.toml").write_text(f"session = 'session.toml'\nlabels = {{ athlete = '{'a' * 100_000}' }}")
    with pytest.raises(TrialError, match="label athlete is too long; give it 80 characters at most"):
        read_tables(tmp_path / "one.toml")
