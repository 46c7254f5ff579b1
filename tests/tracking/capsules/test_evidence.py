"""Sums under the outlines of tapered capsules, against discs strung along their axes and looked at point by point."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras import Camera
from airborne.tracking.capsules.evidence import capsule_evidence
from airborne.tracking.capsules.kernel_arguments import Workspace
from airborne.tracking.capsules.outlines import BEHIND_M, draw_labels, outline, project_capsules
from airborne.tracking.capsules.spans import cumulative_sums
from tests.support.tolerances import SOLVED

W, H, FINE = 64, 56, 32  # of the maps [px], and points a pixel along a row
ONE = np.array([0, 0], np.int64)


def hull(a, b, rows):
    """Where the hull of two discs begins and ends in rows (n,): (2, n), NaN where it is not."""
    t = np.linspace(0, 1, 3001)[:, None]
    discs = (1 - t) * a + t * b
    squared = discs[:, 2:] ** 2 - (rows - discs[:, 1:2]) ** 2
    half = np.sqrt(np.maximum(squared, 0))
    low = np.where(squared >= 0, discs[:, :1] - half, np.inf).min(axis=0)
    high = np.where(squared >= 0, discs[:, :1] + half, -np.inf).max(axis=0)
    return np.where(low <= high, [low, high], np.nan)


def is_tangent_on_either_side(a, b):
    """Whether one common tangent bounds the hull on the left, the other on the right."""
    (ux, uy), dr = b[:2] - a[:2], a[2] - b[2]
    return abs(uy) * np.sqrt(max(ux**2 + uy**2 - dr**2, 0)) > 1.01 * abs(ux * dr)


def random_pairs(n, seed=0):
    """Pairs of discs in the image: apart, overlapping, one above the other, side by side."""
    rng = np.random.default_rng(seed)
    for i in range(n):
        a, b = np.column_stack([rng.uniform(16, 40, (2, 2)), rng.uniform(1, 8, 2)])
        if i % 4 == 1:
            b[:2] = a[:2] + rng.uniform(-8, 8, 2)
        if i % 4 > 1:
            b[3 - i % 4] = a[3 - i % 4] + rng.uniform(-2, 2)
        yield a, b


def outlined(a, b, y_first=0.0, n=H):
    x = np.full((2, n), np.nan)
    first, last = outline(a, b, y_first, x, np.empty((2, n), np.int64), np.empty((2, 7)))
    return first, last, x


def check_outline(a, b):
    first, last, x = outlined(a, b)
    true = hull(a, b, np.arange(H))
    assert np.array_equal(np.flatnonzero(np.isfinite(true[0])), np.arange(first, last))
    np.testing.assert_allclose(x[:, first:last], true[:, first:last], atol=0.01)


def is_one_in_the_other(a, b):
    return np.hypot(*(b - a)[:2]) <= 1.01 * abs(a[2] - b[2])


def test_outline_is_that_of_all_discs_between_the_two():
    pairs = [(a, b) for a, b in random_pairs(100) if is_tangent_on_either_side(a, b) or is_one_in_the_other(a, b)]
    assert len(pairs) > 60
    for a, b in pairs:
        check_outline(a, b)


def test_outline_is_that_of_all_discs_where_both_tangents_bound_one_side():
    check_outline(np.array([39.0, 30.5, 5.5]), np.array([31.0, 31.0, 2.0]))


def test_outline_of_a_disc_within_another_is_the_larger_one():
    large, small = np.array([30.0, 28.0, 9.0]), np.array([33.0, 26.0, 4.0])
    for a, b in ((large, small), (small, large)):
        first, last, x = outlined(a, b)
        half = np.sqrt(81 - (np.arange(first, last) - 28.0) ** 2)
        assert (first, last) == (19, 38)
        np.testing.assert_allclose(x[:, first:last], [30 - half, 30 + half])


def test_outline_does_not_depend_on_the_order_of_the_discs():
    for a, b in random_pairs(40, seed=3):
        if is_tangent_on_either_side(a, b):
            first, last, x = outlined(a, b)
            *rows, x_back = outlined(b, a)
            assert rows == [first, last]
            np.testing.assert_allclose(x_back[:, first:last], x[:, first:last], atol=1e-9)


def test_outline_begins_in_the_row_it_is_asked_for():
    a, b = np.array([30.0, 20.0, 5.0]), np.array([34.0, 40.0, 3.0])
    first, last, x = outlined(a, b)
    cut_first, cut_last, cut = outlined(a, b, y_first=25.0, n=10)
    assert (first, last, cut_first, cut_last) == (15, 44, 0, 10)
    np.testing.assert_allclose(cut, x[:, 25:35])


def camera(width=W, height=H, focal_px=120.0):
    K = np.array([[focal_px, 0, (width - 1) / 2], [0, focal_px, (height - 1) / 2], [0, 0, 1.0]])
    rotation = Rotation.from_euler("xyz", [0.2, -0.3, 0.1])
    return Camera(
        name="c", K=K, size=(width, height), camera_from_world=RigidTransform.from_components([0.1, 0, 4.0], rotation)
    )


def test_projected_centres_are_the_cameras_and_radii_shrink_with_depth():
    seen_by = camera()
    ends, radii = np.random.default_rng(0).normal(scale=0.4, size=(5, 2, 3)), np.full((5, 2), 0.1)
    packed = np.zeros((4, 4))
    packed[:3], packed[3, 0] = seen_by.P, 120.0
    discs, depth = np.empty((5, 2, 3)), np.empty(5)
    project_capsules(ends, radii, packed, discs, depth)
    z = seen_by.camera_from_world.apply(ends.reshape(-1, 3))[:, 2].reshape(5, 2)
    np.testing.assert_allclose(discs[..., :2], seen_by.px_from_world(ends))
    np.testing.assert_allclose(discs[..., 2], 12 / z)
    np.testing.assert_allclose(depth, z.mean(axis=1))
    ends[2, 1] = seen_by.camera_from_world.inv().apply([0, 0, -1.0])
    project_capsules(ends, radii, packed, discs, depth)
    assert depth[2] == BEHIND_M
    assert np.all(np.isfinite(discs))


def test_cumulative_sums_are_numpys():
    maps = np.random.default_rng(1).normal(size=(3, 5, 7)).astype(np.float32)
    out = np.full((3, 5, 8), np.nan, np.float32)
    cumulative_sums(maps, out)
    np.testing.assert_allclose(out[..., 1:], np.cumsum(maps, axis=-1), atol=1e-5)
    assert not out[..., 0].any()


LEG = np.array([[[24.0, 10.0, 7.0], [30.0, 28.0, 5.0]], [[30.0, 28.0, 5.0], [26.0, 46.0, 3.5]]])
OTHER_LEG = np.array([[[34.0, 12.0, 6.5], [27.0, 27.0, 4.5]], [[27.0, 27.0, 4.5], [36.0, 45.0, 3.0]]])
DISCS = np.concatenate([LEG, OTHER_LEG])
DEPTH = np.array([4.2, 4.0, 4.1, 4.3])
CLASSES = np.array([[0, 1], [1, 2], [0, 1], [1, 2]], np.int64)
SHARE = np.array([0.4, 0.6, 0.4, 0.6])


def noise(seed, blur=4.0, k=3):
    """Smooth maps (k, H, W) about as large as one nat."""
    rng = np.random.default_rng(seed)
    maps = np.array([cv2.GaussianBlur(rng.normal(size=(H, W)), (0, 0), blur) for _ in range(k)])
    return (maps / maps.std() + 0.5).astype(np.float32)


def summed(discs, maps, share=SHARE, depth=DEPTH, classes=CLASSES, origin=(0.0, 0.0)):
    """Owned (n, 2, 2), gradient (n, 7) and curvature (n, 7, 7) of maps (k, h, w) under the discs."""
    n, (k, h, w) = len(discs), maps.shape
    sums = np.empty((k, h, w + 1), np.float32)
    cumulative_sums(maps, sums)
    owned, gradient, curvature = np.empty((n, 2, 2)), np.empty((n, 7)), np.empty((n, 7, 7))
    work = Workspace.of(n, h)
    capsule_evidence(discs, depth, classes, share, sums, np.ones(k), np.array(origin), work, owned, gradient, curvature)
    return owned, gradient, curvature


def owners(discs, share=SHARE, depth=DEPTH, shape=(H, W)):
    """Who owns each of FINE points a pixel along the rows: (h, FINE w), twice the capsule + 1 in its second part."""
    h, w = shape
    x = (np.arange(FINE * w) + 0.5) / FINE - 0.5
    owner = np.full((h, FINE * w), -1)
    for i in np.argsort(-np.asarray(depth)):
        low, high = hull(*discs[i], np.arange(h))[:, :, None]
        axis = discs[i, 1, :2] - discs[i, 0, :2]
        border = discs[i, 0, :2] + share[i] * axis
        is_second = (x - border[0]) * axis[0] + (np.arange(h)[:, None] - border[1]) * axis[1] > 0
        inside = (x >= low) & (x <= high)
        owner[inside] = (2 * i + is_second)[inside]
    return owner


def by_points(discs, maps, share=SHARE, depth=DEPTH, classes=CLASSES):
    """What `capsule_evidence` should return, (n, 2, 2), by testing every point."""
    owner = owners(discs, share, depth, maps.shape[1:])
    fine = np.repeat(maps, FINE, axis=2)
    parts = [(fine[classes.ravel()[p]][owner == p], owner == p) for p in range(2 * len(discs))]
    return np.array([[each.sum(), there.sum()] for each, there in parts]).reshape(-1, 2, 2) / FINE


def linear(a, b, c):
    return np.broadcast_to(a * np.arange(W) + b * np.arange(H)[:, None] + c, (3, H, W)).astype(np.float32)


@pytest.mark.parametrize("maps", [linear(0, 0, 1.0), linear(0.05, -0.03, 2), noise(0)], ids=["one", "linear", "noise"])
def test_sums_and_areas_are_those_of_the_points_under_the_capsules(maps):
    owned, _, _ = summed(DISCS, maps)
    true = by_points(DISCS, maps)
    np.testing.assert_allclose(owned[..., 1], true[..., 1], atol=1.5)  # a row on a flat border is shared out
    np.testing.assert_allclose(owned[..., 1].sum(axis=1), true[..., 1].sum(axis=1), atol=0.3)
    np.testing.assert_allclose(owned[..., 0].sum(), true[..., 0].sum(), atol=4.0)
    np.testing.assert_allclose(owned[..., 0], true[..., 0], atol=1.5 * np.abs(maps).max())


def test_sum_of_ones_is_the_area():
    owned, _, _ = summed(DISCS, linear(0, 0, 1.0))
    np.testing.assert_allclose(owned[..., 0], owned[..., 1], atol=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_no_pixel_counts_twice(seed):
    rng = np.random.default_rng(seed)
    n = 9
    discs = np.stack([rng.uniform([15, 12, 2], [48, 44, 7], (n, 3)) for _ in range(2)], axis=1)
    discs = np.array([each for each in discs if is_tangent_on_either_side(*each)])
    depth, share = rng.uniform(3, 5, len(discs)), rng.uniform(0.2, 0.8, len(discs))
    classes = rng.integers(0, 3, (len(discs), 2))
    owned, _, _ = summed(discs, linear(0, 0, 1.0), share, depth, classes)
    rows = np.arange(-0.5, H - 0.5, 1 / 16) + 1 / 32
    low, high = np.array([hull(*each, rows) for each in discs]).swapaxes(0, 1)[..., None]
    x = (np.arange(FINE * W) + 0.5) / FINE - 0.5
    covered = ((x >= low) & (x <= high)).any(axis=0)
    assert owned[..., 1].sum() == pytest.approx(covered.sum() / FINE / 16, rel=0.005)


def test_nearer_capsule_owns_what_both_cover():
    back, front = np.array([[30.0, 15.0, 6.0], [30.0, 40.0, 6.0]]), np.array([[20.0, 25.0, 4.0], [42.0, 31.0, 4.0]])
    discs, share = np.array([back, front]), np.ones(2)
    alone = [summed(each[None], linear(0, 0, 1.0), np.ones(1), np.ones(1), CLASSES[:1])[0] for each in discs]
    whole = [each[0, :, 1].sum() for each in alone]
    for depth in ([5.0, 4.0], [4.0, 5.0]):
        owned, _, _ = summed(discs, linear(0, 0, 1.0), share, np.array(depth), CLASSES[:2])
        near = int(np.argmin(depth))
        assert owned[near, :, 1].sum() == pytest.approx(whole[near], abs=1e-3)
        assert owned[1 - near, :, 1].sum() < whole[1 - near] - 50


def test_capsule_behind_the_camera_owns_nothing():
    depth = DEPTH.copy()
    depth[1] = BEHIND_M
    owned, gradient, curvature = summed(DISCS, noise(1), depth=depth)
    left = np.array([0, 2, 3])
    others = summed(DISCS[left], noise(1), SHARE[left], DEPTH[left], CLASSES[left])
    assert not owned[1].any() and not gradient[1].any() and not curvature[1].any()
    for part, other in zip((owned, gradient, curvature), others, strict=True):
        np.testing.assert_allclose(part[left], other, atol=SOLVED)


def test_a_region_is_the_same_as_the_whole_image():
    maps = noise(2)
    whole = summed(DISCS, maps)
    part = summed(DISCS, np.ascontiguousarray(maps[:, 1:54, 9:55]), origin=(9.0, 1.0))
    for each, other in zip(whole, part, strict=True):
        np.testing.assert_allclose(each, other, atol=5e-3)


def test_what_lies_outside_the_region_counts_nothing():
    maps = np.ascontiguousarray(linear(0, 0, 1.0)[:, 15:40, 25:45])
    owned, _, _ = summed(DISCS, maps, origin=(25.0, 15.0))
    owner = owners(DISCS)[15:40, int(25.5 * FINE) : int(44.5 * FINE)]  # from middle to middle of its outer pixels
    true = [np.count_nonzero(owner // 2 == i) / FINE for i in range(4)]
    np.testing.assert_allclose(owned[..., 1].sum(axis=1), true, atol=0.3)
    far, *_ = summed(DISCS + np.array([200.0, 0, 0]), maps, origin=(25.0, 15.0))
    assert not far.any()


def differences(discs, maps, step=0.5):
    """Central differences of the total by every number of every disc [px], and by the shares: (n, 7)."""
    n = len(discs)
    derivatives = np.empty((n, 7))
    for i in range(n):
        for p in range(7):
            length = 1.0 if p < 6 else np.linalg.norm(discs[i, 1, :2] - discs[i, 0, :2])
            totals = []
            for sign in (1, -1):
                moved, share = discs.copy(), SHARE[:n].copy()
                if p < 6:
                    moved[i].reshape(-1)[p] += sign * step
                else:
                    share[i] += sign * step / length
                totals.append(summed(moved, maps, share, DEPTH[:n], CLASSES[:n])[0][..., 0].sum())
            derivatives[i, p] = (totals[0] - totals[1]) / (2 * step / length)
    return derivatives


def gradients(discs, seeds=range(10, 16)):
    """Our gradients and the differences over some maps: (2, maps, n, 7)."""
    n = len(discs)
    ours = [summed(discs, noise(seed), SHARE[:n], DEPTH[:n], CLASSES[:n])[1] for seed in seeds]
    return np.array([ours, [differences(discs, noise(seed)) for seed in seeds]])


def misfit(ours, true):
    """The RMS of a difference over that of the truth."""
    return np.sqrt(np.mean((ours - true) ** 2) / np.mean(true**2))


def test_gradient_is_that_of_the_sum():
    ours, true = gradients(LEG)
    assert misfit(ours[..., [0, 3]], true[..., [0, 3]]) < 0.3
    assert misfit(ours[..., 6], true[..., 6]) < 0.1
    for p in range(6):  # y and radii leave out what is flat
        assert np.corrcoef(ours[..., p].ravel(), true[..., p].ravel())[0, 1] > 0.9


def test_gradient_by_height_of_a_level_capsule_is_that_of_the_sum():
    ours, true = gradients(np.array([[[22.0, 28.13, 4.0], [42.0, 28.63, 4.0]]]))
    assert misfit(ours[..., [1, 4]].sum(axis=-1), true[..., [1, 4]].sum(axis=-1)) < 0.1
    assert misfit(ours[..., [2, 5]], true[..., [2, 5]]) < 0.05


@pytest.mark.parametrize("tilt", [0.0, 0.4, 3.0])
def test_the_sum_under_a_level_capsule_is_no_staircase(tilt):
    areas = []
    for y in np.linspace(20, 21, 11):
        capsule = np.array([[[18.0, y, 4.0], [42.0, y + tilt, 4.0]]])
        areas.append(summed(capsule, linear(0, 0, 1.0), SHARE[:1], DEPTH[:1], CLASSES[:1])[0][..., 0].sum())
    length = np.hypot(24, tilt)
    np.testing.assert_allclose(areas, 8 * length + 16 * np.pi, rtol=0.015)  # rows alone: 11 %


def test_a_level_capsule_takes_from_what_lies_behind_it():
    front, behind = [[16.0, 30.4, 4.0], [44.0, 30.7, 4.0]], [[30.0, 14.0, 7.0], [30.0, 46.0, 7.0]]
    owned, gradient, _ = summed(np.array([front, behind]), linear(0, 0, 1.0), SHARE[:2], DEPTH[[1, 3]], CLASSES[:2])
    alone, _, _ = summed(np.array([front]), linear(0, 0, 1.0), SHARE[:1], DEPTH[[1]], CLASSES[:1])
    whole, _, _ = summed(np.array([behind]), linear(0, 0, 1.0), SHARE[1:2], DEPTH[[3]], CLASSES[1:2])
    assert owned[0, :, 1].sum() == pytest.approx(alone[0, :, 1].sum(), abs=1e-6)
    assert owned[1, :, 1].sum() == pytest.approx(whole[0, :, 1].sum() - 14 * 8, rel=0.01)
    assert gradient[0, [2, 5]].sum() == pytest.approx(2 * 28 + 8 * np.pi - 2 * 14, rel=0.03)  # nothing where it covers


def test_gradient_by_the_share_is_nothing_where_the_border_is_occluded():
    occluded, front = np.array([[30.0, 12.0, 4.0], [30.0, 44.0, 4.0]]), np.array([[30.0, 20.0, 8.0], [30.0, 36.0, 8.0]])
    discs, share = np.array([front, occluded]), np.array([1.0, 0.5])
    _, gradient, _ = summed(discs, noise(3), share, np.array([4.0, 5.0]), np.array([[2, 2], [0, 1]]))
    assert gradient[1, 6] == pytest.approx(0, abs=1e-6)


def test_sums_without_a_gradient_are_the_same():
    maps = noise(5)
    owned, _, _ = summed(DISCS, maps)
    sums = np.empty((3, H, W + 1), np.float32)
    cumulative_sums(maps, sums)
    again, work = np.empty_like(owned), Workspace.of(4, H)
    capsule_evidence(
        DISCS, DEPTH, CLASSES, SHARE, sums, np.ones(3), np.zeros(2), work, again, np.empty((0, 7)), np.empty((0, 7, 7))
    )
    np.testing.assert_array_equal(owned, again)


def test_curvature_is_symmetric_and_never_negative():
    _, _, curvature = summed(DISCS, noise(6))
    np.testing.assert_allclose(curvature, curvature.swapaxes(1, 2), rtol=1e-9, atol=1e-9)
    eigenvalues = np.linalg.eigvalsh(curvature)
    assert eigenvalues.min() > -1e-6 * eigenvalues.max()
    assert np.all(np.diagonal(curvature, axis1=1, axis2=2) > 0)


def test_drawn_labels_cover_what_the_evidence_owns():
    out = np.empty((H, W), np.int8)
    draw_labels(DISCS, DEPTH, CLASSES, SHARE, out)
    owned, _, _ = summed(DISCS, linear(0, 0, 1.0))
    for surface_class in range(3):
        area = owned[..., 1][np.equal(CLASSES, surface_class)].sum()
        assert np.count_nonzero(out == surface_class) == pytest.approx(area, rel=0.05)
    assert np.count_nonzero(out >= 0) == pytest.approx(owned[..., 1].sum(), rel=0.015)
    owner = owners(DISCS)[:, FINE // 2 :: FINE]
    agree = out == np.append(CLASSES.ravel(), -1)[owner]
    assert agree.mean() > 0.998
