"""A pose that was placed beside the body goes to where the pictures show it."""

import csv
import re

import numpy as np

from airborne.studio.disagreement import EdgeShift
from airborne.studio.fitting import FirstPoseFit, describe_quality, fit_to_frame
from airborne.studio.session import Session
from airborne.studio.starts import read_pose
from tests.support.example_trial import copy_cross

NEAR_M = 0.006  # as near as tracked frames of the cross are


def test_poses_beside_the_body_are_fitted_to_the_pictures_of_their_frame(tmp_path):
    folder = copy_cross(tmp_path / "cross")
    session, before = Session(folder, folder / "trial.toml"), (folder / "trial.toml").read_bytes()
    model = session.project().model()
    frame, start = read_pose(session, model)
    with (folder / "truth.csv").open() as file:
        row = next(row for row in csv.DictReader(file) if int(row["field"]) == frame)
    true_m = [float(row[f"{axis}_m"]) for axis in "xyz"]
    for pose in (start, start.move(np.array([0.02, -0.015, 0.01]), np.array([0.0, 0.03, 0.0]))):
        fit = fit_to_frame(session, model, frame, pose)
        assert np.linalg.norm(fit.pose.world_from_root.translation - true_m) < NEAR_M
        assert np.all(np.abs(fit.pose.world_from_root.translation - true_m) < 4 * fit.place_sd_m)
        says = r"Edges lie 0\.\d ± 0\.\d px off the outline on average; 3 of 3 cameras agree\. Place ± \d"
        assert re.match(says, describe_quality(fit))
        assert np.linalg.norm(pose.world_from_root.translation - true_m) > NEAR_M
    assert (folder / "trial.toml").read_bytes() == before


def test_a_doubtful_fit_says_why_and_what_to_do():
    shifts = [EdgeShift(name, np.array([u, 0.0]), 0.5, u > 1) for name, u in (("a", 0.5), ("b", 7.5))]
    off = FirstPoseFit(None, True, np.full(3, 0.004), shifts)
    assert describe_quality(off) == (
        "Doubtful: off in b 7.5 px. Edges lie 4.0 ± 0.4 px off the outline on average; 1 of 2 cameras agree. "
        "Place ± 4, 4, 4 mm (sd of x, y, z). Drag the body onto those pictures and fit again."
    )
    assert describe_quality(FirstPoseFit(None, False, np.full(3, 0.004), shifts[:1])).endswith("before you use it.")
    assert describe_quality(FirstPoseFit(None, True, np.full(3, 0.004), [])).startswith(
        "No camera shows enough of the body"
    )
