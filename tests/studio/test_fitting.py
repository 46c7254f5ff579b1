"""A pose that was placed beside the body goes to where the pictures show it."""

import csv
import shutil

import numpy as np

from airborne.studio.fitting import fit_to_frame
from airborne.studio.session import Session
from airborne.studio.starts import read_pose
from tests.support.places import THROWN_CROSS

NEAR_M = 0.006  # as near as tracked frames of the cross are


def test_poses_beside_the_body_are_fitted_to_the_pictures_of_their_frame(tmp_path):
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    session, before = Session(folder, folder / "trial.toml"), (folder / "trial.toml").read_bytes()
    model = session.project().model()
    frame, start = read_pose(session, model)
    with (folder / "truth.csv").open() as file:
        row = next(row for row in csv.DictReader(file) if int(row["field"]) == frame)
    true_m = [float(row[f"{axis}_m"]) for axis in "xyz"]
    for pose in (start, start.move(np.array([0.02, -0.015, 0.01]), np.array([0.0, 0.03, 0.0]))):
        fitted = fit_to_frame(session, model, frame, pose)
        assert np.linalg.norm(fitted.world_from_root.translation - true_m) < NEAR_M
        assert np.linalg.norm(pose.world_from_root.translation - true_m) > NEAR_M
    assert (folder / "trial.toml").read_bytes() == before
