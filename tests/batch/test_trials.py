"""Which trials a batch runs: folders, patterns, tables; names that would clash; the files of `airborne new`."""

import tomllib
from fractions import Fraction

import numpy as np
import pytest

from airborne.batch.new import write_study
from airborne.batch.run import plan_tasks
from airborne.batch.trials import label_names, list_trials
from airborne.errors import AirborneError, TrialError
from airborne.trial.file import read_trial
from airborne.video import VideoWriter

TRIAL = 'name = "a"\ncamera = []\nlabels = { condition = "dry", day = 2, athlete = "anna" }\n'


def write(path, text=TRIAL):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def names(what):
    return [trial.name for trial in list_trials(str(what))]


def test_a_folders_trials_are_its_trial_files_at_any_depth(tmp_path):
    write(tmp_path / "b.toml")
    write(tmp_path / "a" / "trial.toml")
    write(tmp_path / "c.toml", 'session = "session.toml"')
    write(tmp_path / "session.toml", "camera = []")
    write(tmp_path / "calib.toml", "[cam1]\nname = 'x'")
    write(tmp_path / "broken.toml", "name =\n[[camera]]")
    write(tmp_path / "body.toml", "name =")
    write(tmp_path / "misspelt.toml", "name = 'x'\n[[cameras]]\nname = 'y'")
    write(tmp_path / "slip.toml", 'sesion = "session.toml"\nlabels = {athlete = "anna"}')
    write(tmp_path / "unnamed.toml", 'labels = {athlete = "anna"}\n[start]\nframe = 0')
    write(tmp_path / "shared.toml", 'labels = {day = "1"}\n[body]\npreset = "legs"')
    found = ["a", "b", "broken", "c", "misspelt", "slip", "unnamed"]
    assert names(tmp_path) == found, "a file that cannot be read or has a mistake is not passed over"
    assert set(names(tmp_path / "?.toml")) == {"b", "c"}


def test_a_tables_columns_are_labels_over_those_of_the_file(tmp_path):
    write(tmp_path / "t" / "x.toml")
    write(tmp_path / "trials.csv", "trial,condition,judge\nt/x,wet,7\nt/y.toml,dry,\n")
    first, second = list_trials(str(tmp_path))
    assert (first.name, first.labels) == ("x", {"condition": "wet", "day": "2", "athlete": "anna", "judge": "7"})
    assert second.path == tmp_path / "t" / "y.toml"
    assert label_names([first, second])[:2] == ["athlete", "condition"]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("name,condition\nx,wet\n", "one of them trial"),
        ("", r"trials\.csv is empty; a table of trials has"),
        ("Trial,condition\nx,wet\n", "columns Trial, condition; .* write trial instead of 'Trial'"),
        ("trial,condition\nx\n", "row 2: 1 cells, expected 2"),
        ("trial\nx\na/x\n", "two trials are called x"),
        ("trial\n", "no trial found there"),
        ("trial,status\nx,good\n", "a label is called status"),
        ("trial,\nx,good\n", "a name has 1 to 80 characters"),
        (f"trial,{'a' * 90}\nx,good\n", "a name has 1 to 80 characters"),
        ("trial\n.x\n", "nor begin with a dot"),
        ("trial\na\x1b[31m\n", "no control character"),
    ],
)
def test_a_table_that_does_not_fit_is_one_line(tmp_path, table, said):
    write(tmp_path / "trials.csv", table)
    with pytest.raises(AirborneError, match=said):
        list_trials(str(tmp_path / "trials.csv"))


def test_a_trial_may_not_have_the_name_of_the_batchs_own_folder(tmp_path):
    write(tmp_path / "logs.toml")
    with pytest.raises(AirborneError, match="called logs"):
        plan_tasks(list_trials(str(tmp_path)), tmp_path / "out", pictures=False)


