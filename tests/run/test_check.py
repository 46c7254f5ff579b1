"""`airborne check`: all mistakes of a trial at once, and nothing tracked; and the first frame alone."""

import json
import re
import shutil
from dataclasses import replace

import av
import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras import Rig, read_rig, write_rig
from airborne.cli import main
from airborne.errors import MistakesError, ResultError
from airborne.run import check
from airborne.run.check import check_trial
from airborne.run.moving_mix_ups import MovingSilhouettes
from airborne.run.track import track_trial
from airborne.tracking.first_pose.body_size import WrongSize
from airborne.trial.file import read_trial
from airborne.video import inspect
from tests.support.clips import write_clip
from tests.support.commands import in_process
from tests.support.example_trial import copy_cross
from tests.support.players_trial import write_trial
from tests.support.run_files import files_of


@pytest.fixture
def folder(tmp_path):
    """A copy of the example without its control points to fit."""
    return copy_cross(tmp_path / "trial")


def edit(folder, *changes):
    path = folder / "trial.toml"
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    return path


def test_a_good_trial_has_a_line_for_each_thing(folder):
    checks = check_trial(folder / "trial.toml")
    assert checks.mistakes == []
    heads = ["trial.toml", "cam1", "cam2", "cam3", "videos", "calibration", "body", "frames", "start", "videos"]
    assert [line.split(": ")[0] for line in checks.well] == heads
    assert checks.well[-1] == "videos: no sign at the start that cameras' videos were exchanged"


def test_a_start_that_shows_nothing_of_exchanged_videos_says_so(folder):
    position = re.search(r"position_m = .*", (folder / "trial.toml").read_text(encoding="utf-8")).group()
    aside = "position_m = [0.6, 0.0, 0.5]"  # seen by all cameras; the cross is elsewhere
    checks = check_trial(edit(folder, (position, aside)))
    assert checks.mistakes == []
    assert checks.well[-1].startswith("videos: what moves does not show whether any were exchanged")


def test_a_video_that_was_not_copied_whole_says_so(folder):
    path = folder / "cam2.mp4"
    packets = folder / "whole.mp4"
    path.rename(packets)
    with av.open(str(packets)) as read, av.open(str(path), "w", options={"movflags": "faststart"}) as written:
        stream = written.add_stream_from_template(read.streams.video[0])
        for packet in read.demux(video=0):
            if packet.size:
                packet.stream = stream
                written.mux(packet)
    assert not check_trial(folder / "trial.toml").doubts
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    checks = check_trial(folder / "trial.toml")
    assert not checks.mistakes  # it is tracked up to there
    (line,) = (doubt for doubt in checks.doubts if "cut off" in doubt)
    assert re.fullmatch(r"camera 'cam2': cam2.mp4 is cut off before its last \d images; copy it again, .*", line)


def test_every_mistake_of_the_tables_is_listed(folder, capsys, monkeypatch):
    path = edit(folder, ('"top-first"', '"odd"'), ("[track]", "[track]\nevery = 0"))
    assert [line.split(": ")[1] for line in check_trial(path).mistakes] == ["camera 'cam1'", "track.every"]
    monkeypatch.setattr("sys.argv", ["airborne", "check", str(path)])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 2
    assert len(capsys.readouterr().err.splitlines()) == 3  # and that the rest follows


def test_every_unusable_file_is_listed(folder):
    (folder / "cam1.mp4").write_text("no video")
    (folder / "cross.toml").write_text("no body")
    path = edit(folder, ("cam2.mp4", "cam9.mp4"), ("calib_true.toml", "none.toml"))
    mistakes = check_trial(path).mistakes
    assert len(mistakes) == 4
    for said in ("none.toml not found in ", "cam1.mp4 cannot be opened", "cam9.mp4 not found", "cross.toml"):
        assert sum(said in line for line in mistakes) == 1, said


def test_cameras_with_the_same_video_are_named_whatever_the_file_is_called(folder):
    shutil.copyfile(folder / "cam1.mp4", folder / "cam3.mp4")
    said = "the videos: cameras cam1 and cam3 have the same video (cam1.mp4 and cam3.mp4); give each camera its own"
    assert said.removeprefix("the videos: ") in check_trial(folder / "trial.toml").mistakes[0]
    with pytest.raises(MistakesError, match="cam1 and cam3 have the same video"):
        track_trial(read_trial(folder / "trial.toml"), folder / "out")
    assert not (folder / "out").exists()


