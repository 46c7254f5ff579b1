"""Mix-ups of videos whose start is not known are named by the silhouettes of what moves, before it is looked for."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose, human18
from airborne.body.surface import surface_arrays
from airborne.cameras import Rig, camera_looking_at
from airborne.errors import MistakesError
from airborne.rendering import FLAT, render
from airborne.run import moving_mix_ups
from airborne.run.mix_ups import possible_mix_ups
from airborne.run.moving_mix_ups import compare_silhouettes, refuse_moving_mix_ups
from airborne.tracking.first_pose.moments import Moment
from airborne.video import Frames, View

SIZE, N = (320, 240), 3  # [px], moments
PLACES = {"left": (-4.0, -3.0, 1.2), "middle": (0.5, -5.0, 2.5), "right": (4.0, -2.0, 0.8)}
RIG = Rig(tuple(camera_looking_at(n, p, (0, 0, 1.2), focal_px=300.0, size=SIZE) for n, p in PLACES.items()))
BODY = human18(1.75, 70.0)
MIX_UPS = possible_mix_ups(len(RIG))


def seen(number, camera, turned_deg=0.0):
    """What stands out in a camera while a body with bent limbs goes through the scene, turning [nats]."""
    angles = np.zeros((BODY.n_joints, 3))
    angles[[4, 9, 11], 0] = 0.8, -1.2, 0.6
    R = Rotation.from_euler("zx", [turned_deg + 40 * number, 25 * number], degrees=True)
    at = np.array([-0.3 + 0.2 * number, 0.1, 1.0 + 0.1 * number])
    posed = BODY.with_pose(Pose(world_from_root=RigidTransform.from_components(at, R), joint_angles=angles))
    return np.where(render(surface_arrays(BODY), posed, camera, FLAT).mask > 0, 3.0, -3.0).astype(np.float32)


def moments(change=lambda number, evidence: evidence):
    """Those moments, and what stands out in each of them, changed."""
    views = tuple(View(camera, np.zeros((*SIZE[::-1], 3), np.uint8)) for camera in RIG)
    return [
        Moment(
            Frames(number, Fraction(number, 5), views),
            tuple(change(number, [seen(number, camera) for camera in RIG])),
        )
        for number in range(N)
    ]


RIGHT = moments()


def mixed(mix_up):
    """The moments as they are with a mix-up, which is made as one the other way round is undone."""
    other = replace(mix_up, cameras=mix_up.cameras[::-1])
    return [replace(moment, evidence=tuple(other.undo_in(moment.evidence))) for moment in RIGHT]


def test_videos_of_their_own_cameras_show_one_body():
    found = compare_silhouettes(RIGHT)
    assert found.are_one_body
    assert found.uncovered < 0.03
    assert found.doubts == ()


@pytest.mark.parametrize("mix_up", MIX_UPS, ids=lambda mix_up: mix_up.describe(RIG.names))
def test_each_mix_up_is_named(mix_up):
    with pytest.raises(MistakesError) as refused:
        refuse_moving_mix_ups(compare_silhouettes(mixed(mix_up)))
    said = str(refused.value)
    assert mix_up.describe(RIG.names) in said
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize("odd", range(len(RIG)), ids=RIG.names)
def test_a_video_of_another_recording_is_asked_about(odd):
    def change(number, evidence):
        evidence[odd] = np.roll(seen(N - number, list(RIG)[odd], turned_deg=70.0), (25, -40), axis=(0, 1))
        return evidence

    found = compare_silhouettes(moments(change))
    assert not found.are_one_body
    (doubt,) = found.doubts
    assert f"those without {RIG.names[odd]} can" in doubt


def test_pieces_of_which_each_camera_shows_another_are_not_asked_about():
    """So are the regions of somebody who hardly moves: the empty scene holds the rest of him."""

    def change(number, evidence):
        return [np.roll(each, 45 * (i - 1), axis=i % 2) for i, each in enumerate(evidence)]

    found = compare_silhouettes(moments(change))
    assert not found.are_one_body
    assert found.doubts == ()


@pytest.mark.parametrize("still", range(len(RIG)), ids=RIG.names)
def test_a_camera_in_which_nothing_moves_is_asked_about(still):
    def change(number, evidence):
        return [np.full_like(each, -3.0) if i == still else each for i, each in enumerate(evidence)]

    (doubt,) = compare_silhouettes(moments(change)).doubts
    assert f"nothing is seen to move in the video of {RIG.names[still]}" in doubt


def test_a_mix_up_that_others_explain_nearly_as_well_is_asked_about(monkeypatch):
    monkeypatch.setattr(moving_mix_ups, "_OF_MIX_UP", (1000.0, 1000.0))
    (doubt,) = compare_silhouettes(mixed(MIX_UPS[0])).doubts
    assert MIX_UPS[0].describe(RIG.names) in doubt


def test_passing_on_three_goes_before_an_exchange_only_where_it_is_clearly_another():
    exchange_of_three = [0.02, 0.3, 0.03], [0.02, 0.3]  # shares with each mix-up, and with the simple ones
    assert moving_mix_ups._clear_mix_up(*exchange_of_three, 0.3, 3.0, 2.0) == 0
    passed_on = [0.09, 0.3, 0.03], [0.09, 0.3]
    assert moving_mix_ups._clear_mix_up(*passed_on, 0.3, 3.0, 2.0) == 2


@pytest.mark.parametrize("known", [0, 1])
def test_where_fewer_than_two_cameras_see_something_whole_nothing_is_said(known):
    def change(number, evidence):
        return [each if i < known else None for i, each in enumerate(evidence)]

    found = compare_silhouettes(moments(change))
    assert np.isnan(found.uncovered)
    assert not found.are_one_body
    assert found.doubts == ()
    assert compare_silhouettes([]).doubts == ()
