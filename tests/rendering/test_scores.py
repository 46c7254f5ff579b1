import numpy as np
import pytest

from airborne.body import PosedBody, SurfaceArrays, surface_arrays
from airborne.rendering import (
    FLAT,
    RULES,
    ScoreRule,
    colour_sums,
    mask_evidence,
    pack_targets,
    render,
    score,
    scores_from_sums,
)
from airborne.rendering.reduction import reduce_camera, reduce_image
from airborne.rendering.scores import GAINS, MISSED_GREY
from airborne.video import View
from tests.support.bodies import LIGHTS, batch, camera, noise_view, posed_random, random_body
from tests.support.ray_casting import render_reference
from tests.support.tolerances import SOLVED

GREY = 1e-2  # grey levels between float32 kernels and float64 rays
CAMERAS = [camera("a"), camera("b", turn=2.0, size=(77, 90), skew=2.0)]
VIEWS = [noise_view(c, i) for i, c in enumerate(CAMERAS)]
MIXTURE = ["ellipsoid", "box", "mesh", "ellipsoid", "box"]


def pixels(shapes: SurfaceArrays, posed: PosedBody, views=VIEWS, lights=LIGHTS):
    """What each view shows inside the body's mask, and the model there: pairs of (pixels, 3)."""
    pairs = []
    for view in views:
        cast = render_reference(shapes, posed, view.camera, lights)
        pairs.append((view.rgb[cast.mask].astype(float), cast.colour[cast.mask], shapes.colours[cast.part[cast.mask]]))
    return pairs


def chroma(rgb):
    return 255 * rgb / rgb.sum(axis=1, keepdims=True)


def one(shapes, posed, rule=RULES["raw"], views=VIEWS, lights=LIGHTS, **options):
    return score(shapes, pack_targets(views, lights, **options), posed.R[None], posed.t[None], rule=rule)[0]


@pytest.mark.parametrize("kinds", [["ellipsoid"] * 5, ["box"] * 3, ["mesh"] * 3, MIXTURE], ids=lambda k: k[0])
@pytest.mark.parametrize("seed", range(3))
def test_raw_score_is_the_rms_over_the_mask_by_rays(kinds, seed):
    shapes, posed = posed_random(kinds, seed)
    observed, model, _ = (np.concatenate(column) for column in zip(*pixels(shapes, posed), strict=True))
    assert one(shapes, posed) == pytest.approx(np.sqrt(np.mean((observed - model) ** 2)), abs=GREY)


@pytest.mark.parametrize("seed", range(3))
def test_normalised_score_is_the_rms_of_chromaticities_of_pixels_that_are_not_dark(seed):
    shapes, posed = posed_random(MIXTURE, seed)
    observed, _, colour = (np.concatenate(column) for column in zip(*pixels(shapes, posed), strict=True))
    bright = (observed.sum(axis=1) >= 30) & (colour.sum(axis=1) >= 30)
    assert not bright.all()
    expected = np.sqrt(np.mean((chroma(observed[bright]) - chroma(colour[bright])) ** 2))
    assert one(shapes, posed, RULES["normalised"]) == pytest.approx(expected, abs=GREY)


