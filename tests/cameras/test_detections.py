"""Detections of any known network become points by one set of names, camera by camera and frame by frame."""

import json

import numpy as np
import pytest

from airborne.cameras.detections import (
    Detections,
    camera_names,
    landmarks_from_points,
    read_detections,
    write_detections,
)
from airborne.cameras.skeletons import SKELETONS
from airborne.errors import CalibrationError


def table(frames=3, points=17, seed=0):
    rng = np.random.default_rng(seed)
    return np.concatenate([rng.uniform(0, 700, (frames, points, 2)), rng.uniform(0.2, 1, (frames, points, 1))], axis=-1)


def save(folder, **tables):
    np.savez(folder / "found.npz", **tables)
    return folder / "found.npz"


def save_json(folder, camera, found, name="{camera}_{frame:012d}_keypoints.json", start=0):
    target = folder / camera
    target.mkdir(parents=True)
    for frame, people in enumerate(found, start=start):
        document = {"version": 1.3, "people": [{"pose_keypoints_2d": person.ravel().tolist()} for person in people]}
        (target / name.format(camera=camera, frame=frame)).write_text(json.dumps(document))


def test_array_of_each_camera_is_read_as_it_is(tmp_path):
    one, two = table(), table(seed=1)
    found = read_detections(save(tmp_path, left=one, right=two), ["right", "left"])
    assert (found.cameras, found.points) == (("right", "left"), SKELETONS["COCO"].points)
    np.testing.assert_array_equal(found.px, np.stack([two[..., :2], one[..., :2]], axis=2))
    np.testing.assert_array_equal(found.visibility, np.stack([two[..., 2], one[..., 2]], axis=2))


def test_cameras_and_arrays_belong_together_by_their_numbers(tmp_path):
    path = save(tmp_path, c1=table(), c2=table(seed=1), c10=table(seed=2))
    found = read_detections(path, ["cam02", "cam10"])
    np.testing.assert_array_equal(found.px[:, :, 0], table(seed=1)[..., :2])
    np.testing.assert_array_equal(found.px[:, :, 1], table(seed=2)[..., :2])


def test_a_table_says_which_array_belongs_to_which_camera(tmp_path):
    path = save(tmp_path, c1=table(), c2=table(seed=1))
    found = read_detections(path, ["cam1", "cam2"], {"cam1": "c2", "cam2": "c1"})
    np.testing.assert_array_equal(found.px[:, :, 0], table(seed=1)[..., :2])


@pytest.mark.parametrize(
    ("cameras", "named", "said"),
    [
        (["left"], {}, "holds no detections of 'left'; it has: a1, b1"),
        (["cam1"], {}, "holds no detections of 'cam1'"),
        (["cam1"], {"cam1": "c"}, "holds no detections of 'c'; .*detections_cameras = {cam1 = "),
    ],
)
def test_camera_without_a_clear_array_is_refused(tmp_path, cameras, named, said):
    with pytest.raises(CalibrationError, match=said):
        read_detections(save(tmp_path, a1=table(), b1=table()), cameras, named)


def test_shorter_arrays_end_unseen(tmp_path):
    found = read_detections(save(tmp_path, a=table(5), b=table(2)), ["a", "b"])
    assert found.px.shape == (5, 17, 2, 2)
    assert np.isnan(found.px[2:, :, 1]).all()
    assert not found.visibility[2:, :, 1].any()


def test_points_without_visibility_or_numbers_are_not_seen(tmp_path):
    values = table()
    values[0, 0, 2] = 0
    values[0, 1, 0] = np.nan
    found = read_detections(save(tmp_path, a=values), ["a"])
    assert np.isnan(found.px[0, :2]).all()
    assert (found.visibility[0, :2] == 0).all()
    assert np.isfinite(found.px[0, 2:]).all()


