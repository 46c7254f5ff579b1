"""What a person wears: colours on ellipsoids, cut where a border crosses."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.body import ATHLETE, SAMPLED, human18
from airborne.body.outfits import Border, ellipsoid_of, extent_m, with_borders
from airborne.errors import BodyError
from tests.support.tolerances import EXACT


def parts_of(model, segment):
    return model.segments[model.index_of(segment)].parts


def height(part, z):
    """A height along the part's own z, in the segment's axes."""
    return part.segment_from_part.apply([0, 0, z])


def test_every_outfit_has_one_ellipsoid_a_segment():
    plain = human18(outfit=SAMPLED)
    for outfit in (ATHLETE, replace(ATHLETE, shorts_share=1.0, sleeve_share=0.1)):
        for ours, theirs in zip(human18(outfit=outfit).segments, plain.segments, strict=True):
            for part in ours.parts:
                place, shape = part.segment_from_part, part.shape.semi_axes_m
                other = theirs.parts[0]
                spread = [
                    R @ np.diag(np.square(a)) @ R.T
                    for R, a in (
                        (place.rotation.as_matrix(), shape),
                        (other.segment_from_part.rotation.as_matrix(), other.shape.semi_axes_m),
                    )
                ]
                np.testing.assert_allclose(spread[0], spread[1], atol=EXACT)
                np.testing.assert_allclose(place.translation, other.segment_from_part.translation, atol=EXACT)


def test_two_parts_of_a_segment_meet_at_one_border_and_cover_all_of_it():
    cut = [segment.parts for segment in human18().segments if len(segment.parts) == 2]
    assert len(cut) == 1 + 2 + 2 + 2  # head, upper arms, thighs, shanks
    for below, above in cut:
        assert below.slab_m[0] == -np.inf
        assert below.slab_m[1] == above.slab_m[0]
        assert above.slab_m[1] == np.inf
        assert below.shape is above.shape


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_borders_lie_at_their_share_between_the_joints(share):
    model = human18(
        outfit=replace(ATHLETE, shorts_share=share, sleeve_share=share, socks_share=share, hair_share=share)
    )
    for segment, child in (("thigh_left", "shank_left"), ("upper_arm_right", "forearm_right")):
        length = -model.segments[model.index_of(child)].joint_m[2]
        part = parts_of(model, segment)[1]
        np.testing.assert_allclose(height(part, part.slab_m[0])[2], -share * length, atol=EXACT)
    length = -model.segments[model.index_of("foot_left")].joint_m[2]
    sock = parts_of(model, "shank_left")[0]
    np.testing.assert_allclose(height(sock, sock.slab_m[1])[2], (share - 1) * length, atol=EXACT)
    hair = parts_of(model, "head")[1]
    half_depth = hair.shape.semi_axes_m[2]
    np.testing.assert_allclose(height(hair, hair.slab_m[0])[1], half_depth * (1 - 2 * share), atol=EXACT)
    assert height(hair, half_depth)[1] > 0, "hair is at the back"


def test_the_athlete_wears_shirt_shorts_socks_and_shoes():
    colour = {part.name: tuple(part.colour) for part in human18().parts}
    assert colour["chest"] == colour["torso"] == colour["shoulder_left"] == colour["upper_arm_left_sleeve"]
    assert colour["pelvis"] == colour["thigh_right_shorts"]
    skins = ["hand_left", "forearm_right", "upper_arm_left_skin", "thigh_left_skin", "shank_right_skin", "head_face"]
    assert len({colour[name] for name in skins}) == 1
    worn = {colour[n] for n in ("chest", "pelvis", "hand_left", "foot_left", "shank_left_sock", "head_hair")}
    assert len(worn) == 6
    assert all(np.linalg.norm(np.subtract(a, b)) > 60 for a in worn for b in worn if a != b), "told apart"


def test_a_sampled_person_has_no_colours_and_one_border_on_each_thigh():
    model = human18(outfit=SAMPLED)
    assert all(part.colour is None for part in model.parts)
    assert [part.name for part in model.parts if part.slab_m != (-np.inf, np.inf)] == [
        f"thigh_{side}_{cover}" for side in ("left", "right") for cover in ("skin", "shorts")
    ]
    longer = human18(outfit=replace(SAMPLED, shorts_share=0.8))
    assert parts_of(longer, "thigh_left")[0].slab_m[1] < parts_of(model, "thigh_left")[0].slab_m[1]


@pytest.mark.parametrize(("share", "cover"), [(0.0, "skin"), (1.0, "shirt")])
def test_a_border_at_an_end_leaves_one_part(share, cover):
    (arm,) = parts_of(human18(outfit=replace(ATHLETE, sleeve_share=share)), "upper_arm_left")
    assert tuple(arm.colour) == getattr(ATHLETE, cover)
    assert arm.name == "upper_arm_left"


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_a_share_beyond_the_segment_is_refused(share):
    with pytest.raises(BodyError, match=r"socks_share is .*; expected 0 to 1"):
        replace(ATHLETE, socks_share=share)


def test_a_border_put_where_the_outfit_has_it_changes_nothing():
    body = human18(outfit=ATHLETE)
    shares = {"thigh": 0.5, "upper_arm": 0.5, "shank": 0.7}  # all from the upper joint
    again = with_borders(body, {name: Border(share) for name, share in shares.items()})
    for ours, theirs in zip(again.parts, body.parts, strict=True):
        assert ours.name == theirs.name
        np.testing.assert_allclose(ours.slab_m, theirs.slab_m, atol=EXACT)
        np.testing.assert_array_equal(ours.colour, theirs.colour)
        np.testing.assert_allclose(ours.shape.semi_axes_m, theirs.shape.semi_axes_m, atol=EXACT)


@pytest.mark.parametrize("segment", ["pelvis", "head", "thigh_left", "shoulder_right", "foot_left"])
@pytest.mark.parametrize("axis", [None, 0, 1, 2])
def test_a_border_cuts_any_segment_across_any_axis_at_its_share(segment, axis):
    body = human18(outfit=SAMPLED)
    cut = with_borders(body, {segment: Border(0.3, axis)})
    low, high = parts_of(cut, segment)
    start, end = extent_m(cut, segment, axis)
    assert low.slab_m[1] == high.slab_m[0]
    at = height(low, low.slab_m[1])
    assert np.isclose(at, start + 0.3 * (end - start), atol=EXACT).any()
    for ours, theirs in zip(ellipsoid_of(cut, segment), ellipsoid_of(body, segment), strict=True):
        np.testing.assert_allclose(getattr(ours, "semi_axes_m", ours), getattr(theirs, "semi_axes_m", theirs))


def test_a_segment_without_a_border_is_whole_again():
    body = with_borders(human18(outfit=ATHLETE), {"thigh": None, "head": None})
    for name in ("thigh_left", "thigh_right", "head"):
        (part,) = parts_of(body, name)
        assert part.name == name
        assert part.slab_m == (-np.inf, np.inf)


@pytest.mark.parametrize("share", [0.0, 1.0, -0.2, np.nan])
def test_a_border_beyond_its_segment_is_refused(share):
    with pytest.raises(BodyError, match="share"):
        with_borders(human18(), {"thigh": Border(share)})


def test_a_border_of_an_unknown_segment_is_refused():
    with pytest.raises(BodyError, match="no segment 'tail'"):
        with_borders(human18(), {"tail": Border(0.5)})