def test_exchanged_videos_and_a_mirrored_one_are_named_before_anything_is_tracked(folder):
    (folder / "cam2.mp4").rename(folder / "other.mp4")
    (folder / "cam3.mp4").rename(folder / "cam2.mp4")
    (folder / "other.mp4").rename(folder / "cam3.mp4")
    (mistake,) = check_trial(folder / "trial.toml").mistakes
    assert "the videos of cam2 and cam3, or their calibrations, are exchanged" in mistake
    with pytest.raises(MistakesError, match="the videos of cam2 and cam3, or their calibrations, are exchanged"):
        track_trial(read_trial(folder / "trial.toml"), folder / "out")
    assert not (folder / "out").exists()


def test_a_video_whose_silhouettes_are_another_bodys_is_a_doubt_where_a_start_is_given_too(folder, monkeypatch):
    seen = MovingSilhouettes(0.5, ("those without cam2 can",), "the images of cam3 are mirrored")
    monkeypatch.setattr(check, "look_at_silhouettes", lambda trial, recording: seen)
    assert check_trial(folder / "trial.toml").doubts == [seen.mix_up, *seen.doubts]


def test_a_start_past_the_end_is_a_mistake(folder):
    path = edit(folder, ("frame = 0", "frame = 900"))
    said = "there is no frame 900, the last is 33; start.frame lies past the end"
    assert said in " ".join(check_trial(path).mistakes)


def test_what_is_left_of_tables_with_mistakes_is_read_too(folder, capsys):
    changes = ('[track]\nmethod = "refined"', '[track]\nmethod = "refind"'), ("cam2.mp4", "cam9.mp4")
    path = edit(folder, *changes, ("cross.toml", "corss.toml"))
    mistakes = check_trial(path).mistakes
    assert len(mistakes) == 3
    for said in ("track.method: expected", "cam9.mp4 not found", "corss.toml not found"):
        assert sum(said in line for line in mistakes) == 1, said


@pytest.mark.parametrize("body", ['preset = "human18"\nstature_m = 18.0\nmass_kg = 70.0', ""])
def test_where_the_body_is_a_mistake_the_rest_is_read(folder, body):
    path = edit(folder, ('[body]\nfile = "cross.toml"', f"[body]\n{body}"), ("calib_true.toml", "calib.toml"))
    checks = check_trial(path)
    assert checks.mistakes[0].startswith(("trial.toml: body", "trial.toml: [body]"))
    assert len(checks.mistakes) == 2 and "calib.toml not found" in checks.mistakes[1]
    assert not [line for line in checks.well if line.startswith("body")]


def test_cameras_with_mistakes_are_left_out_and_the_others_read(folder):
    path = edit(folder, ("frame = 0", "fram = 0"), ('video = "cam2.mp4"\n', ""), ("cam3.mp4", "cam9.mp4"))
    checks = check_trial(path)
    wrong = ["camera 'cam2': video is missing", "start.fram: unknown key; did you mean frame?"]
    assert checks.mistakes[:2] == [f"trial.toml: {each}" for each in wrong]
    assert len(checks.mistakes) == 3 and "cam9.mp4 not found" in checks.mistakes[2]
    assert checks.well[0].startswith("cam1: 768×576 px, 50 images/s")


def test_nothing_is_left_of_a_file_whose_tables_contradict_each_other(folder):
    path = edit(folder, ('file = "calib_true.toml"', 'file = "calib_true.toml"\nmend = ["cam8"]'))
    assert len(check_trial(path).mistakes) == 1


def test_a_start_in_millimetres_is_a_mistake(folder):
    path = edit(folder, ("position_m = [-0.42419, -0.01495, 1.26533]", "position_m = [-424.19, -14.95, 1265.33]"))
    (mistake,) = check_trial(path).mistakes
    assert mistake.startswith("trial.toml: start: position_m = [")
    assert mistake.endswith("] lies over 100 m away; give metres")


def test_masks_that_leave_no_camera_at_the_start_are_a_mistake(folder):
    masks = "".join(f'\n[[mask]]\ncamera = "cam{n}"\nfirst = 0\nlast = 5\n' for n in (1, 2, 3))
    path = folder / "trial.toml"
    path.write_text(path.read_text(encoding="utf-8") + masks, encoding="utf-8")
    (mistake,) = check_trial(path).mistakes
    assert "[[mask]] leaves every camera out at start.frame = 0" in mistake


def test_a_mask_after_the_end_is_noted(folder):
    path = folder / "trial.toml"
    mask = '\n[[mask]]\ncamera = "cam1"\nfirst = 500\nlast = 600\n'
    path.write_text(path.read_text(encoding="utf-8") + mask, encoding="utf-8")
    assert "note: [[mask]] of cam1 begins at frame 500, after the recording's end" in check_trial(path).well


