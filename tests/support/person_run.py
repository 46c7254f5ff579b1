"""The folder of a person's run as tracking leaves it, without tracking: for what reads runs."""

from fractions import Fraction
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import SAMPLED, Pose, human18
from airborne.body.files import write_body
from airborne.cameras import Rig, write_pose2sim
from airborne.motion.files import MotionWriter
from airborne.motion.run_folder import BODY, CALIBRATION, MOTION
from airborne.tracking import Estimate, Status

PERSON = human18(1.75, 70.0, outfit=SAMPLED)
PERSON_TABLE = 'body = { preset = "human18", stature_m = 1.75, mass_kg = 70.0 }'


def write_person_run(run: Path, rig: Rig, n: int, rate: Fraction) -> None:
    """Write a run of a person who turns while moving along x, n frames."""
    run.mkdir()
    write_pose2sim(run / CALIBRATION, rig)
    write_body(run / BODY, PERSON)
    with MotionWriter(run / MOTION, tuple(segment.name for segment in PERSON.segments[1:])) as writer:
        for k in range(n):
            root = RigidTransform.from_components([0.005 * k, 0, 1.0], Rotation.from_rotvec([0.01 * k, 0, 0.4]))
            writer.append(
                Estimate(
                    index=k,
                    time_s=k / rate,
                    status=Status.TRACKED,
                    pose=Pose(world_from_root=root, joint_angles=np.zeros((PERSON.n_joints, 3))),
                    covariance=np.eye(PERSON.n_dofs) * 1e-5,
                    score=5.0,
                    n_views=len(rig),
                )
            )
