"""Two runs into one folder: one is refused, the other's bytes are as if alone; and what a run may write, and read."""

import hashlib
import json
import signal
import subprocess
import sys

import pytest
import trimesh

from airborne.errors import ResultError, VideoError
from airborne.io.folder_lock import LOCK, sole_writer
from airborne.motion.smoothing.settings import Smoothing
from airborne.run.identity import input_hashes
from airborne.run.smooth import smooth_run
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from airborne.video import VideoSource, open_recording
from tests.cli.test_cli import in_process
from tests.support.clips import numbered, plain_rig, write_clip
from tests.support.players_trial import stand_in, write_run, write_trial
from tests.support.run_files import contents_of

WITH_TIMES = ("summary.json", "report.html")


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write_trial(tmp_path_factory.mktemp("trial"), 12)


@pytest.fixture
def _stand_in(monkeypatch):
    stand_in(monkeypatch)


def files_of(folder):
    return {name: data for name, data in contents_of(folder).items() if name not in WITH_TIMES}


@pytest.mark.usefixtures("_stand_in")
def test_a_second_run_is_refused_while_the_first_goes_on_and_its_bytes_are_as_if_alone(path, tmp_path):
    track_trial(read_trial(path), tmp_path / "alone", pictures=False)
    refused = []

    def second(number, _):
        if number == 5:
            for options in ({}, {"resume": True}, {"overwrite": True}):
                with pytest.raises(ResultError, match="is being written by another run") as caught:
                    track_trial(read_trial(path), tmp_path / "run", pictures=False, **options)
                refused.append(str(caught.value))
            with pytest.raises(ResultError, match="is being written by another run"):
                smooth_run(tmp_path / "run", Smoothing(method="butterworth", cutoff_hz=6.0), events_s=[])

    track_trial(read_trial(path), tmp_path / "run", pictures=False, progress=second)
    assert len(refused) == 3 and not any("\n" in line for line in refused)
    assert files_of(tmp_path / "run") == files_of(tmp_path / "alone")


def test_a_run_that_is_killed_before_its_record_is_whole_can_be_started_again(path, tmp_path, monkeypatch):
    stand_in(monkeypatch)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json.part").write_text('{"inp')
    (tmp_path / "run" / LOCK).write_text("process 1 on here since 2026-01-01 00:00:00")
    track_trial(read_trial(path), tmp_path / "run", pictures=False, resume=True)
    assert not (tmp_path / "run" / LOCK).exists()
    assert not (tmp_path / "run" / "run.json.part").exists()


@pytest.mark.usefixtures("_stand_in")
def test_nothing_is_written_through_a_link_that_leads_out_of_the_folder(path, tmp_path):
    run = write_run(tmp_path / "run")
    (tmp_path / "mine.csv").write_text("mine")
    (run / "tables").mkdir()
    (run / "tables" / "smooth_joints.csv").symlink_to(tmp_path / "mine.csv")
    with pytest.raises(ResultError, match=r"smooth_joints.csv is a link that leads out of"):
        smooth_run(run, Smoothing(method="butterworth", cutoff_hz=6.0), events_s=[])
    assert (tmp_path / "mine.csv").read_text() == "mine"