def test_a_stop_past_the_end_is_noted(folder):
    path = edit(folder, ('method = "refined"', 'method = "refined"\nstop = 34'))
    assert not any("lies past the end" in line for line in check_trial(path).well)
    path = edit(folder, ("stop = 34", "stop = 3000"))
    assert "note: track.stop = 3000 lies past the end: the last frame is 33" in check_trial(path).well


def test_a_number_as_text_a_part_of_a_frame_and_a_switch_as_a_number_are_refused(folder):
    path = edit(
        folder,
        ('method = "refined"', 'method = "refined"\nstop = "12"\nevery = 1.0\nwhole_run = 1'),
        ("position_m = [-0.42419, -0.01495", 'position_m = [-0.42419, "-0.01495"'),
    )
    asked = {
        "track.stop": "a whole number (found '12')",
        "track.every": "a whole number (found 1.0)",
        "track.whole_run": "true or false (found 1)",
        "start.position_m, value 2": "a number (found '-0.01495')",
    }
    mistakes = check_trial(path).mistakes
    assert sorted(mistakes) == sorted(f"trial.toml: {key}: expected {text}" for key, text in asked.items())


@pytest.mark.parametrize("saved", ["saved_scale = 2.0", "saved_scale = 0.01", "saved_offset_px = [0.0, 300.0]"])
def test_a_video_that_is_said_to_lie_beside_its_calibration_is_refused(folder, saved):
    path = edit(folder, ('name = "cam1"', f'name = "cam1"\n{saved}'))
    (mistake,) = check_trial(path).mistakes
    assert mistake.startswith("camera 'cam1': saved_scale = ") and "takes its 768×576 px to columns" in mistake
    assert mistake.endswith("of the calibration's 768×576 px; correct saved_scale or saved_offset_px")


@pytest.mark.parametrize(
    ("shape", "rotation_deg", "said"),
    [
        ((576, 768, 3), 90, "px, by the flag in the file that turns it by"),
        ((768, 576, 3), 0, "px, but control_points.csv was clicked in pictures of 768×576"),
    ],
)
def test_a_video_turned_since_its_points_were_clicked_says_what_to_do(folder, shape, rotation_deg, said):
    write_clip(
        folder / "cam2.mp4",
        [np.zeros(shape, np.uint8)] * 2,
        codec="libx264",
        pix_fmt="yuv420p",
        rotation_deg=rotation_deg,
    )
    clicks = ('file = "calib_true.toml"', 'control_points = "control_points.csv"')
    path = edit(folder, *[('fields = "top-first"', "")] * 3, clicks)
    mistakes = [each for each in check_trial(path).mistakes if "cam2" in each]
    assert len(mistakes) == 1
    assert mistakes[0].startswith("camera 'cam2': its video is 576×768 px")
    assert said in mistakes[0]
    assert "take the flag out" in mistakes[0] if rotation_deg else "write the video anew, upright" in mistakes[0]


def test_a_camera_that_is_turned_away_from_the_start_is_noted(folder):
    rig = read_rig(folder / "calib_true.toml")
    cam1, cam2, cam3 = rig
    turn = RigidTransform.from_rotation(Rotation.from_rotvec([0, 1.0, 0]))
    write_rig(
        folder / "calib_true.toml", Rig((cam1, replace(cam2, camera_from_world=turn * cam2.camera_from_world), cam3))
    )
    note = "note: the start pose lies outside the image of cam2; where it should show, check the calibration"
    checks = check_trial(folder / "trial.toml")
    assert note in checks.well and not checks.mistakes


def test_doubts_of_the_start_take_the_place_of_no_mistakes(folder, capsys, monkeypatch):
    crossed, found = "start: left and right look exchanged", check.find_first_pose
    said = {"notes": ("start: first pose found", crossed), "doubts": (crossed,), "wrong_size": WrongSize(0.12, 0.03)}
    monkeypatch.setattr(check, "find_first_pose", lambda *args: replace(found(*args), **said))
    assert in_process("check", folder / "trial.toml") == 0
    out, err = capsys.readouterr()
    assert out.splitlines()[-1].startswith("2 doubts: ") and "exchanged" not in out.replace("were exchanged", "")
    assert f"airborne: doubt: {crossed}" in err and "a body 12 ± 3 % larger" in " ".join(err.split())
    assert in_process("check", folder / "trial.toml", "--json") == 0
    checked = json.loads(capsys.readouterr().out)
    assert not checked["mistakes"] and checked["doubts"] == [crossed, WrongSize(0.12, 0.03).sentence]