def test_the_longest_go_first(tmp_path):
    for name, size in (("short", 10), ("long", 1000)):
        (tmp_path / f"{name}.mp4").write_bytes(bytes(size))
        camera = f'camera = [{{ name = "c", video = "{name}.mp4" }}]'
        rest = 'calibration = { file = "calib.toml" }\nbody = { preset = "human18", stature_m = 1.7, mass_kg = 60 }'
        write(tmp_path / f"{name}.toml", f'name = "{name}"\n{camera}\n{rest}\n')
    (tmp_path / "calib.toml").touch()
    write(tmp_path / "broken.toml", "name = ")
    tasks = plan_tasks(list_trials(str(tmp_path / "[bls]*.toml")), tmp_path / "out", pictures=False)
    assert [task.trial.name for task in tasks] == ["long", "short", "broken"]


UNREAD = "if its pictures hold two fields, add `fields`"  # of a video that cannot be opened, as empty ones


def notes_beside_unread(study):
    return tuple(note for note in study.notes if UNREAD not in note)


def test_new_writes_a_session_and_a_trial_for_each_set_of_videos(tmp_path):
    for name in ("anna/dry_1_left.mp4", "anna/dry_1_right.mp4", "anna/wet_1_left.mp4", "anna/notes.txt"):
        write(tmp_path / "videos" / name, "")
    study = write_study(tmp_path / "videos", "{athlete}/{condition}_{number}_{camera}.mp4", tmp_path / "study")
    assert [path.name for path in study.trials] == ["anna_dry_1.toml", "anna_wet_1.toml"]
    study_folder = tmp_path / "study"
    assert notes_beside_unread(study) == (
        "anna_wet_1.toml: no video of right; give it its own [[camera]] tables",
        *(
            f"{study_folder / f'{name}.toml'} is not there yet, but session.toml names it: put it there, "
            f"or give another as --{option}"
            for option, name in (("calibration", "calib"), ("body", "body"))
        ),
    )
    for name in ("calib.toml", "body.toml"):
        write(tmp_path / "study" / name, "")
    trial = read_trial(study.trials[0])
    assert [camera.name for camera in trial.camera] == ["left", "right"]
    assert all(trial.path(camera.video).is_file() for camera in trial.camera)
    assert [each.labels["condition"] for each in list_trials(str(tmp_path / "study"))] == ["dry", "wet"]


def test_new_takes_the_fields_of_interlaced_cameras_from_their_files(tmp_path):
    (tmp_path / "videos").mkdir()
    for camera, fields in (("left", "top-first"), ("right", "progressive")):
        path = tmp_path / "videos" / f"1_{camera}.mp4"
        with VideoWriter(path, size=(64, 48), rate=Fraction(25), fields=fields) as video:
            for _ in range(3):
                video.write(np.full((48, 64, 3), 90, np.uint8))
    study = write_study(tmp_path / "videos", "{number}_{camera}.mp4", tmp_path / "study")
    assert study.notes[0] == "left: session.toml gives its fields as top-first, as the file's flags say"
    for name in ("calib.toml", "body.toml"):
        write(tmp_path / "study" / name, "")
    assert [camera.fields for camera in read_trial(study.trials[0]).camera] == ["top-first", "progressive"]


def test_new_says_which_video_cannot_be_read(tmp_path):
    write(tmp_path / "videos" / "1_left.mp4", "this is no video")
    study = write_study(tmp_path / "videos", "{number}_{camera}.mp4", tmp_path / "study")
    assert "1_left.mp4" in study.notes[0] and UNREAD in study.notes[0]


def test_new_writes_one_trial_for_videos_of_players_named_by_their_cameras_alone(tmp_path):
    for name in ("left.mp4", "right.mp4", "points.csv"):
        write(tmp_path / name, "")
    study = write_study(tmp_path, "{camera}.mp4", tmp_path, calibration="points.csv", body="legs")
    assert notes_beside_unread(study) == () and [path.name for path in study.trials] == ["trial.toml"]
    trial = read_trial(study.trials[0])
    assert [camera.name for camera in trial.camera] == ["left", "right"]
    assert trial.calibration.control_points is not None and trial.has_players and trial.start.find


def test_new_asks_for_the_size_of_a_person(tmp_path):
    for name in ("left.mp4", "right.mp4", "points.csv"):
        write(tmp_path / name, "")
    study = write_study(tmp_path, "{camera}.mp4", tmp_path, calibration="points.csv", body="human18")
    assert notes_beside_unread(study) == ("session.toml: add stature_m and mass_kg under [body], or in each trial",)
    with pytest.raises(TrialError, match="needs stature_m and mass_kg"):
        read_trial(study.trials[0])
    text = study.session.read_text().replace('"human18"', '"human18"\nstature_m = 1.7\nmass_kg = 65.0')
    study.session.write_text(text)
    assert read_trial(study.trials[0]).body.preset == "human18"