def test_folder_of_json_reads_as_the_array_does(tmp_path):
    values = {"left": table(4, 25), "right": table(4, 25, 1)}
    for camera, found in values.items():
        save_json(tmp_path / "pose", f"{camera}_json", found[:, None])
    from_json = read_detections(tmp_path / "pose", list(values), skeleton="BODY_25")
    from_array = read_detections(save(tmp_path, **values), list(values), skeleton="body25")
    np.testing.assert_array_equal(from_json.px, from_array.px)
    assert from_json.points == from_array.points == SKELETONS["BODY_25"].points
    by_name = read_detections(tmp_path / "pose", ["a"], {"a": "right_json"}, skeleton="BODY_25")
    np.testing.assert_array_equal(by_name.px[:, :, 0], from_array.px[:, :, 1])


def test_the_last_number_of_a_files_name_is_its_frame(tmp_path):
    save_json(tmp_path, "cam7", table(2, 26)[:, None], "{camera}.{frame}.json", start=3)
    found = read_detections(tmp_path, ["cam7"])
    assert len(found.px) == 5
    assert np.isnan(found.px[:3]).all()
    np.testing.assert_array_equal(found.px[3:, :, 0], table(2, 26)[..., :2])


def test_of_several_people_the_surest_is_taken_and_it_is_said(tmp_path):
    sure, unsure = table(2), table(2, seed=1) * [1, 1, 0.3]
    save_json(tmp_path, "a", np.stack([unsure, sure], axis=1))
    found = read_detections(tmp_path, ["a"])
    np.testing.assert_array_equal(found.px[:, :, 0], sure[..., :2])
    assert found.notes == ("a: up to 2 people in an image; took the one detected most surely",)


def test_frame_with_nobody_is_not_seen(tmp_path):
    save_json(tmp_path, "a", [table(1), [], table(1)])
    assert np.isnan(read_detections(tmp_path, ["a"]).px[1]).all()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (table()[..., :2], r"detections of 'a' are float64 \(3, 17, 2\)"),
        (table(points=19), "points per image: a 19; expected the same for all, one of 17, 18, 25"),
        (np.array([["x"]]), "the detections of 'a' are"),
        (table(frames=0), r"\(0, 17, 3\)"),
    ],
)
def test_array_of_another_shape_is_refused(tmp_path, values, said):
    with pytest.raises(CalibrationError, match=said) as caught:
        read_detections(save(tmp_path, a=values), ["a"])
    assert "\n" not in str(caught.value)


def test_file_that_holds_no_detections_is_refused(tmp_path):
    (tmp_path / "text.npz").write_text("no")
    np.save(tmp_path / "one.npy", table())
    np.savez(tmp_path / "objects.npz", a=np.array([{}], dtype=object))
    (tmp_path / "empty.npz").write_bytes(b"")
    for name in ("text.npz", "one.npy", "objects.npz", "empty.npz"):
        with pytest.raises(CalibrationError, match=r"is not a \.npz of numbers"):
            read_detections(tmp_path / name, ["a"])
    with pytest.raises(CalibrationError, match=r"none\.npz cannot be read \(No such file"):
        read_detections(tmp_path / "none.npz", ["a"])


@pytest.mark.parametrize(
    ("text", "name", "said"),
    [
        ("{", "a_1.json", "is not OpenPose JSON"),
        ('{"people": 3}', "a_1.json", "is not OpenPose JSON"),
        ('{"people": [{"pose_keypoints_2d": [1, 2]}]}', "a_1.json", "is not OpenPose JSON"),
        ('{"people": []}', "a_1.json", "there is nobody in any image"),
        ('{"people": []}', "first.json", "whose names end in the frame's number"),
        ("", "a.txt", "holds no detections; expected JSON files"),
    ],
)
def test_folder_that_holds_no_detections_is_refused(tmp_path, text, name, said):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / name).write_text(text)
    with pytest.raises(CalibrationError, match=said):
        read_detections(tmp_path, ["a"])


