"""A camera whose pictures lie beside the body's outline is named, and by how much; one that agrees is not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose, surface_arrays
from airborne.body.files import read_body
from airborne.cameras import camera_looking_at
from airborne.rendering import FLAT, render
from airborne.studio.disagreement import EdgeShift, describe_shifts, edge_shift
from airborne.studio.outlines import outline_items
from tests.support.places import THROWN_CROSS

CROSS = read_body(THROWN_CROSS / "cross.toml")
CAMERA = camera_looking_at("a", [3, -2, 1.5], [0, 0, 1], focal_px=900, size=(640, 480))


def seen_from(camera, rng, shift=(0.0, 0.0)):
    """A noisy picture of the cross before clutter, and its outline as a camera shifted by (2,) [px] has it."""
    rotation = Rotation.random(random_state=int(rng.integers(1 << 30)))
    posed = CROSS.with_pose(Pose(world_from_root=RigidTransform.from_components([0, 0, 1.0], rotation)))
    image = np.kron(rng.integers(40, 150, (24, 32, 3)), np.ones((20, 20, 1))).astype(float)
    drawn = render(surface_arrays(CROSS), posed, camera, FLAT)
    image[drawn.mask] = drawn.colour[drawn.mask]
    image = np.clip(image + rng.normal(0, 6, image.shape), 0, 255).astype(np.uint8)
    K = camera.K.copy()
    K[:2, 2] -= shift
    items = outline_items(posed, [replace(camera, K=K)], "")
    return image, [np.array(item["points"]) for item in items]


@pytest.mark.parametrize("shift", [(0.0, 0.0), (6.0, -3.0), (33.0, 14.0), (-20.0, -29.0)])
def test_a_shift_is_measured_within_its_deviation(shift):
    rng = np.random.default_rng(4)
    found = edge_shift("a", [seen_from(CAMERA, rng, shift) for _ in range(3)])
    assert np.linalg.norm(found.px - shift) < max(4 * found.sd_px, 1.0)
    assert found.sd_px < 1
    assert found.stands_out == any(shift)


def test_an_outline_out_of_view_tells_nothing():
    image = np.zeros((480, 640, 3), np.uint8)
    assert edge_shift("a", []) is None
    assert edge_shift("a", [(image, [])]) is None
    assert edge_shift("a", [(image, [np.array([[-50.0, 0], [-40, 0], [-40, 9]])])]) is None


def test_the_one_that_is_further_off_than_the_others_disagrees():
    def shift(name, u, stands_out):
        return EdgeShift(name, np.array([u, 0.0]), 0.5, stands_out)

    text = describe_shifts([shift("a", 1.0, False), shift("b", -6.0, True), shift("c", 2.0, True)])
    assert text.startswith("b disagrees. ")
    assert "b -6.0, +0.0 px, sd 0.5; c +2.0" in text
    assert describe_shifts([shift("a", 5.0, True), shift("b", -6.0, True)]).startswith("no camera disagrees")
    assert describe_shifts([]) == "too little of the body is seen here to tell"