def test_new_takes_trial_for_the_only_word_beside_the_camera(tmp_path):
    write(tmp_path / "jump1_left.mp4", "")
    for name in ("calib.toml", "body.toml"):
        write(tmp_path / name, "")
    study = write_study(tmp_path, "{trial}_{camera}.mp4", tmp_path)
    (listed,) = list_trials(str(tmp_path / "trials"))
    assert (listed.name, listed.labels) == ("jump1", {})
    trial = read_trial(study.trials[0])
    assert trial.path(trial.camera[0].video).is_file()


@pytest.mark.parametrize("pattern", ["{athlete}_{trial}_{camera}.mp4", "{folder}/{camera}.mp4"])
def test_new_refuses_labels_that_a_batch_would_refuse(tmp_path, pattern):
    with pytest.raises(AirborneError, match=r"\{(trial|folder)\} cannot be a label, .* such as \{number\}"):
        write_study(tmp_path, pattern, tmp_path / "study")
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize(
    ("names", "trials", "cameras", "said"),
    [
        (
            ("run_1_left", "run_1_right", "run_2_left", "run_2_right"),
            ["run_1", "run_2"],
            ["left", "right"],
            "is read as trial run_1, camera left; if it is tri",
        ),
        (
            ("run_cam_1", "run_cam_2"),
            ["run"],
            ["cam_1", "cam_2"],
            "is read as trial run, camera cam_1; if it is trial r",
        ),
    ],
)
def test_new_reads_names_with_more_underlines_than_words_as_those_of_few_cameras(
    tmp_path, names, trials, cameras, said
):
    for name in names:
        write(tmp_path / "videos" / f"{name}.mp4", "")
    study = write_study(tmp_path / "videos", "{trial}_{camera}.mp4", tmp_path / "study", body="legs")
    assert [path.stem for path in study.trials] == trials
    assert f"{names[0]}.mp4 {said}" in study.notes[0]
    assert [table["name"] for table in tomllib.loads(study.session.read_text())["camera"]] == cameras


def test_new_leaves_files_that_exist_alone(tmp_path):
    write(tmp_path / "videos" / "x_left.mp4", "")
    write(tmp_path / "study" / "session.toml", "# mine\n")
    study = write_study(tmp_path / "videos", "{number}_{camera}.mp4", tmp_path / "study")
    assert study.session.read_text() == "# mine\n"


def test_a_folder_that_is_not_there_is_said_to_be_none(tmp_path):
    with pytest.raises(AirborneError, match="vidsx is no folder; check the path"):
        write_study(tmp_path / "vidsx", "{number}_{camera}.mp4", tmp_path / "study")


@pytest.mark.parametrize("pattern", ["{camera}.mov", "{number}.mp4", "{a}_{a}_{camera}.mp4", "{day}/{camera}.mov"])
def test_a_pattern_that_fits_nothing_is_one_line(tmp_path, pattern):
    write(tmp_path / "x_left.mp4", "")
    with pytest.raises(
        AirborneError, match=r"expected \{camera\}|no file's path fits .*: it holds x_left\.mp4; write it"
    ):
        write_study(tmp_path, pattern, tmp_path / "study")


def test_a_huge_file_is_not_read_to_find_out_whether_it_is_a_trial(tmp_path):
    with (tmp_path / "huge.toml").open("wb") as file:
        file.truncate(20_000_000_000)  # a hole: it takes no room on the disk
    write(tmp_path / "a.toml")
    assert names(tmp_path) == ["a"]


def test_a_long_name_of_many_bytes_is_cut_so_that_its_files_can_be_written(tmp_path):
    write(tmp_path / ("選" * 79) / "trial.toml")
    (trial,) = list_trials(str(tmp_path))
    assert len(trial.name.encode()) <= 160
    (tmp_path / f"{trial.name}.json").touch()
