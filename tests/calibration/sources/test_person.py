"""A rig refined by a moving person's detections."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.sources.person import align_rigs, median_reprojection_px, person_source, refine_rig
from airborne.cameras import Rig
from tests.support.people_seen import four_cameras, knocked, seen, walking
from tests.support.rigs import apart


def test_the_wrong_camera_is_named_and_all_agree_better():
    rig = four_cameras()
    detections = seen(rig, walking(30), sd_px=1.0)
    found = refine_rig(knocked(rig, "side"), detections)
    assert [mending.camera.name for mending in found.resections] == ["side"]
    assert found.after_px < 0.4 * found.before_px
    np.testing.assert_allclose(apart(found.rig), apart(rig), atol=0.03)
    for camera in found.rig:  # where the mended one stands along its line of sight is hardly told
        off = np.linalg.norm(camera.centre - rig[camera.name].centre)
        assert off < (0.15 if camera.name == "side" else 0.02)


def test_lenses_stay_unless_freed():
    rig = four_cameras()
    found = refine_rig(rig, seen(rig, walking(30)))
    for camera, before in zip(found.rig, rig, strict=True):
        np.testing.assert_array_equal(camera.K, before.K)


def test_detections_of_one_point_by_one_camera_err_together():
    rig = four_cameras()
    detections = seen(rig, walking(10))
    source = person_source(rig, detections)
    assert len(np.unique(source.cluster)) <= 26 * 4
    assert source.free_coordinates.all()
    assert median_reprojection_px(rig, detections) < 3


@pytest.mark.parametrize("scale", [1.0, 1.3])
def test_a_rig_is_brought_back_onto_another(scale):
    rig = four_cameras()
    move = RigidTransform.from_components([0.5, -1, 2], Rotation.from_rotvec([0.2, 0.3, -1]))
    moved = Rig(
        tuple(
            replace(
                c,
                camera_from_world=RigidTransform.from_components(
                    scale * c.camera_from_world.translation, c.camera_from_world.rotation
                )
                * move.inv(),
            )
            for c in rig
        )
    )
    back, found = align_rigs(moved, rig, rig.names)
    assert found == pytest.approx(1 / scale)
    for camera in moved:
        np.testing.assert_allclose(back.apply(camera.centre * found), rig[camera.name].centre, atol=1e-9)
