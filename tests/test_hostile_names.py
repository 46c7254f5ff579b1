"""Two hundred hostile names wherever a file says a path: nothing is asked for, hangs, or is written."""

import os
import signal
import sys

import pytest

from airborne.batch.run import describe_plan, plan_tasks
from airborne.batch.trials import list_trials
from airborne.calibration.sources.board_detection import first_image
from airborne.calibration.sources.files import read_sources
from airborne.cli import main
from airborne.errors import AirborneError
from airborne.run.check import check_trial
from airborne.run.opening import open_trial
from airborne.studio.project import steps
from airborne.studio.session import Session
from airborne.study.comparison import compare_trials
from airborne.study.trials import read_study
from airborne.trial.file import read_trial
from tests.support import players_trial as players
from tests.support.canary import canary, hostile_names, playlists

BODY = (
    'name = "b"\n[[segment]]\nname = "s"\n[[segment.part]]\nname = "p"\nshape = "mesh"\nfile = {}\n'
    "colour_srgb = [1, 1, 1]\n"
)
START = "position_m = [0.0, 0.0, 1.0]\nsomersault_tilt_twist_deg = [0, 0, 0]\n"
ONE = (
    'name = "one"\n[[camera]]\nname = "left"\nvideo = {video}\n[calibration]\n{calibration}\n[body]\n{body}\n'
    "[start]\n{start}\n"
)
WHOLE = {
    "video": '"left.mkv"',
    "calibration": 'file = "calib.toml"',
    "body": 'preset = "human18"\nstature_m = 1.8\nmass_kg = 70',
    "start": START,
}
FIELDS = {  # of one body: what is replaced, with the name in its place
    "video": ("video", "{}"),
    "calibration.file": ("calibration", "file = {}"),
    "calibration.control_points": ("calibration", "control_points = {}"),
    "body.file": ("body", "file = {}"),
    "body.measurements": ("body", "measurements = {}"),
    "start.joints_m": ("start", "joints_m = {}"),
    "start.points_px": ("start", "points_px = {}"),
    "start.detections": ("start", "detections = {}"),
}
SECONDS = 5  # in which every name is answered


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A stranger's folder with one good trial, pipes and playlists, inside a folder that must not change."""
    folder = tmp_path / "outside" / "trial"
    players.write_trial(folder, 2, names=("left",))
    os.mkfifo(folder / "pipe.fifo")
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def alarm():
    """An error after some seconds, to be set again for each name."""

    def too_slow(*_):
        raise TimeoutError("a name took too long")

    before = signal.signal(signal.SIGALRM, too_slow)
    yield lambda: signal.alarm(SECONDS)
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def as_toml(name):
    """A name as a basic string of TOML."""
    return '"' + "".join(c if c.isalnum() and c.isascii() else f"\\U{ord(c):08x}" for c in name) + '"'


def files_below(folder):
    """All files but what the studio remembers in the folder that it has open."""
    return sorted(str(path) for path in folder.rglob("*") if ".airborne" not in path.parts)


def answers(text, path):
    """Every way in which a trial is opened before it is tracked; the one line of each refusal."""
    path.write_text(text, encoding="utf-8")
    yield from check_trial(path).mistakes
    try:
        open_trial(read_trial(path))
    except AirborneError as error:
        yield str(error)


@pytest.mark.parametrize("field", [*FIELDS, "mesh", "torso"])
def test_no_hostile_name_in_a_trial_does_more_than_one_line(folder, field, alarm):
    with canary() as watch:
        names = hostile_names(watch.port)
        assert len(names) >= 200
        for name, text in playlists(watch.port).items():
            (folder / name).write_text(text)
            names.append(name)
        path = folder / "hostile.toml"
        path.touch()
        (folder / "body.toml").touch()
        before = files_below(folder.parents[1])
        for name in names:
            alarm()
            if field == "mesh":
                (folder / "body.toml").write_text(BODY.format(as_toml(name)), encoding="utf-8")
                text = ONE.format(**WHOLE | {"body": 'file = "body.toml"'})
            elif field == "torso":
                text = players.trial_text(("left",), track=f'method = "mixture"\ntorso = {as_toml(name)}')
            else:
                key, value = FIELDS[field]
                text = ONE.format(**WHOLE | {key: value.format(as_toml(name))})
            lines = list(answers(text, path))
            assert lines, name
            assert all("\n" not in line and "\x1b" not in line and len(line) < 1500 for line in lines), name
        assert files_below(folder.parents[1]) == before
    assert watch.n_requests == 0


