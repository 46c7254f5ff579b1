from dataclasses import replace

import numpy as np
import pytest

from airborne.body import surface_arrays, surface_of_segments
from airborne.rendering import FLAT, evidence_maps, mask_evidence, mask_out_surface, render
from airborne.rendering.reduction import reduce_camera, reduce_image
from tests.support.bodies import batch, camera, in_slabs, random_body

CAMERAS = [camera("a"), camera("b", turn=2.0, size=(77, 90))]
MAPS = [np.random.default_rng(i).normal(0, 2, c.size[::-1]).astype(np.float32) for i, c in enumerate(CAMERAS)]
SUM = 5e-2  # nats, of sums over hundreds of pixels in float32


@pytest.mark.parametrize(
    "kinds", [["ellipsoid"] * 6, ["box"] * 4, ["slab"] * 6, ["ellipsoid", "box", "mesh", "slab"]], ids=lambda k: k[0]
)
@pytest.mark.parametrize("scale", [1, 2])
def test_evidence_is_the_sum_over_the_drawn_mask_each_pixel_once(kinds, scale):
    model = random_body(kinds, np.random.default_rng(3))
    shapes, (R, t) = surface_arrays(model), batch(model, 6, 4)
    evidence = mask_evidence(shapes, evidence_maps(CAMERAS, MAPS, scale=scale), R, t)
    for hypothesis, R_h, t_h in zip(evidence, R, t, strict=True):
        body = type("Body", (), {"R": R_h, "t": t_h})
        for total, seen_by, plane in zip(hypothesis, CAMERAS, MAPS, strict=True):
            mask = render(shapes, body, reduce_camera(seen_by, scale), FLAT).mask  # type: ignore[arg-type]
            assert mask.sum() > 50
            assert total == pytest.approx(reduce_image(plane, scale)[mask].sum(dtype=float), abs=SUM)


def test_an_ellipsoid_in_two_colours_has_as_much_evidence_as_in_one():
    model = random_body(["ellipsoid"] * 4, np.random.default_rng(1))
    segments = [
        replace(s, parts=tuple(piece for each in s.parts for piece in in_slabs(each, [-0.07, 0.04])))
        for s in model.segments
    ]
    (R, t), maps = batch(model, 6, 5), evidence_maps(CAMERAS, MAPS)
    one, two = (mask_evidence(surface_arrays(m), maps, R, t) for m in (model, replace(model, segments=tuple(segments))))
    assert np.abs(one).max() > 10
    np.testing.assert_allclose(two, one, atol=SUM)


def test_totals_are_the_sums_of_the_whole_maps():
    totals = evidence_maps(CAMERAS, MAPS).totals
    np.testing.assert_allclose(totals, [plane.sum(dtype=float) for plane in MAPS], atol=SUM)


@pytest.mark.parametrize(
    "kinds", [["ellipsoid"] * 6, ["box"] * 4, ["ellipsoid", "box", "mesh", "slab"]], ids=lambda k: k[0]
)
def test_segments_that_cover_first_leave_the_others_what_the_whole_body_covers_beyond_them(kinds):
    model = random_body(kinds, np.random.default_rng(3))
    surface, (R, t), maps = surface_arrays(model), batch(model, 6, 4), evidence_maps(CAMERAS, MAPS)
    is_first = np.arange(len(model.segments)) % 2 == 0
    first, others = surface_of_segments(surface, is_first), surface_of_segments(surface, ~is_first)
    left = mask_out_surface(first, maps, R[0], t[0])
    np.testing.assert_allclose(left.totals, maps.totals - mask_evidence(first, maps, R[:1], t[:1])[0], atol=SUM)
    R[:, is_first], t[:, is_first] = R[0, is_first], t[0, is_first]
    beyond = mask_evidence(others, left, R, t)
    assert np.abs(beyond).max() > 10
    whole = mask_evidence(surface, maps, R, t)
    np.testing.assert_allclose(mask_evidence(first, maps, R, t) + beyond, whole, atol=SUM)
