"""Of a folder's files only those are listed and read to which no link and no `..` leads out of it."""

import shutil
from collections.abc import Iterator
from typing import Any, get_args

import pytest
import tomlkit
from pydantic import BaseModel

from airborne.body.anthropometry import measurements_of
from airborne.cameras import Rig, camera_looking_at, write_pose2sim
from airborne.errors import TrialError
from airborne.io.names import check_path
from airborne.studio.calibrating import REPORT, board_text, list_boards, list_pictures, list_wands
from airborne.studio.calibrations import list_calibrations
from airborne.studio.clicks import list_surveys
from airborne.studio.digitising import list_repetitions
from airborne.studio.folder import files_inside, outer_files, path_inside
from airborne.studio.named_files import PATHS
from airborne.studio.project import (
    find_run,
    find_trial,
    list_bodies,
    list_measurements,
    list_outer_runs,
    list_runs,
    list_videos,
    read_project,
)
from airborne.studio.session import Session
from airborne.studio.starts import read_clicked_players, read_points
from airborne.trial.file import Trial
from tests.support.bodies import write_measurements
from tests.support.places import THROWN_CROSS

MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
HULL = """name = "hull"
[[segment]]
name = "hull"
[[segment.part]]
name = "a"
shape = "mesh"
file = "hull.obj"
colour = "sample"
"""
LISTS = {
    "calibration": lambda folder: list_calibrations(folder, {"cam1"}).usable,
    "surveys": lambda folder: list_surveys(folder).usable,
    "bodies": lambda folder: [name for name in list_bodies(folder) if name != "hull.toml"],
    "bodies with a mesh": lambda folder: [name for name in list_bodies(folder) if name == "hull.toml"],
    "measurements": list_measurements,
    "boards": list_boards,
    "wands": list_wands,
    "repetitions": list_repetitions,
    "videos": list_videos,
    "runs": list_runs,
    "a run by its name": lambda folder: [run for run in [find_run(folder, "results")] if run],
    "pictures of a calibration": list_pictures,
    "players": lambda folder: list(read_clicked_players(folder, 3)),
    "landmarks": lambda folder: list(read_points(Session(folder, folder / "trial.toml"), 3).names),
}


@pytest.fixture
def files(tmp_path):
    """A file of each kind that is listed, outside the folder that is opened."""
    files = tmp_path / "files"
    (files / "results" / "tables").mkdir(parents=True)
    (files / REPORT).mkdir()
    for name in ("cross.toml", "control_points.csv", "cam1.mp4"):
        shutil.copyfile(THROWN_CROSS / name, files / name)
    write_measurements(files / "anna.txt", measurements_of(1.7, 60.0))
    (files / "hull.toml").write_text(HULL)
    (files / "hull.obj").write_text(MESH)
    (files / "board.toml").write_text(board_text(7, 5, 40, marker_mm=30, dictionary="DICT_4X4_50"))
    (files / "wand.csv").write_text("frame,marker,camera,u_px,v_px\n0,1,cam1,1.0,2.0\n0,2,cam1,1.0,2.0\n")
    (files / "digitised_A_1.csv").write_text("frame,point,cam1_u,cam1_v\n0,a,1,2\n")
    (files / "start_points_3.csv").write_text("point,cam1_u,cam1_v\nhip,1,2\n")
    (files / "start_anna_3.csv").write_text("point,cam1_u,cam1_v\nhip,1,2\n")
    (files / "results" / "motion.csv").write_text("frame\n0\n")
    (files / "results" / "tables" / "angles.csv").write_text("nothing\n")
    (files / REPORT / "residuals_cam1.png").write_bytes(b"")
    camera = camera_looking_at("cam1", [3.0, 0, 1], [0, 0, 1], focal_px=600, size=(640, 480))
    write_pose2sim(files / "calib.toml", Rig((camera,)))
    return files


@pytest.fixture
def opened(tmp_path):
    folder = tmp_path / "opened"
    folder.mkdir()
    return folder


def test_each_list_holds_the_files_of_the_folder(files):
    assert {name: len(found(files)) for name, found in LISTS.items()} == dict.fromkeys(LISTS, 1)


@pytest.mark.parametrize("name", LISTS)
def test_no_list_holds_what_a_link_leads_out_to(name, files, opened):
    for path in files.rglob("*"):
        inner = opened / path.relative_to(files)
        if path.is_dir():
            inner.mkdir()
        else:
            inner.symlink_to(path)
    refused = (TrialError,) if name == "landmarks" else ()
    try:
        assert list(LISTS[name](opened)) == []
    except refused as error:
        assert "lies outside" in str(error)


def test_a_body_is_not_listed_where_its_mesh_is_a_link_out(files, opened):
    shutil.copyfile(files / "hull.toml", opened / "hull.toml")
    (opened / "hull.obj").symlink_to(files / "hull.obj")
    assert list_bodies(opened) == {}


@pytest.mark.parametrize("inner", ["motion.csv", "body.toml", "tables/angles.csv", "tables", "videos"])
def test_a_run_that_holds_a_link_out_is_named_and_not_read(inner, files, opened):
    run = shutil.copytree(files / "results", opened / "results")
    if (run / inner).is_dir():
        shutil.rmtree(run / inner)
    (run / inner).unlink(missing_ok=True)
    (run / inner).symlink_to(files / "results" / inner)
    if inner == "motion.csv":
        (files / "results" / "motion.csv").write_text("theirs\n")
    (files / "results" / inner).touch()
    assert list_runs(opened) == [] and find_run(opened, "results") is None
    assert list_outer_runs(opened) == [f"results/{inner}"]


