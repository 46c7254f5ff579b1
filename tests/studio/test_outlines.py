"""What lies over the pictures of a run: outlines where the body is, lines down players' legs; and its curves."""

import os
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose
from airborne.body.files import read_body
from airborne.cameras import Rig, camera_looking_at
from airborne.errors import ResultError
from airborne.motion import MotionWriter, joint_statuses, landmarks, read_motion, read_players
from airborne.motion.files import read_estimates
from airborne.motion.tables import write_joints
from airborne.studio import curve_data
from airborne.studio.curve_data import curve_kinds, describe_distance, run_curves, run_momenta
from airborne.studio.outlines import outline_items, player_colours, run_overlay
from airborne.studio.runs import count_rows
from airborne.studio.stage import part_stl
from airborne.studio.strips import FROM_GOOD
from tests.support.motions import run_with_gap
from tests.support.person_run import PERSON, write_person_run
from tests.support.places import THROWN_CROSS
from tests.support.players_trial import rig, write_run


@pytest.fixture(scope="module")
def cross():
    return read_body(THROWN_CROSS / "cross.toml")


def test_an_outline_goes_round_the_body_where_the_bent_lens_shows_it(cross):
    camera = camera_looking_at("a", [3, -2, 1.5], [0, 0, 1], focal_px=700, size=(640, 480))
    bent = replace(camera, distortion=np.array([-0.3, 0.1, 0, 0, 0]))
    posed = cross.with_pose(Pose(world_from_root=RigidTransform.from_translation([0.5, 0.6, 0.7])))
    (item,) = outline_items(posed, Rig((bent,)).cameras, "#ffffff")
    corners = np.array([[x, y, z] for x in (-0.03, 0.03) for y in (-0.45, 0.45) for z in (-0.0225, 0.0225)])
    seen = bent.px_from_world(corners + np.array([0.5, 0.6, 0.7]))
    line = np.array(item["points"])
    outer = seen[[seen[:, 0].argmin(), seen[:, 0].argmax()]]
    assert np.linalg.norm(line[:, None] - outer, axis=2).min(axis=0).max() < 2.5
    assert (item["pane"], item["closed"]) == (0, True)


def test_players_have_lines_down_both_legs_in_each_camera(tmp_path):
    run = write_run(tmp_path / "run")
    motion = read_players(run / "joints.csv")
    overlay = run_overlay(run, 3, ("right", "left"))
    assert len(overlay["items"]) == 2 * 2 * len(motion.players)
    first = overlay["items"][0]
    hip = motion.points[3, 0, motion.joints.index("hip_left")]
    assert first["points"][0] == pytest.approx(rig()["right"].px_from_world(hip), abs=0.01)
    assert run_overlay(run, 99, ("right", "left"))["items"] == []


def test_another_run_is_drawn_in_its_own_colour_and_said_to_be_as_far_as_it_is(tmp_path):
    run, other, body = write_run(tmp_path / "run"), write_run(tmp_path / "other"), tmp_path / "body"
    overlay = run_overlay(run, 3, ("right", "left"), colour="#cc79a7")
    assert {item["colour"] for item in overlay["items"]} == {"#cc79a7"}
    table = (other / "joints.csv").read_text().splitlines()
    columns = table[0].split(",")
    frame, joint, x = (columns.index(name) for name in ("frame", "joint", "x_m"))
    row = next(
        k for k, line in enumerate(table) if line.split(",")[frame] == "5" and line.split(",")[joint] == "hip_left"
    )
    cells = table[row].split(",")
    cells[x] = str(float(cells[x]) + 0.25)
    table[row] = ",".join(cells)
    (other / "joints.csv").write_text("\n".join(table) + "\n")
    assert describe_distance(run, other).endswith("0 mm apart, the median; at most 250 mm, in frame 5")
    body.mkdir()
    with MotionWriter(body / "motion.csv") as writer:
        writer.append(run_with_gap()[0])
    assert describe_distance(run, body) == "they share no frame"
    assert describe_distance(body, body) == "the bodies' positions are 0 mm apart, the median; at most 0 mm, in frame 0"


def test_players_have_colours_by_their_side_of_the_net():
    colours = player_colours({"a": -1.0, "b": 2.0, "c": -3.0, "d": 0.5})
    assert len(set(colours.values())) == 4
    assert list(colours) == ["a", "c", "b", "d"]
    assert player_colours({"b": 2.0})["b"] == colours["b"]


