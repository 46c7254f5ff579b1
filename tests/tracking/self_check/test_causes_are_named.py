"""A wrong body, camera or clock is named with its size; a run with nothing wrong raises no alarm."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose
from airborne.cameras import Rig
from airborne.tracking.self_check.causes import LikelyCause, name_causes
from airborne.tracking.self_check.check import doubts, gather_equations, self_check
from airborne.tracking.self_check.nuisances import (
    ONE_CAMERA_SD,
    n_parameters,
    nuisances_of,
    prior_covariance,
)
from airborne.tracking.self_check.path import TrackedPath
from airborne.tracking.self_check.solution import NuisanceSolution
from airborne.video import Frames, View
from tests.support.scenes import CAMERAS, CROSS, FPS, Scene, rigid_body


def flung(time_s):
    """Fast enough that the scene behind the body is seen."""
    t = float(time_s)
    place = np.array([-1.0, -0.2, 1.2]) + np.array([4.4, 1.0, 2.2]) * t - 0.5 * np.array([0, 0, 9.81]) * t**2
    turn = Rotation.from_rotvec(np.array([3.5, 1.0, 3.4]) * t) * Rotation.from_euler("xyz", [0.4, 0.3, 0.9])
    return Pose(world_from_root=RigidTransform.from_components(place, turn))


SCENE = Scene(motion=flung, cameras=CAMERAS[:3])
INDICES = range(24)


@cache
def frames_seen():
    """The pictures of all instants."""
    return [SCENE.frames(index) for index in INDICES]


def seen_by(rig: Rig, frames: Frames) -> Frames:
    """The same pictures, by cameras that the files have elsewhere."""
    views = [View(camera, view.image) for camera, view in zip(rig, frames.views, strict=True) if view is not None]
    return replace(frames, views=tuple(views))


RIG = Rig(SCENE.cameras)


@cache
def checked(*, rig=RIG, model=CROSS, late_s=0.0, rate=1.0):
    """Check true poses against the pictures, with wrong files; `late_s` and `rate` of what the second camera shows."""
    frames = frames_seen()
    if rate != 1:
        other = Scene(motion=lambda time_s: flung(rate * float(time_s)), cameras=SCENE.cameras[1:2])
        frames = [replace(now, views=(now.views[0], other.frames(now.index).views[0], now.views[2])) for now in frames]
    if late_s:
        shift = round(late_s * FPS)
        frames = [
            replace(now, views=(now.views[0], later.views[1], now.views[2]))
            for now, later in zip(frames, frames[shift:], strict=False)
        ]
    frames = [seen_by(rig, each) for each in frames]
    poses = [SCENE.start(each.index) for each in frames]
    times = np.array([float(each.time_s) for each in frames])
    own = np.tile(np.diag([1e-3] * 3 + [2e-3] * 3) ** 2, (len(frames), 1, 1))
    path = TrackedPath(np.array([each.index for each in frames]), times, poses, own)
    run = gather_equations(model, rig, path, frames, body_sd=0.01)
    assert run is not None
    return self_check(run, model, rig, path)


@cache
def checked_alone(factor):
    """Check what one camera sees of a body whose file is larger by a factor: it is as much further away."""
    camera = SCENE.cameras[0]
    frames = [replace(each, views=each.views[:1]) for each in frames_seen()]
    times = np.array([float(each.time_s) for each in frames])
    poses, covariances = [], []
    for each in frames:
        true = SCENE.start(each.index).world_from_root
        away = factor * (true.translation - camera.centre)
        place = RigidTransform.from_components(camera.centre + away, true.rotation)
        poses.append(Pose(world_from_root=place))
        along = away / np.linalg.norm(away)
        covariances.append(np.diag([1e-3] * 3 + [2e-3] * 3) ** 2)
        covariances[-1][:3, :3] += 0.02**2 * np.outer(along, along)
    path = TrackedPath(np.array([each.index for each in frames]), times, poses, np.array(covariances))
    rig = Rig((camera,))
    run = gather_equations(larger(factor), rig, path, frames, body_sd=ONE_CAMERA_SD)
    assert run is not None
    return self_check(run, larger(factor), rig, path), path.positions - camera.centre


def turned(degrees):
    turn = Rotation.from_rotvec([0, np.radians(degrees), 0])
    places = [RigidTransform.from_rotation(turn) * c.camera_from_world for c in SCENE.cameras]
    return Rig((SCENE.cameras[0], replace(SCENE.cameras[1], camera_from_world=places[1]), SCENE.cameras[2]))


def zoomed(factor):
    second = SCENE.cameras[1]
    return Rig((SCENE.cameras[0], replace(second, K=second.K @ np.diag([factor, factor, 1])), SCENE.cameras[2]))


def larger(factor):
    parts = []
    for part in CROSS.parts:
        size = "size_m" if hasattr(part.shape, "size_m") else "semi_axes_m"
        shape = replace(part.shape, **{size: factor * getattr(part.shape, size)})
        at = RigidTransform.from_components(
            factor * part.segment_from_part.translation, part.segment_from_part.rotation
        )
        parts.append(replace(part, shape=shape, segment_from_part=at))
    return rigid_body(*parts)


LARGER = larger(1.06)


def test_nothing_wrong_raises_no_alarm():
    assert not checked().diagnosis.has_alarm


@pytest.mark.parametrize(
    ("wrong", "subject", "kind", "value"),
    [
        ({"model": LARGER}, "body", "scale", 1 / 1.06 - 1),
        ({"rig": turned(1.5)}, "cam1", "turn_deg", 1.5),
        ({"rig": zoomed(1.06)}, "cam1", "focal", 1 / 1.06 - 1),
        ({"late_s": 0.02}, "cam1", "time_s", 0.02),
    ],
)
def test_what_is_wrong_is_named_first_with_its_size(wrong, subject, kind, value):
    first = checked(**wrong).diagnosis.findings[0]
    assert first.is_alarm
    assert (first.subject, first.kind) == (subject, kind)
    assert abs(first.value - value) < 2.5 * first.sd < 0.5 * abs(value)
    assert first.sentence.endswith(f"`offset_s` should be {first.value:.4f} s larger)") == (kind == "time_s")


def test_of_an_early_camera_a_smaller_offset_is_asked_for():
    early = LikelyCause("cam2", "time_s", -0.0204, 0.0034, is_alarm=True)
    assert early.sentence == "camera cam2 seems 20.4 ± 3.4 ms early (its `offset_s` should be 0.0204 s smaller)"
    assert replace(early, is_alarm=False).sentence == "camera cam2 seems 20.4 ± 3.4 ms early"


@pytest.mark.parametrize("rate", [1.05, 0.8])
def test_a_wrong_frame_rate_is_named_as_lateness_that_grows(rate):
    first = checked(rate=rate).diagnosis.findings[0]
    over_the_run_s = (rate - 1) * (len(INDICES) - 1) / FPS
    assert first.is_alarm and (first.subject, first.kind) == ("cam1", "drift_s")
    assert abs(first.value - over_the_run_s) < 4 * first.sd < 1.5 * abs(over_the_run_s)
    assert ("later and later" in first.sentence) == (rate > 1) and "frame rate" in first.sentence


def test_intervals_widen_by_what_is_wrong():
    right, wrong = checked(), checked(model=LARGER)
    assert np.all(np.diagonal(wrong.added, axis1=1, axis2=2)[:, :3] >= 0)
    assert np.trace(wrong.constant.mean(axis=0)[:3, :3]) > np.trace(right.constant.mean(axis=0)[:3, :3])


def test_a_mask_that_shrinks_over_an_unchanged_picture_is_doubtful():
    start = SCENE.start(0)
    still = [replace(frames_seen()[0], index=i) for i in range(8)]
    far = [start.move(0.5 * i * np.array([0.0, 1.0, 0.0]), np.zeros(3)) for i in range(8)]
    path = TrackedPath(np.arange(8), np.arange(8) / FPS, far, np.zeros((8, 6, 6)))
    seen = [replace(f, views=f.views[:1]) for f in still]
    found = doubts(CROSS, path, seen, 0, None)
    stayed = next(iter(found.values()))
    assert stayed[4:].all() and not stayed[0]


def test_a_start_that_was_set_beside_the_body_is_not_held_against_it():
    """What the body covered is told by its first tracked pose, here that of the second frame."""
    poses = [SCENE.start(i) for i in INDICES]
    path = TrackedPath(np.arange(1, 24), np.arange(1, 24) / FPS, poses[1:], np.zeros((23, 6, 6)))
    frames = frames_seen()
    assert not any(each.any() for each in doubts(CROSS, path, frames, 0, None).values())


def test_a_body_that_really_leaves_is_not_doubtful():
    poses = [SCENE.start(i) for i in INDICES]
    path = TrackedPath(np.arange(24), np.arange(24) / FPS, poses, np.zeros((24, 6, 6)))
    frames = frames_seen()
    assert not any(each.any() for each in doubts(CROSS, path, frames, 0, None).values())


@pytest.mark.parametrize(("value", "is_named"), [(0.0235, True), (-0.0235, True), (0.01, False)])
def test_a_size_is_named_where_it_is_larger_than_three_of_its_deviations(value, is_named):
    """A size measured to 0.4 % that a usual error of 1 % could explain."""
    none = np.zeros((n_parameters(RIG), n_parameters(RIG)))
    row = np.eye(len(none))[0]
    nothing = NuisanceSolution(none, none[0], 0.0)
    measured = replace(nothing, without=[nothing] * 4).with_row(row, value, 0.004)
    prior = prior_covariance(RIG, 0.01, is_person=False)
    first = name_causes(measured, nuisances_of(RIG), prior).findings[0]
    assert (first.subject, first.kind, first.is_alarm) == ("body", "scale", is_named)
    assert (abs(first.value) > 3 * first.sd) == is_named


@pytest.mark.parametrize("factor", [0.9, 1.0, 1.1])
def test_of_one_camera_the_fall_tells_the_size_of_the_body(factor):
    alarms = [finding for finding in checked_alone(factor)[0].diagnosis.findings if finding.is_alarm]
    assert [(each.subject, each.kind) for each in alarms] == ([] if factor == 1 else [("body", "scale")])
    assert all(abs(each.value - (1 / factor - 1)) < 2 * each.sd for each in alarms)


@pytest.mark.parametrize("factor", [0.9, 0.97, 1.03, 1.1])
def test_deviations_of_one_cameras_distances_hold_a_wrong_size_named_or_not(factor):
    """A body that is larger in its file is taken to be as much further away."""
    found, from_camera = checked_alone(factor)
    distance = np.linalg.norm(from_camera, axis=1)
    along = (from_camera / distance[:, None])[found.index]
    sd = np.sqrt(np.einsum("ni,nij,nj->n", along, found.added[:, :3, :3], along))
    assert np.all(sd > abs(1 - 1 / factor) * distance[found.index] / 2)