def test_links_within_the_folder_are_followed(files):
    (files / "again.mp4").symlink_to("cam1.mp4")
    assert [path.name for path in list_videos(files)] == ["again.mp4", "cam1.mp4"]
    assert outer_files(files, ".mp4") == []
    assert path_inside(files, "again.mp4") == files / "again.mp4"


def test_links_out_are_named(files, opened):
    (opened / "link.MP4").symlink_to(files / "cam1.mp4")
    assert outer_files(opened, ".mp4") == ["link.MP4"] and files_inside(opened, ".mp4") == []


@pytest.mark.parametrize("name", ["../files/cam1.mp4", "/etc/passwd", "link.mp4", "a\0b", "round", "sub/../../files"])
def test_a_name_that_leads_out_is_refused_in_one_line_that_says_what_to_do(name, files, opened):
    (opened / "link.mp4").symlink_to(files / "cam1.mp4")
    (opened / "round").symlink_to("../files/round")
    with pytest.raises(TrialError, match=r"lies outside .*put the file itself into the folder"):
        path_inside(opened, name)


def path_keys(model: Any, head: str = "") -> Iterator[tuple[str, str]]:
    """Yield the keys of a trial's tables that are paths, as the tables' types say."""
    for name, field in model.model_fields.items():
        inner = [field.annotation, *field.metadata]
        while inner:
            each = inner.pop()
            if getattr(each, "func", None) is check_path:
                yield head, name
            elif isinstance(each, type) and issubclass(each, BaseModel):
                yield from path_keys(each, f"{head}.{name}".lstrip("."))
            else:
                inner += [*get_args(each), *getattr(each, "__metadata__", ())]


def test_every_key_of_a_trial_that_is_a_path_is_known():
    assert set(path_keys(Trial)) == {(head, key) for head, keys in PATHS.items() for key in keys}


def with_name(head: str, key: str, name: str) -> str:
    """Return a trial in which one key names a file."""
    table: Any = {key: name}
    for part in reversed(head.split(".")):
        table = {part: [table] if part in ("camera", "player", "key") else table}
    return tomlkit.dumps(table)


CASES = [(head, key) for head, keys in PATHS.items() for key in keys]


@pytest.mark.parametrize("name", ["../files/cross.toml", "link", "sub/link"])
@pytest.mark.parametrize(("head", "key"), CASES)
def test_a_trial_that_names_a_file_outside_is_refused(head, key, name, files, opened):
    (opened / "link").symlink_to(files / "cross.toml")
    (opened / "sub").symlink_to(files)
    path = opened / "trial.toml"
    path.write_text(with_name(head, key, name))
    project = read_project(opened, path)
    assert project.mistake is not None
    assert project.mistake.startswith(f"trial.toml: {head}.{key}: {name} lies outside")
    assert not project.cameras and not project.tables
    with pytest.raises(TrialError, match="lies outside"):
        project.trial()


def test_a_folder_of_detections_outside_is_refused(files, opened):
    for value, is_refused in (("left", False), ("../../files", True)):
        start = {"detections": "poses", "detections_cameras": {"cam1": value}}
        (opened / "trial.toml").write_text(tomlkit.dumps({"start": start}))
        mistake = read_project(opened, opened / "trial.toml").mistake
        assert (mistake is not None and "start.detections_cameras: poses/../../files lies" in mistake) == is_refused


def test_a_trial_or_a_session_that_is_a_link_out_is_refused(files, opened):
    (files / "session.toml").write_text('name = "secret"\n')
    for name, text in (("session.toml", None), ("trial.toml", 'session = "session.toml"\n')):
        (opened / name).unlink(missing_ok=True)
        if text is None:
            (opened / name).symlink_to(files / name)
        else:
            (opened / name).write_text(text)
    assert "session: session.toml lies outside" in (read_project(opened, opened / "trial.toml").mistake or "")
    (opened / "trial.toml").unlink()
    (opened / "trial.toml").symlink_to(files / "session.toml")
    assert "trial.toml lies outside" in (read_project(opened, opened / "trial.toml").mistake or "")
    with pytest.raises(TrialError, match="lies outside"):
        find_trial(opened / "trial.toml")


def test_the_mesh_of_a_trials_body_must_lie_in_the_folder_too(files, opened):
    shutil.copyfile(files / "hull.toml", opened / "hull.toml")
    (opened / "hull.obj").symlink_to(files / "hull.obj")
    (opened / "trial.toml").write_text('[body]\nfile = "hull.toml"\n')
    assert "hull.toml: part.file: hull.obj lies outside" in (read_project(opened, opened / "trial.toml").mistake or "")


def test_what_is_put_into_the_folder_is_read_at_once(files, opened):
    path = opened / "trial.toml"
    path.write_text('[body]\nfile = "link"\n')
    (opened / "link").symlink_to(files / "cross.toml")
    session = Session(opened, path)
    assert session.project().mistake
    (opened / "link").unlink()
    shutil.copyfile(files / "cross.toml", opened / "link")
    assert session.project().mistake is None
