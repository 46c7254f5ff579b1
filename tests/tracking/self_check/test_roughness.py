"""A path that is rougher than its stated errors tells by how much; a smooth one and a fast one tell nothing."""

import numpy as np
import pytest

from airborne.tracking.self_check.path import TrackedPath
from airborne.tracking.self_check.roughness import find_wrong_path, measure_roughness
from tests.support.thrown_paths import POSITION_SD_M, N, thrown_path

EVERY = np.ones(N, bool)


@pytest.mark.parametrize(("position", "rotation"), [(1, 1), (3, 1), (1, 5), (8, 8)])
def test_the_factor_is_that_of_the_errors(position, rotation):
    found = np.mean(
        [measure_roughness(thrown_path(position, rotation, seed=seed), EVERY) for seed in range(10)], axis=0
    )
    assert found == pytest.approx([position, rotation], rel=0.25)


def test_a_path_that_is_smoother_than_stated_leaves_the_errors_as_they_are():
    assert measure_roughness(thrown_path(0.0, 0.2), EVERY).tolist() == [1, 1]


def test_errors_that_alternate_between_fields_are_seen():
    smooth = thrown_path(0.0, 0.0)
    shift_m, none = 5 * POSITION_SD_M * np.array([0.0, 0.0, 1.0]), np.zeros(3)
    poses = [pose.move(shift_m * (i % 2), none) for i, pose in enumerate(smooth.poses)]
    position, rotation = measure_roughness(TrackedPath(smooth.index, smooth.time_s, poses, smooth.covariance), EVERY)
    assert position > 2 and rotation == 1


@pytest.mark.parametrize("given", ["gaps", "untracked", "unknown", "few"])
def test_where_nothing_can_be_compared_nothing_is_multiplied(given):
    rough = thrown_path(5.0, 5.0, every=2 if given == "gaps" else 1, is_known=given != "unknown")
    tracked = EVERY if given != "untracked" else np.arange(N) % 4 > 0
    if given == "few":
        rough = TrackedPath(rough.index[:6], rough.time_s[:6], rough.poses[:6], rough.covariance[:6])
        tracked = EVERY[:6]
    assert measure_roughness(rough, tracked).tolist() == [1, 1]


def repeated(every, smooth):
    """The path with one of so many poses repeated, at the next one's time."""
    poses = [smooth.poses[i - 1 if i % every == 1 else i] for i in range(N)]
    return TrackedPath(smooth.index, smooth.time_s, poses, smooth.covariance)


@pytest.mark.parametrize(("every", "share"), [(2, 0.5), (5, 0.2)])
def test_repeated_pictures_are_named_with_their_share(every, share):
    found = find_wrong_path(repeated(every, thrown_path(0.1, 0.1)), np.ones(2))
    assert found is not None and found.kind == "repeated" and found.to_dict()["is_alarm"]
    assert found.value == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("n_lost", [1, 2, 5])
def test_images_lost_in_all_cameras_are_named_with_their_frame_and_time(n_lost):
    smooth = thrown_path(0.1, 0.1)
    poses = [*smooth.poses[:20], *smooth.poses[20 + n_lost :]]
    n = len(poses)
    found = find_wrong_path(TrackedPath(smooth.index[:n], smooth.time_s[:n], poses, smooth.covariance[:n]), np.ones(2))
    assert found is not None and found.kind == "lost"
    assert found.value == pytest.approx(n_lost * (smooth.time_s[1] - smooth.time_s[0]))
    assert found.sentence.startswith(f"from frame 19 to the next the body moves and turns as in {n_lost + 1} frames")


def test_of_frames_that_are_known_to_be_lost_nothing_is_said():
    smooth = thrown_path(0.1, 0.1)
    rows = np.array([i for i in range(N) if i not in (20, 21)])
    poses = [smooth.poses[i] for i in rows]
    assert (
        find_wrong_path(
            TrackedPath(smooth.index[rows], smooth.time_s[rows], poses, smooth.covariance[rows]), np.ones(2)
        )
        is None
    )


def test_a_thing_that_rests_or_bounces_repeats_nothing():
    smooth = thrown_path(0.1, 0.1)
    times, covariance = (smooth.index, smooth.time_s), smooth.covariance
    rests = TrackedPath(*times, [smooth.poses[max(i - 30, 0)] for i in range(N)], covariance)
    bounces = TrackedPath(*times, [smooth.poses[abs(i - 30)] for i in range(N)], covariance)
    assert find_wrong_path(rests, np.ones(2)) is None and find_wrong_path(bounces, np.ones(2)) is None
    assert find_wrong_path(smooth, np.ones(2)) is None


def test_a_far_too_rough_path_is_an_alarm():
    found = find_wrong_path(thrown_path(0.1, 0.1), np.array([2.0, 6.0]))
    assert found is not None and "rotations 6.0 times" in found.sentence
    assert find_wrong_path(thrown_path(0.1, 0.1), np.array([3.3, 1.0])) is None
