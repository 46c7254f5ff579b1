"""The visual hull covers the silhouettes of one body, and not those of two."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.cameras import camera_looking_at
from airborne.tracking.first_pose.places import connected_regions
from airborne.tracking.first_pose.visual_hull import uncovered_share

SIZE = (320, 240)
PLACES = {"left": (-4.0, -3.0, 1.5), "middle": (0.5, -5.0, 1.5), "right": (4.0, -2.0, 1.5)}
CAMERAS = [camera_looking_at(n, p, (0, 0, 1.2), focal_px=300.0, size=SIZE) for n, p in PLACES.items()]
CENTRE, RADIUS_M = np.array([0.2, 0.1, 1.3]), 0.5


def ball(camera, centre=CENTRE):
    """The region in which a camera sees a ball: pixels whose lines of sight pass its centre by less than its radius."""
    v, u = np.indices(SIZE[::-1])
    directions = np.einsum("ij,hwj->hwi", np.linalg.inv(camera.K), np.stack([u, v, np.ones_like(u)], axis=-1))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    at = camera.camera_from_world.apply(centre)
    (region,) = connected_regions(
        camera, np.where(np.linalg.norm(np.cross(directions, at), axis=-1) < RADIUS_M, 3.0, -3.0).astype(np.float32)
    )
    return region


@pytest.mark.parametrize("n", [2, 3])
def test_it_covers_the_silhouettes_of_one_body(n):
    assert uncovered_share([ball(camera) for camera in CAMERAS[:n]]) < 0.02


def test_it_leaves_more_of_them_the_further_one_is_off():
    first, second, third = map(ball, CAMERAS)
    up, middle, down = third.corner[1] - 25, third.corner[1], third.corner[1] + 12
    shares = [uncovered_share([first, second, replace(third, corner=(third.corner[0], y))]) for y in (middle, down, up)]
    assert shares[0] < 0.02 < shares[1] < shares[2]


def test_bodies_in_two_places_leave_it_empty():
    elsewhere = ball(CAMERAS[2], CENTRE + np.array([0, 0, 1.2]))
    assert uncovered_share([ball(CAMERAS[0]), ball(CAMERAS[1]), elsewhere]) == 1


def test_what_lies_behind_a_camera_is_no_body():
    behind = camera_looking_at("behind", (0.5, -5.0, 1.5), (0.5, -9.0, 1.5), focal_px=300.0, size=SIZE)
    assert uncovered_share([ball(CAMERAS[1]), replace(ball(CAMERAS[0]), camera=behind)]) == 1
