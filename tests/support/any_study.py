"""Files that the studio, batches and the clocks of cameras read: for each reader its name, the file, and how it reads.

`any_input.py` feeds them mutated.
"""

import shutil
import wave
from functools import partial

import cv2
import numpy as np

from airborne.batch.row import row_of
from airborne.batch.task import Task, inspect_folder
from airborne.batch.trials import list_trials
from airborne.calibration.sources.board_detection import _moments_by_time_stamps, first_image
from airborne.calibration.sources.files import read_sources
from airborne.cameras import write_rig
from airborne.motion import MotionWriter
from airborne.run.result import Run
from airborne.studio.clicks import count_clicked, list_surveys, read_clicked
from airborne.studio.curve_data import run_curves
from airborne.studio.outlines import run_overlay
from airborne.studio.place import read_place
from airborne.studio.project import list_bodies, list_runs, read_project, steps
from airborne.studio.runs import run_body, run_rows
from airborne.studio.session import Session
from airborne.studio.stage import part_stl
from airborne.studio.trial_edits import with_cameras
from airborne.studio.writing import FOLDER
from airborne.sync.audio import read_sound
from airborne.trial.file import read_trial
from airborne.video.decoding import VideoSource
from airborne.video.image_index import index_images
from airborne.video.seeking import ImageReader
from tests.support import players_trial as players
from tests.support.motions import run_with_gap
from tests.support.places import THROWN_CROSS

SUMMARY = (
    '{"n_frames": 8, "n_tracked": 6, "n_uncertain": 0, "n_lost": 2, "duration_s": 0.1, "rate_hz": 50,'
    '"median_position_sd_mm": 1.5, "median_rotation_sd_deg": null, "somersault_rev": 1.0, "tilt_range_deg": [-3, 4.5],'
    '"flight": {"angular_momentum_kg_m2_s": [1, 2, 3.5], "fitted_gravity_m_s2": 9.8, "ballistic_rms_mm": 2},'
    '"jumps": [{"player": "Anna", "hip_height_m": 0.4, "hip_height_m_low": 0.3, "hip_height_m_high": 0.5}],'
    '"self_check": [{"sentence": "the body is 5 % larger", "is_alarm": true}], "warnings": ["few views"],'
    '"name": "throw", "versions": {"airborne": "1"}}\n'
)
FLIGHT = "frame,time_s,com_z_m,com_z_m_sd\n" + "".join(
    f"{k},{k / 50},{1 + 0.1 * k - 0.006 * k * k},0.001\n" for k in range(17)
)


def studio(folder):
    """The studio's own reading of what lies in a folder, and its edits."""
    cross = shutil.copytree(THROWN_CROSS, folder / "cross")
    trial = cross / "trial.toml"

    def look():
        project = read_project(cross, trial)
        return [*map(project.source, project.cameras), steps(project), project.table("start")]

    yield "studio's trial", trial, look

    def edit():
        session, text = Session(cross, trial), trial.read_bytes()
        try:
            session.edit_trial(lambda known: with_cameras(known, "x", [{"name": "a", "video": "cam1.mp4"}]), "cameras")
            session.set_table("start", {"frame": 1, "find": None}, "start")
            session.editor.undo()
        finally:
            trial.write_bytes(text)

    yield "studio's edit of a trial", trial, edit
    points = cross / "control_points.csv"

    def click():
        known = read_clicked(points)
        clicked = known.click(known.names[0], "cam1", (1.0, 2.0))
        return clicked.text(("cam1", "cam2")), count_clicked(clicked, "cam1"), list_surveys(cross).usable

    yield "studio's clicks", points, click
    yield "studio's list of bodies", cross / "cross.toml", partial(list_bodies, cross)
    place = cross / FOLDER / "place.json"
    place.parent.mkdir()
    place.write_text('{"page": "/review", "frame": 7}\n')
    yield "studio's place", place, partial(read_place, cross)
    run = cross / "results"
    run.mkdir()
    with MotionWriter(run / "motion.csv", ()) as writer:
        for estimate in run_with_gap():
            writer.append(estimate)
    shutil.copy(cross / "calib_true.toml", run / "calib.toml")
    shutil.copy(cross / "cross.toml", run / "body.toml")
    (run / "summary.json").write_text(SUMMARY)

    def review():
        overlay = run_overlay(run, 1, ("cam1", "cam2"))
        return overlay, run_curves(run), run_rows(run), part_stl(run_body(run), 0), list_runs(cross)

    for name in ("motion.csv", "calib.toml", "body.toml"):
        yield f"studio's review, {name}", run / name, review

    def newest():
        return run_rows(run)

    yield "studio's look at a run", run / "motion.csv", newest
    whole = Run(run)
    yield "summary of a run", run / "summary.json", lambda: (whole.summary, repr(whole))
    of_players = players.write_run(folder / "players")
    players_calib = of_players / "calib.toml"
    write_rig(players_calib, players.rig())

    def review_players():
        return run_overlay(of_players, 1, ("left", "right")), run_curves(of_players)

    yield "studio's review of players", of_players / "joints.csv", review_players