def test_normalised_score_does_not_depend_on_brightness():
    shapes, posed = posed_random(MIXTURE, 1)
    dim = [View(v.camera, (v.rgb // 10 * 4 + 12).astype(np.uint8)) for v in VIEWS]
    bright = [View(v.camera, 2 * v.rgb) for v in dim]
    rule = RULES["normalised"]
    assert one(shapes, posed, rule, dim) == pytest.approx(one(shapes, posed, rule, bright), abs=GREY)
    assert one(shapes, posed, rule, dim, LIGHTS) == one(shapes, posed, rule, dim, FLAT)
    assert one(shapes, posed, RULES["raw"], dim) != pytest.approx(one(shapes, posed, RULES["raw"], bright), abs=1)


def test_blend_is_the_weighted_sum_of_both():
    shapes, posed = posed_random(MIXTURE, 2)
    raw, normalised = one(shapes, posed), one(shapes, posed, RULES["normalised"])
    assert one(shapes, posed, ScoreRule(normalised=0.3)) == pytest.approx(0.7 * raw + 0.3 * normalised, rel=SOLVED)


def test_pooling_by_views_weighs_each_view_the_same():
    shapes, posed = posed_random(MIXTURE, 4)
    per_view = [np.sqrt(np.mean((observed - model) ** 2)) for observed, model, _ in pixels(shapes, posed)]
    assert abs(per_view[0] - per_view[1]) > 1
    assert one(shapes, posed, ScoreRule(pool="views")) == pytest.approx(np.mean(per_view), abs=GREY)


def test_fitted_gain_is_the_least_squares_gain_of_each_view_within_its_bounds():
    shapes, posed = posed_random(MIXTURE, 5)
    errors, count = 0.0, 0
    for observed, model, _ in pixels(shapes, posed):
        gain = np.linalg.lstsq(model.reshape(-1, 1), observed.ravel(), rcond=None)[0][0]
        gain = np.clip(gain, *GAINS)
        errors, count = errors + np.sum((observed - gain * model) ** 2), count + observed.size
    assert one(shapes, posed, ScoreRule(fits_gain=True)) == pytest.approx(np.sqrt(errors / count), abs=GREY)


def test_the_drawn_pose_scores_best_and_a_gain_corrects_its_brightness():
    shapes, posed = posed_random(MIXTURE, 6)
    views = [View(c, np.rint(render_reference(shapes, posed, c, LIGHTS).colour / 2).astype(np.uint8)) for c in CAMERAS]
    assert one(shapes, posed, ScoreRule(fits_gain=True), views) < 0.4
    assert one(shapes, posed, views=views) > 20


def test_union_adds_the_foreground_outside_the_mask():
    shapes, posed = posed_random(MIXTURE, 7)
    rng = np.random.default_rng(0)
    evidence = [rng.normal(-1, 1, v.rgb.shape[:2]) for v in VIEWS]
    errors, count = 0.0, 0
    for view, plane, (observed, model, _) in zip(VIEWS, evidence, pixels(shapes, posed), strict=True):
        missed = np.sum((plane > 0) & ~render_reference(shapes, posed, view.camera, FLAT).mask)
        assert missed > 100
        errors += np.sum((observed - model) ** 2) + 3 * missed * MISSED_GREY**2
        count += observed.size + 3 * missed
    assert one(shapes, posed, RULES["union"], evidence=evidence) == pytest.approx(np.sqrt(errors / count), abs=GREY)


def test_a_body_that_no_view_shows_scores_infinity():
    shapes, posed = posed_random(MIXTURE, 0)
    away = PosedBody(posed.model, posed.R, posed.t + 100)
    for rule in (RULES["raw"], RULES["blend"], ScoreRule(pool="views")):
        assert one(shapes, away, rule) == np.inf


def test_views_that_do_not_exist_are_left_out():
    shapes, posed = posed_random(MIXTURE, 0)
    assert one(shapes, posed, views=[None, VIEWS[1]]) == one(shapes, posed, views=[VIEWS[1]])


def test_a_batch_scores_what_its_members_score_alone():
    model = random_body(MIXTURE, np.random.default_rng(0))
    shapes, target = surface_arrays(model), pack_targets(VIEWS, LIGHTS)
    R, t = batch(model, 7, 1)
    alone = [score(shapes, target, R[i : i + 1], t[i : i + 1], rule=RULES["blend"])[0] for i in range(7)]
    assert np.array_equal(score(shapes, target, R, t, rule=RULES["blend"]), alone)


@pytest.mark.parametrize("threads", [2, 3, 20])
def test_the_number_of_threads_changes_no_bit(threads):
    model = random_body(MIXTURE, np.random.default_rng(0))
    shapes = surface_arrays(model)
    target = pack_targets(VIEWS, LIGHTS, evidence=[v.rgb[..., 0] - 128.0 for v in VIEWS])
    R, t = batch(model, 11, 2)
    rule = ScoreRule(normalised=0.5, counts_missed=True)
    assert np.array_equal(
        score(shapes, target, R, t, rule=rule), score(shapes, target, R, t, rule=rule, threads=threads)
    )
    assert target.foreground is not None
    single = mask_evidence(shapes, target.foreground, R, t)
    assert np.array_equal(single, mask_evidence(shapes, target.foreground, R, t, threads=threads))


@pytest.mark.parametrize("scale", [2, 4])
def test_a_reduced_target_is_the_reduced_image_of_its_own_camera(scale):
    shapes, posed = posed_random(MIXTURE, 3)
    small = [View(reduce_camera(v.camera, scale), reduce_image(v.rgb, scale)) for v in VIEWS]
    assert small[0].camera.size == (90 // scale, 70 // scale)
    assert one(shapes, posed, scale=scale) == pytest.approx(one(shapes, posed, views=small), abs=GREY)
    observed, model, _ = (np.concatenate(column) for column in zip(*pixels(shapes, posed, small), strict=True))
    assert one(shapes, posed, scale=scale) == pytest.approx(np.sqrt(np.mean((observed - model) ** 2)), abs=GREY)


@pytest.mark.parametrize("scale", [2, 4])
def test_a_reduced_pixel_is_centred_at_the_middle_of_the_pixels_it_averages(scale):
    image = np.arange(64 * 48, dtype=np.float32).reshape(48, 64)
    np.testing.assert_allclose(reduce_image(image, scale)[1, 2], image[scale : 2 * scale, 2 * scale : 3 * scale].mean())
    point = np.array([0.3, -0.2, 0.4])
    full, small = camera().px_from_world(point), reduce_camera(camera(), scale).px_from_world(point)
    np.testing.assert_allclose(full, scale * small + (scale - 1) / 2, rtol=SOLVED)


def test_sums_over_the_mask_count_its_pixels():
    shapes, posed = posed_random(MIXTURE, 1)
    target = pack_targets(VIEWS, LIGHTS)
    sums = colour_sums(shapes, target, posed.R[None], posed.t[None], rule=RULES["raw"])
    assert sums[0, :, 0].tolist() == [render(shapes, posed, c, FLAT).mask.sum() for c in CAMERAS]
    assert np.isfinite(scores_from_sums(sums, RULES["raw"])).all()
