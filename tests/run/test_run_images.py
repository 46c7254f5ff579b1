"""The whole run of a person is fitted to its videos once more: joints err less, and only by the run's own trial."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from airborne.body.chain import move_pose
from airborne.body.files import write_body
from airborne.cameras import Rig
from airborne.io.writing import write_text
from airborne.motion import MotionWriter
from airborne.motion.run_folder import BODY, MOTION, RUN_RECORD
from airborne.run.folder import run_identity
from airborne.synthetic import somersault_scene, write_trial
from airborne.tracking import Estimate, Status
from airborne.trial.file import read_trial
from tests.support.commands import in_process, refusal
from tests.support.run_files import contents_of

N, SCALE = 13, 4
OFF_M, OFF_RAD = 0.01, 0.05  # by which poses are wrong in every frame, in each direction


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


@pytest.fixture(scope="module")
def scene():
    return scene_of("ellipsoids")


@pytest.fixture(scope="module")
def folder(scene, tmp_path_factory):
    return run_of(scene, tmp_path_factory.mktemp("somersault"))


def run_of(scene, folder):
    """Its trial, and a run of it whose poses are a little wrong in every frame, without one that was lost."""
    write_trial(scene, folder / "trial")
    run, model, rng = folder / "run", scene.model, np.random.default_rng(4)
    run.mkdir()
    write_body(run / BODY, model)
    write_text(run / RUN_RECORD, json.dumps(run_identity(read_trial(folder / "trial" / "trial.toml"))))
    flight = scene.flight(np.array([float(scene.time_s(k)) for k in range(N)]))
    sd = np.repeat([OFF_M, OFF_RAD], [3, model.n_dofs - 3])
    with MotionWriter(run / MOTION, tuple(segment.name for segment in model.segments[1:])) as writer:
        for k in range(N):
            pose = move_pose(flight.pose(k), sd * rng.normal(size=model.n_dofs))
            writer.append(
                Estimate(
                    index=k,
                    time_s=scene.time_s(k),
                    status=Status.TRACKED,
                    score=5.0,
                    pose=pose,
                    covariance=np.diag(sd**2),
                    n_views=len(scene.rig),
                )
            )
    return folder


def errors_mm(scene, path):
    """The mean error of the landmarks in a table of smooth joints."""
    flight, names = scene.flight(np.array([float(scene.time_s(k)) for k in range(N)])), scene.model.landmarks
    true = {
        (k, mark.name): point
        for k in range(N)
        for mark, point in zip(names, scene.model.with_pose(flight.pose(k)).landmarks, strict=True)
    }
    with path.open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if (int(row["frame"]), row["joint"]) in true]
    assert len(rows) == len(true)
    found = ([float(row[axis]) for axis in ("x_m", "y_m", "z_m")] for row in rows)
    errors = [
        np.linalg.norm(point - true[int(row["frame"]), row["joint"]]) for point, row in zip(found, rows, strict=True)
    ]
    return 1e3 * float(np.mean(errors))


def smooth_both(scene, folder, out):
    """Smooth the run without and with its images; return both mean errors [mm] and how images were fitted."""
    run, trial = folder / "run", folder / "trial" / "trial.toml"
    assert in_process("smooth", run, "--events", "none", "-o", out / "plain") == 0
    assert in_process("smooth", run, "--events", "none", "--images", trial, "-o", out / "images") == 0
    plain, images = (errors_mm(scene, out / name / "tables/smooth_joints.csv") for name in ("plain", "images"))
    return plain, images, json.loads((out / "images/smooth.json").read_text())["history"][0]


def test_images_say_more_than_the_tracked_poses(scene, folder, tmp_path):
    before = contents_of(folder)
    plain, images, how = smooth_both(scene, folder, tmp_path)
    assert images < 0.6 * plain
    assert "fitted at once to its images by the body's surface" in how
    assert contents_of(folder) == before


def test_a_person_is_compared_in_a_skin(tmp_path):
    scene = scene_of("skin")
    plain, images, how = smooth_both(scene, run_of(scene, tmp_path / "skin"), tmp_path)
    assert images < 0.6 * plain
    assert "by a smooth skin" in how


def test_another_trial_and_another_method_are_refused(folder, capsys):
    run, trial = folder / "run", folder / "trial" / "trial.toml"
    assert "leave them out" in refusal(capsys, "smooth", run, "--spline", "--images", trial)
    masked = folder / "trial" / "masked.toml"
    mask = '[[mask]]\ncamera = "top"\nfirst = 0\nlast = 1\n'
    masked.write_text(trial.read_text() + "\n" + mask)
    assert "run of another trial (other masks)" in refusal(capsys, "smooth", run, "--kalman", "--images", masked)