def test_curves_of_players_are_of_their_hips_or_of_what_is_lowest(tmp_path):
    run = write_run(tmp_path / "run")
    assert list(curve_kinds(run)) == ["", "feet"]
    motion = read_players(run / "joints.csv")
    for what, limbs in (("", ("hip_left", "hip_right")), ("feet", ("ankle_left", "ankle_right"))):
        curves = run_curves(run, what)
        assert curves["frame"] == list(range(12))
        assert [each["name"].split(":")[0] for each in curves["series"]] == ["Anna", "number 7"]
        height = motion.points[:, 0, [motion.joints.index(limb) for limb in limbs], 2]
        first = curves["series"][0]
        np.testing.assert_allclose(first["value"], height.min(axis=1) if what else height.mean(axis=1), atol=1e-5)
        assert all(0 < sd < 0.2 for sd in first["sd"])
    assert set(curves["status"]) <= {"tracked", "uncertain", "lost"}
    assert [(strip["name"], len(strip["rank"])) for strip in curves["strips"]] == [("Anna", 12), ("number 7", 12)]


def test_strips_say_how_each_joint_goes_while_the_run_goes_on_and_after_it(tmp_path, monkeypatch):
    camera = camera_looking_at("a", [3, -2, 1.5], [0, 0, 1], focal_px=700, size=(640, 480))
    run = tmp_path / "run"
    write_person_run(run, Rig((camera,)), 40, Fraction(50))
    estimates, joints = read_estimates(run / "motion.csv"), read_motion(run / "motion.csv").joints
    elbow = 6 + 3 * joints.index("forearm_left")
    (run / "motion.csv").unlink()
    with MotionWriter(run / "motion.csv", joints) as writer:
        for each in estimates[::-1]:  # tracked backward
            if each.index in (3, 35):
                each.covariance[elbow, elbow] = 0.3  # of the elbow's turn, in two blocks [rad²]
            writer.append(each)
            curves = run_curves(run)
            assert [len(strip["rank"]) for strip in curves["strips"]] == [40 - each.index] * len(PERSON.landmarks)
    motion = read_motion(run / "motion.csv")
    expected = joint_statuses(motion, PERSON, landmarks(motion, PERSON)[1])
    strips = {strip["name"]: FROM_GOOD[list(map(int, strip["rank"]))].tolist() for strip in curves["strips"]}
    assert strips == {landmark.name: expected[:, k].tolist() for k, landmark in enumerate(PERSON.landmarks)}
    assert [k for k, status in enumerate(strips["wrist_left"]) if status != "tracked"] == [3, 35]
    assert set(strips["knee_right"]) == {"tracked"}
    monkeypatch.setattr("airborne.studio.strips._block_ranks", lambda *_: pytest.fail("computed, not read"))
    monkeypatch.setattr("airborne.studio.strips._MOST_ROWS", 0)
    monkeypatch.setattr("airborne.studio.strips._CHUNK", 1000)
    assert run_curves(run)["strips"] == []
    write_joints(run / "joints.csv", motion, PERSON)
    assert run_curves(run)["strips"] == curves["strips"]
    table = (run / "joints.csv").read_text()
    for other in (
        table.rpartition("39,")[0],
        table.replace("uncertain", "unheard-of", 1),
        "frame,joint\n",
        "joint,status\ntorn",
    ):
        (run / "joints.csv").write_text(other)
        assert run_curves(run)["strips"] == []
    write_joints(run / "joints.csv", motion, PERSON)
    os.utime(run / "joints.csv", (0, 0))  # older than the motion, which is tracked again
    assert run_curves(run)["strips"] == []


def test_curves_of_a_long_run_keep_what_stands_out(tmp_path, monkeypatch):
    with MotionWriter(tmp_path / "motion.csv") as writer:
        for each in run_with_gap(101, lost=(50,)):
            writer.append(each)
    whole = run_curves(tmp_path)
    monkeypatch.setattr(curve_data, "_MOST_POINTS", 20)
    thin = run_curves(tmp_path)
    assert len(thin["frame"]) <= 22
    assert (thin["frame"][0], thin["frame"][-1]) == (0, 100)
    assert "lost" in thin["status"]
    for a, b in zip(whole["series"], thin["series"], strict=True):
        values = [each for each in a["value"] if each is not None]
        assert (min(b["value"]), max(b["value"])) == (min(values), max(values))
        assert len(b["sd"]) == len(b["value"]) == len(thin["frame"]) == len(thin["time_s"])