def batches(folder):
    """What a batch reads of its trials and of its own records."""
    run = folder / "out" / "throw"
    (run / "tables").mkdir(parents=True)
    (run / "summary.json").write_text(SUMMARY)
    (run / "tables" / "flight.csv").write_text(FLIGHT)
    yield "row of a batch, summary", run / "summary.json", partial(row_of, run)
    yield "row of a batch, flight", run / "tables" / "flight.csv", partial(row_of, run)
    shutil.copytree(THROWN_CROSS, folder / "trials" / "throw")
    (listed,) = list_trials(str(folder / "trials"))
    task = Task(listed, folder / "out", pictures=False)
    task.record.parent.mkdir()
    task.record.write_text('{"identity": {"inputs": {"a": "b"}, "settings": {}, "version": "1"}}')
    yield "record of a batch", task.record, lambda: inspect_folder(task, read_trial(listed.path))
    some = folder / "some"
    some.mkdir()
    (some / "one.toml").write_text('session = "session.toml"\nlabels = { athlete = "anna", n = 1 }\n')
    (some / "two.toml").write_text('session = "session.toml"\n')
    yield "trials of a folder", some / "one.toml", partial(list_trials, str(some))


def clocks(folder):
    """Sound, images by number, pictures of a board, and when they were taken."""
    video = folder / "video.mp4"
    shutil.copy(THROWN_CROSS / "cam1.mp4", video)

    def seek():
        source = VideoSource("cam1", video)
        index = index_images(source)
        reader = ImageReader(source, index)
        try:
            return index.times(), reader.image(len(index) // 2)
        finally:
            reader.close()

    yield "images of a video", video, seek
    sound = folder / "sound.wav"
    with wave.open(str(sound), "wb") as file:
        file.setparams((1, 2, 8000, 0, "NONE", "NONE"))
        file.writeframes((1000 * np.random.default_rng(0).normal(size=4000)).astype("<i2").tobytes())
    yield "sound", sound, lambda: read_sound(VideoSource("cam1", sound))
    sources = folder / "sources.toml"
    sources.write_text(
        '[[camera]]\nname = "cam_1"\npictures = "left"\n[[camera]]\nname = "cam_2"\npictures = "right"\n'
        '[board]\nfile = "board.toml"\ntimestamps = "times.csv"\n'
    )
    (folder / "left").mkdir()
    picture = folder / "left" / "a.png"
    cv2.imwrite(str(picture), np.tile(np.arange(64, dtype=np.uint8), (48, 1)))
    known = read_sources(sources)
    yield "picture of a board", picture, lambda: first_image(known, known.camera[0])
    times = folder / "times.csv"
    times.write_text("sync_index,cam_id,frame_time\n0,1,0.0\n0,2,0.01\n1,1,0.04\n1,2,0.05\n")
    yield "time stamps", times, lambda: _moments_by_time_stamps(times, known.camera)
