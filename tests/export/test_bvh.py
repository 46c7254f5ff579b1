"""BVH files: a reader that follows the hierarchy finds every joint where it was."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airborne.body import BodyModel
from airborne.export.bvh import write_bvh
from airborne.export.takes import player_takes
from tests.support.export_scenes import BOX, PERSON
from tests.support.takes import jumping, take_of, tumbling

TO_WORLD = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
WRITTEN_M = 1e-6


def read(path):
    """Follow the hierarchy: joints' places (n, joints, 3) in our world [m] by name, ends too, and the frame time."""
    words = path.read_text().split()
    k, stack, joints = 1, [], []
    while words[k] != "MOTION":
        word = words[k]
        if word in ("ROOT", "JOINT", "End"):
            joints.append({"name": words[k + 1], "parent": stack[-1] if stack else None, "channels": []})
            k += 2
        elif word == "{":
            stack.append(len(joints) - 1)
            k += 1
        elif word == "}":
            stack.pop()
            k += 1
        elif word == "OFFSET":
            joints[-1]["offset"] = np.array(words[k + 1 : k + 4], float)
            k += 4
        else:
            assert word == "CHANNELS"
            n = int(words[k + 1])
            joints[-1]["channels"] = words[k + 2 : k + 2 + n]
            k += 2 + n
    assert stack == [] and words[k + 1] == "Frames:"
    n_frames, period_s = int(words[k + 2]), float(words[k + 5])
    values = np.array(words[k + 6 :], float).reshape(n_frames, -1)
    positions = {}
    column, turns, at = 0, [], []
    for j, joint in enumerate(joints):
        above, R = joint["parent"], np.tile(np.eye(3), (n_frames, 1, 1))
        position = np.tile(joint["offset"], (n_frames, 1))
        for channel in joint["channels"]:
            axis = "XYZ".index(channel[0])
            if channel.endswith("position"):
                position[:, axis] += values[:, column]
            else:
                R = R @ Rotation.from_euler(channel[0], values[:, [column]], degrees=True).as_matrix()
            column += 1
        turns.append(R if above is None else turns[above] @ R)
        at.append(position if above is None else at[above] + np.einsum("nij,nj->ni", turns[above], position))
        name = joint["name"] if joint["channels"] else f"end of {joints[above]['name']}"
        positions[name] = at[j] @ TO_WORLD.T / 100
    assert column == values.shape[1]
    return positions, period_s


def shuffle(model):
    """The same body, its segments in another order, each still after its parent."""
    order = sorted(range(len(model.segments)), key=lambda k: depth(model, k))
    return BodyModel(model.name, tuple(model.segments[k] for k in order), model.landmarks)


def depth(model, k):
    return 0 if model.parents[k] < 0 else 1 + depth(model, model.parents[k])


@pytest.mark.parametrize("model", [PERSON, shuffle(PERSON), BOX], ids=["person", "another order", "box"])
def test_every_joint_keeps_its_position(model, tmp_path):
    motion = tumbling(6, model=model)
    (path,) = write_bvh(tmp_path / "run.bvh", take_of(motion, model))
    positions, period_s = read(path)
    assert period_s == 1001 / 60000
    for row in range(6):
        body = model.with_pose(motion.pose(row))
        for segment, t in zip(model.segments, body.t, strict=True):
            np.testing.assert_allclose(positions[segment.name][row], t, atol=WRITTEN_M)


def test_players_joints_keep_their_positions(tmp_path):
    motion = jumping(6)
    (path,) = write_bvh(tmp_path / "seven.bvh", player_takes(motion)[1])
    positions, _ = read(path)
    result = {"hip_left": "thigh_left", "knee_right": "shank_right", "ankle_left": "foot_left"}
    result |= {"foot_left": "end of foot_left"}
    for joint, name in result.items():
        np.testing.assert_allclose(positions[name], motion.points[:, 1, motion.joints.index(joint)], atol=WRITTEN_M)


def test_angles_never_jump_in_a_triple_somersault(tmp_path):
    (path,) = write_bvh(tmp_path / "run.bvh", take_of(tumbling(60, turns=3.0), PERSON))
    rows = path.read_text().partition("Frame Time")[2].splitlines()[1:]
    values = np.array([row.split() for row in rows], float)
    assert np.abs(np.diff(values[:, 3:], axis=0)).max() < 60
    assert values[-1, 3] > 1000


def test_a_gap_ends_a_file(tmp_path):
    take = take_of(tumbling(9, lost=(3, 4)), PERSON)
    paths = write_bvh(tmp_path / "run.bvh", take)
    assert [path.name for path in paths] == ["run_part1.bvh", "run_part2.bvh"]
    assert [re.search(r"Frames: (\d+)", path.read_text())[1] for path in paths] == ["3", "4"]
    assert all("nan" not in path.read_text() for path in paths)
    assert write_bvh(tmp_path / "none.bvh", take_of(tumbling(2, lost=(0, 1)), PERSON)) == []


def test_a_last_segment_without_a_landmark_ends_in_its_middle(tmp_path):
    bare = replace(PERSON, landmarks=tuple(mark for mark in PERSON.landmarks if mark.name != "hand_left"))
    motion = tumbling(2)
    (path,) = write_bvh(tmp_path / "run.bvh", take_of(motion, bare))
    positions, _ = read(path)
    body = bare.with_pose(motion.pose(1))
    hand = bare.index_of("hand_left")
    middle = body.R[hand] @ bare.segments[hand].parts[0].segment_from_part.translation + body.t[hand]
    np.testing.assert_allclose(positions["end of hand_left"][1], middle, atol=WRITTEN_M)