def test_people_of_changing_length_are_refused(tmp_path):
    save_json(tmp_path, "a", [table(1, 17), table(1, 25)])
    with pytest.raises(CalibrationError, match=r"people of \[17, 25\] points"):
        read_detections(tmp_path, ["a"])


@pytest.mark.parametrize("skeleton", SKELETONS.values(), ids=lambda skeleton: skeleton.name)
def test_every_network_names_each_point_once_and_both_sides_alike(skeleton):
    names = skeleton.points
    assert len(names) <= skeleton.n_points
    assert len(set(names)) == len(names)
    assert {name.replace("left", "right") for name in names} == {name for name in names if "left" not in name}
    assert {"hip_left", "shoulder_right", "ankle_left", "wrist_right", "nose"} <= set(names)


@pytest.mark.parametrize(
    ("skeleton", "names", "places"),
    [
        ("BLAZEPOSE", ("shoulder_left", "hip_right", "toe_left"), [11, 24, 31]),
        ("BODY_25", ("mid_hip", "knee_left", "toe_left", "heel_right"), [8, 13, 19, 24]),
        ("BODY_25B", ("hip_right", "toe_left", "heel_right"), [12, 19, 24]),
        ("HALPE_26", ("mid_shoulder", "toe_right", "heel_right"), [18, 21, 25]),
        ("COCO_18", ("elbow_left", "hip_right", "ear_left"), [6, 8, 17]),
        ("COCO_133", ("toe_left", "heel_left", "heel_right"), [17, 19, 22]),
    ],
)
def test_networks_are_in_the_order_of_their_makers(skeleton, names, places):
    assert [SKELETONS[skeleton].points.index(name) for name in names] == places


def test_points_of_two_networks_are_refused_until_one_is_named(tmp_path):
    path = save(tmp_path, a=table(points=25))
    with pytest.raises(CalibrationError, match=r"25 points per image may be BODY_25 or BODY_25B.*--skeleton BODY_25$"):
        read_detections(path, ["a"])
    for name in ("BODY_25", "BODY_25B"):
        assert read_detections(path, ["a"], skeleton=name).points == SKELETONS[name].points


def test_files_say_their_skeleton(tmp_path):
    px = table(points=25)[:, :, None]
    given = Detections(cameras=("a",), points=SKELETONS["BODY_25B"].points, px=px[..., :2], visibility=px[..., 2])
    for path, as_folder in ((tmp_path / "pose", True), (tmp_path / "found.npz", False)):
        write_detections(path, given, as_folder=as_folder)
        found = read_detections(path, ["a"])
        assert (found.points, found.notes) == (given.points, ())
        assert camera_names(path) == ("a",)
        with pytest.raises(CalibrationError, match="is BODY_25 and BODY_25B; expected one"):
            read_detections(path, ["a"], skeleton="BODY_25")


def test_points_of_the_only_network_of_that_number_are_taken(tmp_path):
    for skeleton in (None, "Halpe-26"):
        found = read_detections(save(tmp_path, a=table(points=26)), ["a"], skeleton=skeleton)
        assert found.points == SKELETONS["HALPE_26"].points


@pytest.mark.parametrize(
    ("skeleton", "said"),
    [
        ("BODY_25", "17 points per image are those of COCO; skeleton BODY_25 has 25"),
        ("SMPL", "no skeleton 'SMPL'; expected one of COCO, COCO_18, BODY_25, BODY_25B, HALPE_26"),
    ],
)
def test_a_skeleton_that_does_not_fit_is_refused(tmp_path, skeleton, said):
    with pytest.raises(CalibrationError, match=said):
        read_detections(save(tmp_path, a=table()), ["a"], skeleton=skeleton)


def test_a_camera_may_be_called_skeleton(tmp_path):
    path = save(tmp_path, skeleton=table())
    assert camera_names(path) == ("skeleton",)
    assert read_detections(path, ["skeleton"]).points == SKELETONS["COCO"].points