def test_curves_show_the_columns_of_a_run_s_tables_and_of_one_joint(cross, tmp_path):
    with MotionWriter(tmp_path / "motion.csv") as writer:
        for each in run_with_gap(4, lost=(2,)):
            writer.append(each)
    assert curve_kinds(tmp_path) == {"": "position"}
    (tmp_path / "tables").mkdir()
    names = ("somersault", "tilt", "twist")
    header = ",".join(["frame", "time_s", *(f"{name}_deg" for name in names), *(f"{name}_deg_sd" for name in names)])
    (tmp_path / "tables" / "angles.csv").write_text(
        f"{header}\n0,0,1,2,3,.1,.2,.3\n3,0.06,4,5,,.4,.5,\n9,1,0,0,0,0,0,0\n"
    )
    somersault, _, twist = run_curves(tmp_path, "rotation")["series"]
    assert (somersault["name"], somersault["unit"]) == ("somersault", "°")
    assert (somersault["value"], somersault["sd"]) == ([1, None, None, 4], [0.1, None, None, 0.4])
    assert twist["value"] == [3, None, None, None]
    header = "frame,time_s,joint,x_deg,y_deg,z_deg,x_deg_sd,y_deg_sd,z_deg_sd"
    rows = "".join(
        f"{k},0,{name},{k + turn},0,0,1,1,1\n" for k in range(4) for name, turn in (("hip", 10), ("knee", 20))
    )
    (tmp_path / "tables" / "joint_angles.csv").write_text(f"{header}\n{rows}")
    assert run_curves(tmp_path, "joint:knee")["series"][0]["value"] == [20, 21, 22, 23]
    assert run_momenta(tmp_path) is None
    header = [f"com_{axis}_m" for axis in "xyz"] + [f"L_{axis}_kg_m2_s" for axis in "xyz"]
    header = ",".join(["frame", *header, *(f"{name}_sd" for name in header)])
    (tmp_path / "tables" / "flight.csv").write_text(f"{header}\n1,0,0,1,30,0,40,,,,1,1,1\n3,0,0,1,,,,,,,,,\n")
    momenta = run_momenta(tmp_path)
    com_m, L, sd = momenta.at(1)
    assert (com_m.tolist(), L.tolist(), sd, momenta.greatest) == ([0, 0, 1], [30, 0, 40], 1.0, 50.0)
    assert momenta.at(0) is None and momenta.at(3) is None and momenta.at(99) is None
    (tmp_path / "tables" / "flight.csv").unlink()
    with pytest.raises(ResultError, match="no curve is called height; reload this page"):
        run_curves(tmp_path, "height")
    with pytest.raises(ResultError, match=r"tables/flight.csv cannot be read; track again"):
        run_curves(tmp_path, "com")


def test_a_part_of_a_body_is_a_mesh_in_its_segment(cross):
    stl = part_stl(cross, 1)
    corners = np.frombuffer(stl[84:], np.dtype([("normal", "<3f4"), ("corners", "<9f4"), ("rest", "<u2")]))["corners"]
    assert np.ptp(corners.reshape(-1, 3), axis=0) == pytest.approx([0.6, 0.06, 0.045])


def test_rows_of_a_run_are_counted_while_it_goes_on(tmp_path):
    assert count_rows(tmp_path) == (0, None)
    path = tmp_path / "motion.csv"
    with MotionWriter(path) as writer:
        for number, estimate in enumerate(run_with_gap(), start=1):
            writer.append(estimate)
            assert count_rows(tmp_path) == (number, estimate.index)
    path.write_bytes(path.read_bytes() + b"99,0.3")
    assert count_rows(tmp_path) == (number, estimate.index)


def test_frames_of_players_are_counted_while_their_run_goes_on(tmp_path):
    path = write_run(tmp_path / "run") / "joints.csv"
    assert count_rows(path.parent) == (12, 11)
    lines = path.read_text().splitlines(keepends=True)
    per_frame = (len(lines) - 1) // 12
    path.write_text("".join(lines[: 1 + 3 * per_frame]) + lines[1 + 3 * per_frame][:5])  # the last is being written
    assert count_rows(path.parent) == (3, 2)
    path.write_text(lines[0])
    assert count_rows(path.parent) == (0, None)