def test_no_hostile_name_of_a_thing_writes_outside_the_run(folder, capsys, monkeypatch, alarm):
    """Of a camera, a player, the trial, in turn: one rule holds for all of them (tests/io/test_names.py)."""
    with canary() as watch:
        before = files_below(folder.parents[1])
        for number, name in enumerate(hostile_names(watch.port)):
            alarm()
            text = players.trial_text(("left",), track="stop = 1")
            old = ('name = "left"', 'name = "Anna"', 'name = "a block"')[number % 3]
            (folder / "trial.toml").write_text(text.replace(old, f"name = {as_toml(name)}", 1), encoding="utf-8")
            monkeypatch.setattr(sys, "argv", ["airborne", "check", str(folder / "trial.toml")])
            with pytest.raises(SystemExit) as left:
                main()
            assert left.value.code in (0, 2, None), (number, name)
            assert "Traceback" not in "".join(capsys.readouterr())
        assert files_below(folder.parents[1]) == before
    assert watch.n_requests == 0


def refuse_or_open(do):
    """Do something; the one line of its refusal."""
    try:
        do()
    except AirborneError as error:
        return [str(error)]
    return []


def in_a_session(folder, name):
    """The name where a session says the cameras' videos."""
    (folder / "session.toml").write_text(ONE.format(**WHOLE | {"video": as_toml(name)}), encoding="utf-8")
    (folder / "of_session.toml").write_text('session = "session.toml"\n')
    return [*check_trial(folder / "of_session.toml").mistakes, *look_in_the_studio(folder / "of_session.toml")]


def as_a_session(folder, name):
    """The name as that of a session."""
    (folder / "of_session.toml").write_text(f"session = {as_toml(name)}\n", encoding="utf-8")
    return [*check_trial(folder / "of_session.toml").mistakes, *look_in_the_studio(folder / "of_session.toml")]


def as_a_label(folder, name):
    """The name as a label of which a session makes the videos' names."""
    (folder / "session.toml").write_text(ONE.format(**WHOLE | {"video": '"{who}"'}), encoding="utf-8")
    (folder / "of_session.toml").write_text(
        f'session = "session.toml"\n[labels]\nwho = {as_toml(name)}\n', encoding="utf-8"
    )
    return check_trial(folder / "of_session.toml").mistakes


def in_a_table_of_trials(folder, name):
    """The name as a trial of a batch, which is planned and, where there is one, opened."""
    quoted = name.replace('"', '""')
    (folder / "trials.csv").write_text(f'trial,condition\n"{quoted}",x\n', encoding="utf-8")

    def plan():
        tasks = plan_tasks(list_trials(str(folder)), folder / "results", pictures=False)
        lines.extend(describe_plan(tasks)[0])

    lines = []
    return [*refuse_or_open(plan), *lines]


def in_the_studio(folder, name):
    """The name as a camera's video, and its calibration, in a trial that the studio opens."""
    wrong = WHOLE | {"video": as_toml(name), "calibration": f"file = {as_toml(name)}"}
    (folder / "studio.toml").write_text(ONE.format(**wrong), encoding="utf-8")
    return look_in_the_studio(folder / "studio.toml")


def look_in_the_studio(path):
    """Whatever the studio reads of a trial by itself."""
    session = Session(path.parent, path)
    steps(session.project())
    return [*refuse_or_open(session.shown), *refuse_or_open(session.rig), *refuse_or_open(session.project().model)]


def in_a_study(folder, name):
    """The name as the folder of a run in a batch's table."""
    quoted = name.replace('"', '""')
    row = f'a,anna,dry,done,,"{quoted}",1\nb,bea,wet,done,,"{quoted}",2\n'
    (folder / "trials.csv").write_text(f"trial,athlete,condition,status,error,folder,n\n{row}", encoding="utf-8")
    return refuse_or_open(lambda: compare_trials(read_study(folder), "somersault_deg", ("start", "end")))


def in_a_source(folder, name):
    """The name where a file of sources says a recording of a board."""
    (folder / "sources.toml").write_text(
        f'[[camera]]\nname = "left"\nvideo = {as_toml(name)}\n[board]\nfile = {as_toml(name)}\n', encoding="utf-8"
    )

    def read():
        sources = read_sources(folder / "sources.toml")
        first_image(sources, sources.camera[0])

    return refuse_or_open(read)


FURTHER = [in_a_session, as_a_session, as_a_label, in_a_table_of_trials, in_the_studio, in_a_study, in_a_source]


@pytest.mark.parametrize("field", FURTHER)
def test_no_hostile_name_in_another_file_does_more_than_one_line(folder, field, alarm):
    with canary() as watch:
        names = [*hostile_names(watch.port), *playlists(watch.port)]
        for name, text in playlists(watch.port).items():
            (folder / name).write_text(text)
        own = {"session.toml", "of_session.toml", "trials.csv", "studio.toml", "sources.toml"}
        for name in own:
            (folder / name).touch()
        before = files_below(folder.parents[1])
        n_refused = 0
        for name in names:
            alarm()
            lines = field(folder, name)
            n_refused += bool(lines)
            assert all("\n" not in line and "\x1b" not in line and len(line) < 1500 for line in lines), name
        assert n_refused > len(names) / 2
        assert files_below(folder.parents[1]) == before
    assert watch.n_requests == 0