def test_landmarks_lie_between_their_points():
    names = ("ear_left", "ear_right", "heel_left", "toe_left", "knee_left")
    points = np.arange(30.0).reshape(2, 5, 3)
    found = landmarks_from_points(names, points)
    np.testing.assert_allclose(found["head"], (points[:, 0] + points[:, 1]) / 2)
    np.testing.assert_allclose(found["foot_left"], points[:, 2] + 0.75 * (points[:, 3] - points[:, 2]))
    np.testing.assert_array_equal(found["knee_left"], points[:, 4])
    assert {"foot_right", "hand_left"}.isdisjoint(found)


def test_a_ball_of_the_foot_without_the_small_toe_lies_toward_the_big_one():
    names = ("heel_left", "toe_left", "small_toe_left")
    points = np.arange(18.0).reshape(2, 3, 3)
    points[1, 2] = np.nan
    found = landmarks_from_points(names, points)["foot_left"]
    np.testing.assert_allclose(found[0], 0.25 * points[0, 0] + 0.375 * (points[0, 1] + points[0, 2]))
    np.testing.assert_allclose(found[1], 0.25 * points[1, 0] + 0.75 * points[1, 1])


def test_landmark_is_unknown_where_a_point_of_it_is_and_its_own_point_goes_first():
    names = ("ear_left", "ear_right", "head")
    points = np.array([[0.0, 0, 0], [np.nan] * 3, [1, 2, 3]])
    np.testing.assert_array_equal(landmarks_from_points(names, points)["head"], [1, 2, 3])
    assert np.isnan(landmarks_from_points(names[:2], points[:2])["head"]).all()


def detections(frames=4):
    px = np.arange(frames * 3 * 2 * 2.0).reshape(frames, 3, 2, 2)
    visibility = np.linspace(0.1, 1, frames * 6).reshape(frames, 3, 2)
    return Detections(cameras=("a", "b"), points=("x", "y", "z"), px=px, visibility=visibility)


def test_each_camera_gives_its_own_frame_and_none_where_there_is_none():
    given = detections()
    at = given.at(np.array([[0, 2], [3, 5], [-1, 1]]))
    np.testing.assert_array_equal(at.px[0, :, 0], given.px[0, :, 0])
    np.testing.assert_array_equal(at.px[0, :, 1], given.px[2, :, 1])
    np.testing.assert_array_equal(at.visibility[1, :, 0], given.visibility[3, :, 0])
    for row, column in ((1, 1), (2, 0)):
        assert np.isnan(at.px[row, :, column]).all()
        assert not at.visibility[row, :, column].any()


def test_selecting_cameras_keeps_their_columns():
    np.testing.assert_array_equal(detections().select(["b", "a"]).px, detections().px[:, :, ::-1])


def test_less_sure_detections_are_not_seen():
    given = detections()
    sure = given.above_visibility(0.5)
    is_kept = given.visibility >= 0.5
    np.testing.assert_array_equal(np.isfinite(sure.px).all(axis=-1), is_kept)
    np.testing.assert_array_equal(sure.visibility[is_kept], given.visibility[is_kept])
    assert not sure.visibility[~is_kept].any()


def test_an_empty_folder_holds_no_detections(tmp_path):
    with pytest.raises(CalibrationError, match="holds no detections"):
        read_detections(tmp_path, ())


def test_detections_in_shares_of_the_image_are_refused_and_a_still_point_is_not(tmp_path):
    shares = table() * [1 / 700, 1 / 700, 1] - [0.1, 0, 0]
    with pytest.raises(
        CalibrationError, match=r"coordinates lie within -0\.\d\d to .* multiply x by the image's width"
    ):
        read_detections(save(tmp_path, left=shares), ["left"])
    one = table(frames=1)
    one[0, 1:, 2] = 0
    assert read_detections(save(tmp_path, left=one), ["left"]).visibility.sum() == one[0, 0, 2]