def test_lines_are_reported_as_they_are_found(folder):
    reported = []
    assert reported == [] and check_trial(folder / "trial.toml", reported.append).well == reported


def test_players_are_checked_against_the_cameras(tmp_path):
    path = write_trial(tmp_path / "trial", 3)
    *_, start, videos = check_trial(path).well
    assert start.startswith("start: frame 0, Anna") and videos.startswith("videos: no sign at the start that")


def exchange_sides(path, *parts):
    text = path.read_text(encoding="utf-8")
    text = re.sub(r"(knee_.* = \[[-\d.]+), 0.0", r"\1, 0.1", text)
    for part in parts:
        text = text.replace(f"{part}_left", "@").replace(f"{part}_right", f"{part}_left").replace("@", f"{part}_right")
    path.write_text(text, encoding="utf-8")


@pytest.mark.parametrize("parts", [["hip"], ["hip", "knee", "ankle", "foot"], ["hip", "knee"]])
def test_a_player_whose_knees_would_bend_backward_is_refused(tmp_path, parts):
    path = write_trial(tmp_path / "trial", 3)
    exchange_sides(path, *parts)
    mistakes = check_trial(path).mistakes
    assert mistakes and all("were left and right exchanged, at the hips or everywhere?" in each for each in mistakes)


@pytest.mark.parametrize(("part", "others"), [("knees", "hips and ankles"), ("ankles", "hips and knees")])
def test_a_player_whose_legs_cross_is_noted(tmp_path, part, others):
    path = write_trial(tmp_path / "trial", 3)
    exchange_sides(path, part[:-1])
    notes = [line for line in check_trial(path).well if "the other way" in line]
    assert notes and all(f"the {part} point the other way than {others}" in note for note in notes)


def test_the_first_frame_is_drawn_and_then_replaced_by_the_whole_run(folder, tmp_path):
    trial, out = read_trial(folder / "trial.toml", {"stop": 2}), tmp_path / "run"
    run = track_trial(trial, out, first_frame=True)
    assert run.summary["n_frames"] == 1
    drawn = {f"figures/overlay_cam{i}.png" for i in (1, 2, 3)}
    assert drawn <= set(files_of(out))
    assert not (out / "report.html").exists() and not (out / "videos").exists()
    (out / "notes.txt").write_text("mine")
    assert track_trial(trial, out, pictures=False).summary["n_frames"] == 2
    with pytest.raises(ResultError, match="overwrite it"):
        track_trial(trial, out, pictures=False)
    assert not drawn & set(files_of(out))
    assert (out / "notes.txt").read_text() == "mine"


def test_only_a_folder_that_holds_a_run_is_overwritten(folder, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "motion.csv").write_text("mine")
    with pytest.raises(ResultError):
        track_trial(read_trial(folder / "trial.toml"), tmp_path / "mine", overwrite=True)
    assert (tmp_path / "mine" / "motion.csv").read_text() == "mine"


def test_a_video_shorter_than_the_first_is_noted_unless_the_cameras_are_synchronised(folder, monkeypatch):
    def shorter(source):
        facts = inspect(source)
        return replace(facts, duration_s=facts.duration_s / 2) if source.path.name == "cam2.mp4" else facts

    monkeypatch.setattr("airborne.run.check.inspect", shorter)
    noted = [line for line in check_trial(folder / "trial.toml").well if "`airborne sync` finds" in line]
    assert len(noted) == 1
    assert noted[0].startswith("note: the video of cam2 is 0.34 s shorter than that of cam1")
    path = edit(folder, ('video = "cam2.mp4"', 'video = "cam2.mp4"\noffset_s = 0.001'))
    assert not any("`airborne sync` finds" in line for line in check_trial(path).well)


def test_what_casts_doubt_on_the_calibration_is_noted_before_tracking(folder):
    table = folder / "control_points.csv"
    head, *rows = table.read_text(encoding="utf-8").splitlines()
    stretched = []
    for row in rows:
        name, x, y, z, *px = row.split(",")
        stretched.append(",".join([name, x, y, f"{1.15 * float(z):.4f}", *px]))
    table.write_text("\n".join([head, *stretched]) + "\n", encoding="utf-8")
    path = edit(folder, ('file = "calib_true.toml"', 'control_points = "control_points.csv"'))
    assert any(line.startswith("note: camera 'cam") for line in check_trial(path).well)
