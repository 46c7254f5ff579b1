"""One camera sees how large a body is by its fall alone: the run says how well, or that none is measured."""

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


@pytest.mark.parametrize(("motion", "measured"), [(carried, "and none was measured"), (thrown, "here to ")])
def test_distances_are_said_to_be_as_right_as_the_size_in_the_file(motion, measured):
    scene, kept = Scene(motion=motion, cameras=CAMERAS[:1]), KeptFrames()
    indices = range(20)
    for index in indices:
        kept.add(scene.frames(index))
    run = Motion.collect(track(scene, indices))
    found = check_run(run, CROSS, Rig(scene.cameras), kept, is_preset=False)
    (said,) = [doubt for doubt in found.doubts if "only a free fall shows" in doubt]
    is_measured = not any("a wrong frame rate would not be noticed" in doubt for doubt in found.doubts)
    assert is_measured == (motion is thrown)
    assert measured in said and "distances are as right as the sizes in the body's file" in said
