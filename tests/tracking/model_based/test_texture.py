"""Patches of a skin: it is drawn as before until their colours are known; then rotation shows within the outline."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.appearance.model import Appearance
from airborne.body.model import Mesh
from airborne.body.skin import stretch_skin
from airborne.body.splitting import faces_between, split_at
from airborne.rendering.srgb import light_from_srgb
from airborne.tracking.image_regions import crop_regions
from airborne.tracking.model_based.image_evidence import linearise_evidence
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.texture import cut_patches, with_texture
from tests.support.people import HUMAN, person

PAINTED_SEGMENTS = ("chest", "head")
HALVES_SRGB = (np.array([220.0, 40.0, 40.0]), np.array([40.0, 60.0, 220.0]))  # of the subject's right and left
ALL = np.ones(len(HUMAN.segments), bool)
FRAMES = (0, 3, 6)
TURN_RAD = np.radians(8.0)
SKIN = stretch_skin(HUMAN)
assert SKIN is not None


def cut_in_half(part):
    """A part whose right side has one colour and whose left side has another."""
    mesh = part.shape
    assert isinstance(mesh, Mesh)
    mesh = split_at(mesh, mesh.vertices_m[:, 0])
    sides = [faces_between(mesh, mesh.vertices_m[:, 0], low, low + 1.0) for low in (-1.0, 0.0)]
    return tuple(
        replace(part, name=f"{part.name}_{name}", shape=side, colour=colour)
        for name, side, colour in zip(("r", "l"), sides, HALVES_SRGB, strict=True)
    )


def in_two_colours(segment):
    return replace(segment, parts=tuple(piece for part in segment.parts for piece in cut_in_half(part)))


PAINTED = replace(SKIN, segments=tuple(in_two_colours(s) if s.name in PAINTED_SEGMENTS else s for s in SKIN.segments))
SCENE = person(model=PAINTED)


@pytest.fixture(scope="module")
def appearance():
    known, body = Appearance(), RenderModel.of(SKIN)
    for index in FRAMES:
        posed = body.with_pose(SCENE.start(index))
        for region in crop_regions([posed], body.geometry, SCENE.frames(index), 32):
            mask = body.draw_parts(posed, region) >= 0
            known = known.learn_colours(region, mask).learn_background(region, mask)
    return known


@pytest.fixture(scope="module")
def patches():
    return cut_patches(RenderModel.of(SKIN))


def evidence(body, appearance, index, pose=None, shown=ALL):
    at = pose or SCENE.start(index)
    return linearise_evidence(body, at, SCENE.frames(index), appearance, model=HUMAN, shown=shown)


@pytest.fixture(scope="module")
def texture(patches, appearance):
    return with_texture(patches, [each for index in FRAMES for each in evidence(patches, appearance, index).colours])


def turned(pose, name, turn_rad):
    """The pose with a segment turned about its long axis."""
    angles = pose.joint_angles.copy()
    angles[HUMAN.index_of(name) - 1, 2] += turn_rad
    return replace(pose, joint_angles=angles)


def step_rad(found, name):
    """How far the images alone would turn a segment about its long axis."""
    column = 3 + 3 * HUMAN.index_of(name) + 2
    return found.gradient[column] / found.information[column, column]


def test_patches_cover_the_parts_that_they_are_cut_from(patches, appearance):
    whole, posed = RenderModel.of(SKIN), RenderModel.of(SKIN).with_pose(SCENE.start(0))
    for region in crop_regions([posed], whole.geometry, SCENE.frames(0), 32, appearance):
        part, patch = whole.draw_parts(posed, region), patches.draw_parts(posed, region)
        np.testing.assert_array_equal(np.where(patch >= 0, patches.cloth[patch], -1), part)
    assert len(patches.albedo) > 10 * len(whole.albedo)


def test_colours_are_those_of_the_clothes(texture, patches):
    """Of each segment's patches, by the side that their middle lies on; those across the border are mixed."""
    flat, true = texture.geometry, light_from_srgb(np.array(HALVES_SRGB))
    middle_m = np.add.reduceat(flat.corners, flat.start[:-1])[:, 0] / np.diff(flat.start)
    for name in PAINTED_SEGMENTS:
        of_segment = flat.polygon_segment == HUMAN.index_of(name)
        for side, (sign, colour) in enumerate(zip((-1, 1), true, strict=True)):
            own = np.unique(flat.polygon_part[of_segment & (sign * middle_m > 0.04)])
            learned = texture.albedo[own][(texture.albedo[own] != patches.albedo[own]).any(axis=1)]
            assert len(learned) > 4
            nearer = np.linalg.norm(learned - colour, axis=1) < np.linalg.norm(learned - true[1 - side], axis=1)
            assert nearer.mean() > 0.9


def test_rotation_within_the_outline_shows_once_the_colours_are_known(texture, patches, appearance):
    """Of a head turned to either side a step goes back toward the truth; in one colour it knows no side."""
    index = FRAMES[1]
    steps = {
        sign: [
            step_rad(evidence(body, appearance, index, turned(SCENE.start(index), "head", sign * TURN_RAD)), "head")
            for body in (patches, texture)
        ]
        for sign in (-1, 1)
    }
    (plain_right, right), (plain_left, left) = steps[-1], steps[1]
    assert 0.4 * TURN_RAD < right < 1.2 * TURN_RAD
    assert 0.4 * TURN_RAD < -left < 1.2 * TURN_RAD
    assert abs(plain_right - plain_left) < 0.4 * (right - left)


def test_segments_that_may_lie_elsewhere_show_no_colour(patches, appearance):
    shown = ALL.copy()
    shown[HUMAN.index_of("chest")] = False
    of_chest = patches.segment_of_part == HUMAN.index_of("chest")
    for colours in evidence(patches, appearance, FRAMES[0], shown=shown).colours:
        assert np.isnan(colours[of_chest]).all()
        assert np.isfinite(colours[~of_chest]).any()


def test_patch_that_few_images_show_keeps_its_colour(patches):
    seen = np.full((2, *patches.albedo.shape), 0.5, np.float32)
    np.testing.assert_array_equal(with_texture(patches, list(seen)).albedo, patches.albedo)
    np.testing.assert_array_equal(with_texture(patches, []).albedo, patches.albedo)
    assert np.allclose(with_texture(patches, [*seen, seen[0]]).albedo, 0.5)


def test_shading_does_not_turn_with_a_cloth_of_one_colour(patches, appearance):
    """Patches in the colour of their part leave the equations of that part, but for how mixed pixels count."""
    index = FRAMES[0]
    whole, cut = (evidence(body, appearance, index) for body in (RenderModel.of(SKIN), patches))
    scale = np.sqrt(np.diag(whole.information))
    np.testing.assert_allclose(
        cut.information / np.outer(scale, scale), whole.information / np.outer(scale, scale), atol=0.06
    )
