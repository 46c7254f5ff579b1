"""The fit of a person's whole run: joints err less than frame by frame, in windows too; keys and unknowns stay."""

import csv
import re
import shutil
from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest

from airborne.body.chain import move_pose
from airborne.cameras import Rig
from airborne.motion import Motion, landmarks
from airborne.motion.files import read_motion
from airborne.motion.frame_file import FRAME_SD_FILE
from airborne.motion.run_folder import JOINT_ANGLES, JOINTS, MOTION, SUMMARY, TRACKED_MOTION, read_body_run
from airborne.motion.smoothing.segments import MIN_FRAMES
from airborne.run import whole_run
from airborne.run.opening import open_trial
from airborne.run.whole_run import fit_whole_run
from airborne.synthetic import somersault_scene, write_trial
from airborne.tracking import Estimate, Status
from airborne.trial.file import read_trial
from airborne.video.rereading import Rereading
from tests.support.commands import in_process, refusal
from tests.support.example_trial import edit_trial
from tests.support.once import remember_skins
from tests.support.run_files import contents_of

N, SCALE = 13, 4
OFF_M, OFF_RAD = 0.01, 0.03  # by which poses are wrong in every frame, in each direction


def scene_of(target):
    """The beginning of a somersault, small."""
    scene = somersault_scene("moving-arms", target=target)
    middle = (SCALE - 1) / 2
    cameras = (
        each.resample(
            scale=(SCALE, SCALE), offset=(middle, middle), size=(each.size[0] // SCALE, each.size[1] // SCALE)
        )
        for each in scene.rig
    )
    return replace(scene, rig=Rig(tuple(cameras)), n_pictures=N)


def forget_lights(file):
    """Let a trial's lights be unknown, as where nobody measured them."""
    text = file.read_text(encoding="utf-8")
    file.write_text(re.sub(r"(?s)\n\[lights\].*?(?=\n\[(?!\[?lights))", "", text), encoding="utf-8")
    assert read_trial(file).lights is None


class TrackedRun:
    """A trial, its true flight, and estimates whose poses are a little wrong in every frame."""

    def __init__(self, scene, folder):
        write_trial(scene, folder)
        self.file, self.model = folder / "trial.toml", scene.model
        forget_lights(self.file)
        self.trial = read_trial(self.file)
        self.true = scene.flight(np.array([float(scene.time_s(k)) for k in range(N)]))
        rng, self.sd = np.random.default_rng(4), np.repeat([OFF_M, OFF_RAD], [3, self.model.n_dofs - 3])
        self.estimates = [
            Estimate(
                index=k,
                time_s=scene.time_s(k),
                status=Status.TRACKED,
                score=5.0,
                pose=move_pose(self.true.pose(k), self.sd * rng.normal(size=self.model.n_dofs)),
                covariance=np.diag(self.sd**2),
                n_views=len(scene.rig),
            )
            for k in range(N)
        ]

    @cached_property
    def fitted(self):
        """What the fit makes of the run as it is."""
        return self.fit(self.estimates)

    def fit(self, estimates, keys=()):
        """The motion as tracked, and what the fit of the whole run makes of it."""
        motion = Motion.collect(estimates, tuple(segment.name for segment in self.model.segments[1:]))
        reader = Rereading(open_trial(self.trial).recording)
        return motion, fit_whole_run(reader, self.trial.settings, self.model, motion, estimates, keys=keys)

    def error_m(self, motion, rows=slice(None)):
        """The mean error of the landmarks."""
        true = np.array([self.model.with_pose(self.true.pose(k)).landmarks for k in range(N)])
        return float(np.linalg.norm(landmarks(motion, self.model)[0] - true, axis=-1)[rows].mean())


@pytest.fixture(scope="module", autouse=True)
def _skins():
    with pytest.MonkeyPatch.context() as patch:
        remember_skins(patch)
        yield


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return TrackedRun(scene_of("ellipsoids"), tmp_path_factory.mktemp("somersault"))


@pytest.fixture(scope="module")
def short(run):
    """The trial of the first frames, whose motion is smooth in as few."""
    return edit_trial(run.file, "short.toml", (f"stop = {N}", f"stop = {MIN_FRAMES + 1}"))


@pytest.fixture(scope="module")
def whole(short, tmp_path_factory):
    """The folder of the run by the command line, which nobody changes."""
    folder = tmp_path_factory.mktemp("runs") / "whole"
    assert in_process("track", short, "-o", folder, "--no-pictures") == 0
    return folder


def test_joints_err_less_than_frame_by_frame_and_say_so(run):
    tracked, fitted = run.fitted
    assert run.error_m(fitted.motion) < 0.5 * run.error_m(tracked)
    assert fitted.surface == "ellipsoids"
    before, after = (np.trace(each.covariance[:, :3, :3], axis1=1, axis2=2) for each in (tracked, fitted.motion))
    assert (after < 0.8 * before).all()
    whole, by_frame = landmarks(fitted.motion, run.model)[1], fitted.motion.by_frame.landmark_m
    assert (by_frame < whole).mean() > 0.95 and (by_frame > 0.2 * whole).all()
    assert fitted.motion.status.tolist() == tracked.status.tolist()


def test_a_person_is_compared_in_a_skin(tmp_path):
    run = TrackedRun(scene_of("skin"), tmp_path)
    tracked, fitted = run.fitted
    assert run.error_m(fitted.motion) < 0.6 * run.error_m(tracked)
    assert fitted.surface == "skin"


def test_windows_fit_nearly_what_the_whole_run_does(run, monkeypatch):
    tracked, whole = run.fitted
    monkeypatch.setattr(whole_run, "_WINDOW", 5)
    monkeypatch.setattr(whole_run, "_MARGIN", 4)
    _, windows = run.fit(run.estimates)
    apart = np.linalg.norm(landmarks(windows.motion, run.model)[0] - landmarks(whole.motion, run.model)[0], axis=-1)
    assert 0 < apart.mean() < 0.2 * run.error_m(tracked)


def test_a_frame_with_a_key_stays_where_it_was_put(run):
    moved = move_pose(run.true.pose(6), np.repeat([0.05, 0.0], [3, run.model.n_dofs - 3]))
    keyed = replace(run.estimates[6], pose=moved, covariance=np.diag((0.01 * run.sd) ** 2))
    estimates = [*run.estimates[:6], keyed, *run.estimates[7:]]
    (_, free), (tracked, held) = run.fit(estimates), run.fit(estimates, keys=[6])
    assert np.linalg.norm(held.motion.position[6] - tracked.position[6]) < 0.003
    assert np.linalg.norm(free.motion.position[6] - tracked.position[6]) > 0.03


@pytest.mark.parametrize(("uncertain", "is_known"), [((), True), ((1,), False)])
def test_a_joint_that_a_frame_did_not_know_is_known_where_its_images_show_it_unless_it_may_be_elsewhere(
    run, uncertain, is_known
):
    covariance = np.diag(run.sd**2)
    covariance[9:12], covariance[:, 9:12] = 0.0, 0.0
    covariance[range(9, 12), range(9, 12)] = np.inf
    unknown = replace(run.estimates[6], covariance=covariance, uncertain_joints=uncertain)
    variances = np.diagonal(
        run.fit([*run.estimates[:6], unknown, *run.estimates[7:]])[1].motion.covariance, axis1=1, axis2=2
    )
    assert (np.isfinite(variances[6, 9:12]) == is_known).all()
    assert np.isfinite(np.delete(variances, range(9, 12), axis=1)).all()
    assert np.isfinite(np.delete(variances, 6, axis=0)).all()


def test_a_run_too_short_to_be_smooth_stays_as_it_is(run):
    assert run.fit(run.estimates[:4])[1] is None


def test_a_run_that_ended_or_was_killed_in_its_fit_goes_on_from_what_was_tracked(short, whole, tmp_path):
    again = tmp_path / "again"
    tracked, fitted = read_motion(whole / TRACKED_MOTION), read_motion(whole / MOTION)
    assert np.linalg.norm(fitted.position - tracked.position, axis=1).max() > 1e-4
    shutil.copytree(whole, again)
    (again / SUMMARY).unlink()
    (again / MOTION).write_bytes((again / MOTION).read_bytes()[:-40])  # torn; covariance.bin is the fit's already
    assert in_process("track", short, "-o", again, "--no-pictures", "--resume") == 0
    for name in (MOTION, JOINTS, TRACKED_MOTION, FRAME_SD_FILE):
        assert (again / name).read_bytes() == (whole / name).read_bytes()


def test_deviations_by_frame_stand_in_the_tables_and_a_cut_file_of_them_is_left_out(whole, tmp_path):
    shutil.copytree(whole, tmp_path / "cut")
    (motion, _), file = read_body_run(whole), tmp_path / "cut" / FRAME_SD_FILE
    with (whole / JOINTS).open(newline="") as table:
        in_table = [float(row["sd_frame_m"]) for row in csv.DictReader(table)]
    np.testing.assert_array_equal(in_table, motion.by_frame.landmark_m.ravel())
    with (whole / JOINT_ANGLES).open(newline="") as table:
        in_table = [float(row["y_deg_sd_frame"]) for row in csv.DictReader(table)]
    np.testing.assert_array_equal(in_table, np.rad2deg(motion.by_frame.angle_rad[..., 1].ravel()))
    file.write_bytes(file.read_bytes()[: -8 * len(motion)])
    assert read_motion(tmp_path / "cut" / MOTION).by_frame is not None
    assert read_body_run(tmp_path / "cut")[0].by_frame is None


def test_a_refused_resume_leaves_a_fitted_run_as_it_is(short, whole, tmp_path, capsys):
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    before = contents_of(folder)
    other = edit_trial(short, "other.toml", ("[track]\n", '[track]\nprediction = "none"\n'))
    assert "holds another run" in refusal(capsys, "track", other, "-o", folder, "--no-pictures", "--resume")
    assert contents_of(folder) == before


def test_a_trial_may_leave_poses_as_they_are_tracked(short, tmp_path):
    plain = edit_trial(short, "plain.toml", ("[track]\n", "[track]\nwhole_run = false\n"))
    assert in_process("track", plain, "-o", tmp_path / "plain", "--no-pictures") == 0
    assert not (tmp_path / "plain" / TRACKED_MOTION).exists()