def test_ctrl_c_before_the_first_frame_promises_nothing(path, tmp_path, monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("airborne.run.track.track_trial", interrupted)
    assert in_process("track", path, "-o", tmp_path / "run") == 130
    assert capsys.readouterr().err == "airborne: stopped; no frame was tracked yet\n"
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("mesh", ["videos/box.obj", "tables/box.obj", "motion.csv", "run.json/box.obj", "summary.json"])
def test_a_mesh_makes_no_folder_and_takes_no_name_of_a_run(thrown_cross, tmp_path, mesh):
    folder = tmp_path / "trial"
    (folder / mesh).parent.mkdir(parents=True)
    trimesh.creation.box((0.8, 0.1, 0.1)).export(folder / mesh, file_type="obj")
    (folder / "cross.toml").write_text(
        'name = "cross"\n[[segment]]\nname = "cross"\n[[segment.part]]\nname = "bar"\nshape = "mesh"\n'
        f'file = "{mesh}"\ncolour_srgb = [200, 10, 10]\n',
        encoding="utf-8",
    )
    for name in ("cam1.mp4", "cam2.mp4", "cam3.mp4", "calib_true.toml"):
        (folder / name).symlink_to(thrown_cross / name)
    text = (thrown_cross / "trial.toml").read_text(encoding="utf-8")
    text = text.replace('control_points = "control_points.csv"', 'file = "calib_true.toml"')
    (folder / "trial.toml").write_text(text.partition("[lights]")[0], encoding="utf-8")
    track_trial(read_trial(folder / "trial.toml", {"stop": 1}), tmp_path / "run", pictures=False)
    names = set(contents_of(tmp_path / "run"))
    assert {"motion.csv", "run.json", "summary.json", "body.toml", "bar_0.obj"} <= names
    assert not any(name.endswith("box.obj") for name in names)
    hashes = json.loads((tmp_path / "run" / "run.json").read_text())["inputs"]
    assert hashes[mesh] == hashlib.sha256((folder / mesh).read_bytes()).hexdigest()


def test_the_hashes_cover_every_byte_of_every_input(path, tmp_path):
    trial = read_trial(write_trial(tmp_path, 2))
    video = tmp_path / "left.mkv"
    video.write_bytes(video.read_bytes() + bytes(40 << 20))
    before = input_hashes(trial)["left.mkv"]
    with video.open("r+b") as file:
        file.seek(20 << 20)
        file.write(b"x")
    assert input_hashes(trial)["left.mkv"] not in (before, None)


def test_recordings_that_do_not_overlap_are_told_before_tracking(tmp_path):
    clips = [write_clip(tmp_path / f"{k}.mp4", numbered(20), codec="libx264", pix_fmt="yuv420p") for k in range(3)]
    rig = plain_rig("a", "b", "c")

    def sources(*offsets_s):
        return [VideoSource(name, clip, offset_s=s) for name, clip, s in zip("abc", clips, offsets_s, strict=True)]

    for offsets_s in ((0, 0, 1e6), (0, -1e6, 0), (0, 0.41, 0), (1e6, 0, 0)):
        with pytest.raises(VideoError, match="no two overlap; correct offset_s"):
            open_recording(sources(*offsets_s), rig)
    open_recording(sources(0, 0.3, 0.6), rig)


def test_a_gap_that_no_recording_has_is_refused_and_not_filled(tmp_path, monkeypatch):
    monkeypatch.setattr("airborne.video.recording._LONGEST_GAP", 50)
    stamps = [0, 1, 2, 500, 501]
    clip = write_clip(tmp_path / "a.mkv", numbered(5), stamps=stamps)
    with pytest.raises(VideoError, match="no camera has a picture in the 51 frames before"):
        list(open_recording([VideoSource("a", clip)], plain_rig("a")))


def test_a_process_that_resumes_a_living_run_is_refused(path, tmp_path):
    hold = "import sys, time; from airborne.io.folder_lock import sole_writer; from pathlib import Path\n"
    hold += "with sole_writer(Path(sys.argv[1])): print(1, flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", hold, str(tmp_path / "run")], stdout=subprocess.PIPE) as first:
        first.stdout.readline()
        words = [sys.executable, "-c", "from airborne.cli import main; main()", "track", str(path), "--resume"]
        second = subprocess.run([*words, "-o", str(tmp_path / "run")], capture_output=True, text=True, check=False)
        first.send_signal(signal.SIGKILL)
    assert second.returncode == 2
    assert f"is being written by another run (process {first.pid} on " in second.stderr
    assert len(second.stderr.splitlines()) == 1
    with sole_writer(tmp_path / "run"):  # the lock went with its process
        pass
