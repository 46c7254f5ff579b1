"""A moving person's detections as a source."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.initial.resection import MISPLACED_PX
from airborne.calibration.sources.person import align_rigs, calibration_prior, person_source
from airborne.cameras import Rig
from tests.support.people_seen import four_cameras, seen, walking


def test_detections_of_one_point_by_one_camera_err_together():
    rig = four_cameras()
    detections = seen(rig, walking(10))
    source = person_source(rig, detections)
    assert len(np.unique(source.cluster)) <= 26 * 4
    assert source.free_coordinates.all()


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


def test_a_trusted_camera_may_shift_the_picture_by_half_of_what_is_misplaced():
    rig, points = four_cameras(), walking(10).reshape(-1, 3)
    trusted = rig.names[:2]
    sd = calibration_prior(rig, trusted, points).sd
    middle = np.median(points, axis=0)
    for row, camera in zip(sd, rig, strict=True):
        assert np.isinf(row[6:]).all(), "lenses have no prior"
        if camera.name not in trusted:
            assert np.isinf(row).all()
            continue
        by_rotation = row[0] * camera.K[0, 0]
        by_place = row[3] / np.linalg.norm(camera.centre - middle) * camera.K[0, 0]
        assert np.hypot(by_rotation, by_place) == pytest.approx(MISPLACED_PX / 2)
