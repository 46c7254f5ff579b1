"""The equations of a silhouette's offset lead, to first order, from where it was drawn to where it is seen."""

import numpy as np
import pytest

from airborne.cameras import camera_looking_at
from airborne.tracking.self_check.offset_equations import (
    foreground_equations,
    light_equations,
    light_residuals,
    mixture_equations,
)
from airborne.tracking.self_check.registration import Silhouette, blur, warp_plane
from tests.support.tolerances import ROUNDTRIP

SIZE = (110, 90)  # [px]
MIDDLE, SIGMA_PX = np.array([54.0, 44.0]), 2.0
OFFSETS = 0.1 * np.array([[2, -1, 0, 0], [0, 0, 0.1, 0], [0, 0, 0, 0.1], [1, 2, -0.05, 0.1]])  # [px, px, rad, log]
OWN = np.array([[0.9, 0.3, 0.2], [0.2, 0.5, 0.7]])  # light of the two sides
SCENE = np.array([0.1, 0.15, 0.4])
REACH_PX = np.array([1, 1, 30, 30])  # of an offset, by its units
NEAR = 0.12  # of an offset: of second order, and OpenCV interpolates at every 32nd of a pixel


def silhouette():
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    mask = ((np.abs(x - 54) < 30) & (np.abs(y - 44) < 12 + (x - 54) // 6)).astype(np.float32)
    camera = camera_looking_at("cam", (0, -5, 0), (0, 0, 0), focal_px=900.0, size=SIZE)
    side = np.where(mask > 0, (x > 50).astype(int), -1)
    return Silhouette(camera, mask, mask, side, MIDDLE, (0, 0, *SIZE), np.ones(2), is_whole=True)


DRAWN = silhouette()
SIDES = np.stack([blur((DRAWN.side == label).astype(np.float32), SIGMA_PX) for label in (0, 1)])


def assert_near(found, offset):
    np.testing.assert_allclose(found * REACH_PX, offset * REACH_PX, atol=NEAR * np.abs(offset * REACH_PX).max())


@pytest.mark.parametrize("offset", OFFSETS)
def test_foreground_leads_to_the_offset(offset):
    mask = blur(DRAWN.mask, SIGMA_PX)
    shown = warp_plane(DRAWN, offset, mask)
    H, g = foreground_equations(mask, shown, MIDDLE, np.zeros(5), 1e3, 0.02)
    assert_near(np.linalg.solve(H, g)[:4], offset)


def mixture(shares):
    """What an image of the sides before an even scene shows."""
    return np.einsum("khw,kc->hwc", shares, OWN) + (1 - shares.sum(axis=0))[..., None] * SCENE


@pytest.mark.parametrize("offset", OFFSETS)
def test_light_leads_to_the_offset(offset):
    rows, columns = np.nonzero(np.ones(SIZE[::-1]))
    shown = mixture(np.stack([warp_plane(DRAWN, offset, side) for side in SIDES]))[rows, columns].astype(np.float32)
    scene = np.tile(SCENE, (len(rows), 1)).astype(np.float32)
    H, g = light_equations(SIDES, OWN, rows, columns, shown, scene, MIDDLE, np.zeros(5), 1e6)
    assert_near(np.linalg.solve(H, g)[:4], offset)


def test_light_of_the_sides_is_that_of_their_mixture():
    rows, columns = np.nonzero(SIDES.sum(axis=0) > 0.01)
    shown, scene = mixture(SIDES)[rows, columns], np.tile(SCENE, (len(rows), 1))
    A, B = mixture_equations(SIDES.astype(float), rows, columns, shown, scene)
    np.testing.assert_allclose(np.linalg.solve(A, B), OWN, atol=ROUNDTRIP)
    assert light_residuals(SIDES, OWN, rows, columns, shown, scene).max() < 1e-10  # float32
