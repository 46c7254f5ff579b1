"""The colours of a jumper's surfaces: in any light, and with borders that stay where the clothes end."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.cameras import Camera
from airborne.tracking.capsules.jumper import N_DOF, SHIRT, SHOE, SHORTS, SKIN, SURFACE_CLASSES
from airborne.tracking.capsules.kernel_arguments import NOBODY, Capsules
from airborne.tracking.capsules.surface_colours import (
    ClassImages,
    class_image,
    count_surfaces,
    learn_colours,
    update_colours,
)
from airborne.tracking.capsules.views import PlayerRegion
from tests.support.jumping_scenes import LENGTHS, RADII

AWAY_M, FOCAL_PX, SIDE_PX = 10.0, 2000.0, 400


def looking(y_sign):
    """A level camera 10 m before (-1) or behind (1) the origin, 1 m up."""
    to_camera = Rotation.from_matrix([[-y_sign, 0, 0], [0, 0, -1], [0, -y_sign, 0]])
    K = np.array([[FOCAL_PX, 0, SIDE_PX / 2], [0, FOCAL_PX, SIDE_PX / 2], [0, 0, 1]])
    centre = np.array([0, y_sign * AWAY_M, 1.0])
    pose = RigidTransform.from_components(-to_camera.apply(centre), to_camera)
    return Camera(name="c", K=K, size=(SIDE_PX, SIDE_PX), camera_from_world=pose)


def leaning(lean_rad):
    state = np.concatenate([np.zeros(N_DOF), LENGTHS, RADII])
    state[2], state[5] = 1.0, lean_rad
    return state


def hem_m(state, y_sign):
    """How high the lowest shirt is over the origin, on the mean of the body's inner half."""
    part = class_image(state, looking(y_sign), 1.0)[:, SIDE_PX // 2 - 15 : SIDE_PX // 2 + 16]
    lowest = SIDE_PX - 1 - np.argmax((part == SHIRT)[::-1], axis=0)
    assert np.all(np.take_along_axis(part, lowest[None] + 1, axis=0) == SHORTS)
    return (SIDE_PX / 2 - lowest.mean()) * AWAY_M / FOCAL_PX


@pytest.mark.parametrize("y_sign", [-1, 1])
def test_the_hem_of_a_shirt_is_as_high_whether_trunk_or_pelvis_is_nearer(y_sign):
    assert hem_m(leaning(0.15), y_sign) == pytest.approx(hem_m(leaning(-0.15), y_sign), abs=0.03)


def coloured(colour, n=40):
    """Learn skin of a colour before a blue background."""
    rgb = np.full((n, n, 3), (40, 60, 160), np.uint8)
    rgb[10:30, 10:30] = colour
    part = np.full((n, n), -1, np.int8)
    part[10:30, 10:30] = SKIN
    region = PlayerRegion(0, looking(1), (0, 0, n, n), rgb)
    return learn_colours(
        count_surfaces([region], [ClassImages(part, part, part)]), [0], 1, np.ones((1, len(SURFACE_CLASSES)), bool)
    )


def evidence_of(colours, colour, surface_class=SKIN):
    r, g, b = np.asarray(colour, int) >> 3
    return colours.table(0).evidence[r << 10 | g << 5 | b, surface_class]


def test_a_surface_is_recognised_in_more_and_in_less_light():
    colours = coloured((180, 140, 110))
    for light in (0.85, 1.0, 1.15):
        assert evidence_of(colours, (np.array([180, 140, 110]) * light).astype(int)) > 3
    assert evidence_of(colours, (110, 140, 180)) < 1
    assert evidence_of(colours, (90, 70, 55)) < 1


STANDING = leaning(0.0)
WORN = np.array([(160, 30, 40), (30, 30, 30), (180, 140, 110), (20, 40, 20), (230, 230, 220), (40, 60, 160)], np.uint8)
SOLE, GREEN = (90, 200, 190), np.array([(60, 200, 60)], np.uint8)


def dressed(shoe, others=NOBODY):
    """An image of a player before a blue wall, in shoes of a colour; others are green."""
    worn = np.concatenate([WORN, GREEN])
    worn[SHOE] = shoe
    classes = class_image(STANDING, looking(1), 1.0, others)
    return PlayerRegion(0, looking(1), (0, 0, SIDE_PX, SIDE_PX), worn[np.choose(classes + 1, [5, 0, 1, 2, 3, 4, 6])])


def at_first():
    region = dressed(WORN[SHOE])
    part, around = class_image(STANDING, looking(1), 0.6), class_image(STANDING, looking(1), 1.25)
    return learn_colours(
        count_surfaces([region], [ClassImages(part, part, around)]), [0], 1, np.ones((1, len(SURFACE_CLASSES)), bool)
    )


def test_shoes_are_recognised_by_their_soles_once_learned():
    colours = at_first()
    assert evidence_of(colours, SOLE, SHOE) < 1
    later = update_colours(colours, STANDING, [dressed(SOLE)], NOBODY)
    assert evidence_of(later, SOLE, SHOE) > 3
    assert evidence_of(later, WORN[SHOE], SHOE) > 3
    np.testing.assert_array_equal(later.distributions[: SKIN + 1], colours.distributions[: SKIN + 1])
    for _ in range(50):
        later = update_colours(later, STANDING, [dressed(SOLE)], NOBODY)
    assert evidence_of(later, WORN[SHOE], SHOE) > 3  # the first frame's colours are never forgotten


def test_nothing_is_learned_of_occluded_shoes():
    colours = at_first()
    colours.occlusion[0, SHOE] = 0.9
    later = update_colours(colours, STANDING, [dressed(SOLE)], NOBODY)
    np.testing.assert_array_equal(later.distributions[SHOE], colours.distributions[SHOE])


def test_nothing_is_learned_of_another_players_leg_in_front():
    feet = np.array([[[0.3, 0.5, 0.08], [-0.3, 0.5, 0.08]]])
    others = Capsules(feet, np.full((1, 2), 0.3))
    assert np.count_nonzero(dressed(WORN[SHOE], others).rgb == GREEN) > 1000
    later = update_colours(at_first(), STANDING, [dressed(WORN[SHOE], others)], others)
    assert evidence_of(later, GREEN[0], SHOE) < 1
    unaware = update_colours(at_first(), STANDING, [dressed(WORN[SHOE], others)], NOBODY)
    assert evidence_of(unaware, GREEN[0], SHOE) > 3
