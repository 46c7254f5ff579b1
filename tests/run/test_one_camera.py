"""One camera sees how large a body is by its fall alone; where none is measured, the run says so."""

import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.cameras import Rig
from airborne.motion import Motion
from airborne.run.self_check import check_run
from airborne.tracking.self_check.kept_frames import KeptFrames
from tests.support.scenes import CAMERAS, CROSS, Scene, thrown, track


def carried(time_s):
    """Move the cross across the picture at one speed."""
    place = RigidTransform.from_components(
        [-0.3 + 1.5 * float(time_s), 0, 1.2], Rotation.from_euler("xyz", [1, 0.3, 0])
    )
    return Pose(world_from_root=place)


@pytest.mark.parametrize(("motion", "is_said"), [(carried, True), (thrown, False)])
def test_where_nothing_falls_the_size_is_said_to_be_the_files(motion, is_said):
    scene, kept = Scene(motion=motion, cameras=CAMERAS[:1]), KeptFrames()
    indices = range(20)
    for index in indices:
        kept.add(scene.frames(index))
    run = Motion.collect(track(scene, indices))
    found = check_run(run, CROSS, Rig(scene.cameras), kept, is_preset=False)
    assert any("only a free fall shows" in doubt for doubt in found.doubts) == is_said
