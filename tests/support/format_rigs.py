"""Rigs made by hypothesis: cameras round a place that all look at, with every number that a format may hold."""

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras import Camera, Rig, camera_looking_at
from tests.support.tolerances import ROUNDTRIP

NAMES = st.text("abcXYZ 0189_-äé'\"<&", min_size=1, max_size=8).filter(str.strip)
PLAIN_NAMES = st.text("abcXYZ0189_-", min_size=1, max_size=8)
TARGET = np.array([0.3, -0.2, 1.1])


def numbers(low, high):
    return st.floats(low, high, allow_nan=False, allow_subnormal=False)


@st.composite
def cameras(draw, name, lenses, *, with_skew):
    lens = draw(st.sampled_from(lenses))
    n_terms = {"pinhole": 0, "radial": 2, "four": 4, "brown": 5, "fisheye": 4}[lens]
    away = np.array([draw(numbers(1, 9)), draw(numbers(-9, 9)), draw(numbers(0.1, 5))])
    flat = camera_looking_at(
        name, TARGET + away, TARGET, focal_px=draw(numbers(200, 5000)), size=(draw(st.integers(16, 4000)), 1080)
    )
    roll = RigidTransform.from_rotation(Rotation.from_rotvec([0, 0, draw(numbers(-4, 4))]))
    K = flat.K * [[draw(numbers(0.8, 1.2)), 1, draw(numbers(0.5, 1.5))], [1, 1, draw(numbers(0.5, 1.5))], [1, 1, 1]]
    K[0, 1] = draw(numbers(-20, 20)) if with_skew else 0
    terms = [draw(numbers(-0.4, 0.4)) for _ in range(n_terms)]
    return Camera(
        name=name,
        K=K,
        size=flat.size,
        camera_from_world=roll * flat.camera_from_world,
        distortion=np.pad(terms, (0, (4 if lens == "fisheye" else 5) - n_terms)),
        lens="fisheye" if lens == "fisheye" else "brown",
    )


@st.composite
def rigs(draw, *lenses, names=NAMES, with_skew=True, most=4):
    chosen = draw(st.lists(names, min_size=1, max_size=most, unique=True))
    return Rig(tuple(draw(cameras(name, lenses, with_skew=with_skew)) for name in chosen))


def assert_same(found: Rig, rig: Rig, *, with_names=True):
    """The two rigs are the same to a billionth of their numbers."""
    assert len(found) == len(rig)
    assert not with_names or found.names == rig.names
    for ours, theirs in zip(found, rig, strict=True):
        assert ours.size == theirs.size
        assert ours.lens == theirs.lens
        np.testing.assert_allclose(ours.K, theirs.K, rtol=ROUNDTRIP, atol=1e3 * ROUNDTRIP)
        np.testing.assert_allclose(ours.distortion, theirs.distortion, atol=ROUNDTRIP)
        R, R0 = (camera.camera_from_world.rotation.as_matrix() for camera in (ours, theirs))
        np.testing.assert_allclose(R, R0, atol=ROUNDTRIP)
        np.testing.assert_allclose(ours.centre, theirs.centre, rtol=ROUNDTRIP, atol=10 * ROUNDTRIP)


def visible_points(rig: Rig) -> np.ndarray:
    """Points (n, 3) [m] near the place that all cameras look at."""
    return TARGET + np.random.default_rng(0).uniform(-0.2, 0.2, (8, 3))
