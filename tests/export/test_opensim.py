"""OpenSim opens the model without a word, plays the motion to our places, and finds them by inverse kinematics."""

import xml.etree.ElementTree as ET
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Inertia, Mesh, Part, Segment
from airborne.export.opensim_model import coordinate_names, write_osim
from airborne.export.opensim_motion import write_mot
from airborne.export.takes import player_takes
from airborne.export.trc import write_trc
from tests.support.bodies import total_inertia
from tests.support.export_scenes import BOX, PERSON
from tests.support.takes import jumping, take_of, tumbling
from tests.support.tolerances import ROUNDTRIP

Y_UP = [1, 2, 0]
PLAYED_M = 1e-7  # nine digits of degrees, some joints away
FOUND_M = 1e-3  # what is asked of inverse kinematics


def columns_of(path):
    """The head of a motion file, its names and its numbers."""
    lines = path.read_text().splitlines()
    end = lines.index("endheader")
    return lines[:end], lines[end + 1].split("\t"), np.array([line.split("\t") for line in lines[end + 2 :]], float)


@contextmanager
def warnings_of(opensim, path):
    """Collect what OpenSim warns of in a file."""
    opensim.Logger.setLevelString("Warn")
    opensim.Logger.addFileSink(str(path))
    try:
        yield
    finally:
        opensim.Logger.removeFileSink()
        opensim.Logger.setLevelString("Off")


def play(opensim, model, path):
    """Set the model's coordinates row by row; return where its markers are, by name, (n, 3) each."""
    state, table = model.initSystem(), opensim.TimeSeriesTable(str(path))
    assert table.getTableMetaDataString("inDegrees") == "yes"
    coordinates, markers = model.updCoordinateSet(), model.getMarkerSet()
    result = {markers.get(k).getName(): [] for k in range(markers.getSize())}
    for row in (table.getRowAtIndex(k) for k in range(table.getNumRows())):
        for name, value in zip(table.getColumnLabels(), (row[k] for k in range(row.size())), strict=True):
            coordinate = coordinates.get(name)
            turns = coordinate.getMotionType() == opensim.Coordinate.Rotational
            if coordinate.getLocked(state):
                assert value == pytest.approx(0, abs=ROUNDTRIP)
            else:
                coordinate.setValue(state, np.deg2rad(value) if turns else value, False)
        model.realizePosition(state)
        for name, positions in result.items():
            position = markers.get(name).getLocationInGround(state)
            positions.append([position[k] for k in range(3)])
    return {name: np.array(positions) for name, positions in result.items()}


def truth_of(take):
    """Where the markers were measured, as OpenSim has them, by name."""
    return {name: take.points[:, k][:, Y_UP] for k, name in enumerate(take.markers)}


def farthest(found, truth):
    return max(np.linalg.norm(positions - truth[name], axis=1).max() for name, positions in found.items())


TAKES = {
    "a person": lambda: take_of(tumbling(6), PERSON),
    "a thrown box": lambda: take_of(tumbling(6, model=BOX), BOX),
    "a player": lambda: player_takes(jumping(6))[1],
    "a player without feet": lambda: player_takes(jumping(6, joints=jumping().joints[:6]))[0],
}


@pytest.mark.parametrize("who", TAKES)
def test_opensim_plays_the_motion_to_our_positions(who, opensim, tmp_path):
    take = TAKES[who]()
    write_osim(tmp_path / "run.osim", take.model)
    (path,) = write_mot(tmp_path / "run.mot", take)
    with warnings_of(opensim, tmp_path / "log.txt"):
        model = opensim.Model(str(tmp_path / "run.osim"))
        result = play(opensim, model, path)
    assert (tmp_path / "log.txt").read_text() == ""
    assert len(result) == len(take.model.landmarks) >= 4
    assert farthest(result, truth_of(take)) < PLAYED_M


@pytest.mark.parametrize("who", TAKES)
def test_inverse_kinematics_reproduces_our_joint_centres(who, opensim, tmp_path):
    take = TAKES[who]()
    write_osim(tmp_path / "run.osim", take.model)
    write_trc(tmp_path / "run.trc", take)
    tool, model = opensim.InverseKinematicsTool(), opensim.Model(str(tmp_path / "run.osim"))
    tool.setModel(model)
    tool.setMarkerDataFileName(str(tmp_path / "run.trc"))
    tool.setStartTime(take.time_s[0])
    tool.setEndTime(take.time_s[-1])
    tool.set_report_errors(False)
    tool.setOutputMotionFileName(str(tmp_path / "found.mot"))
    assert tool.run()
    result = play(opensim, opensim.Model(str(tmp_path / "run.osim")), tmp_path / "found.mot")
    assert len(next(iter(result.values()))) == 6
    assert farthest(result, truth_of(take)) < FOUND_M


def test_the_model_has_the_bodys_masses(opensim, tmp_path):
    take = take_of(tumbling(4), PERSON)
    write_osim(tmp_path / "run.osim", take.model)
    model = opensim.Model(str(tmp_path / "run.osim"))
    state = model.initSystem()
    row = 2
    values = columns_of(write_mot(tmp_path / "run.mot", take)[0])[2][row, 1:]
    coordinates = model.updCoordinateSet()
    for name, value in zip(coordinate_names(take.model), values, strict=True):
        is_slide = name[-3:] in ("_tx", "_ty", "_tz")
        coordinates.get(name).setValue(state, value if is_slide else np.deg2rad(value), False)
    whole = total_inertia(PERSON.with_pose(tumbling(4).pose(row)))
    model.realizePosition(state)
    assert model.getTotalMass(state) == pytest.approx(whole.mass_kg)
    centre = model.calcMassCenterPosition(state)
    np.testing.assert_allclose([centre[k] for k in range(3)], whole.centre_m[Y_UP], atol=PLAYED_M)


def test_inertia_tensors_rotate_with_their_axes(tmp_path):
    tensor = np.array([[3.0, 0.1, 0.2], [0.1, 4.0, 0.3], [0.2, 0.3, 5.0]])
    segment = replace(BOX.segments[0], inertia=Inertia(2.0, np.array([0.01, 0.02, 0.03]), tensor))
    write_osim(tmp_path / "box.osim", replace(BOX, segments=(segment,)))
    body = ET.parse(tmp_path / "box.osim").find(".//Body")
    numbers = {key: [float(x) for x in body.find(key).text.split()] for key in ("mass", "mass_center", "inertia")}
    assert numbers["mass"] == [2.0]
    assert numbers["mass_center"] == [-0.02, 0.03, -0.01]  # ahead is -y, up z, right -x
    assert numbers["inertia"] == [4.0, 5.0, 3.0, -0.3, 0.1, -0.2]


def test_shapes_lie_in_the_model_as_in_the_body(opensim, tmp_path):
    place = RigidTransform.from_components([0.1, 0.2, 0.3], Rotation.from_euler("XYZ", [0.4, -1.2, 2.0]))
    red, blue = np.array([255.0, 0, 0]), np.array([0, 0, 255.0])
    mesh = Mesh(np.array([[0, 0, 0], [1.0, 0, 0], [0, 2.0, 0], [0, 0, 3.0]]), np.array([[0, 2, 1], [0, 1, 3]]))
    ball = Ellipsoid(np.array([0.1, 0.2, 0.3]))
    parts = (
        Part("lower", ball, place, red, (-np.inf, 0.1)),
        Part("upper", ball, place, blue, (0.1, np.inf)),
        Part("box", Box(np.array([0.2, 0.4, 0.6])), place, None),
        Part("mesh", mesh, RigidTransform.identity(), red),
    )
    write_osim(tmp_path / "body.osim", BodyModel("shapes", (Segment("root", None, np.zeros(3), parts),)))
    model = opensim.Model(str(tmp_path / "body.osim"))
    state = model.initSystem()
    rendered = ET.parse(tmp_path / "body.osim").findall(".//Body/components/PhysicalOffsetFrame/attached_geometry/*")
    assert [(each.tag, each[-1].text) for each in rendered] == [
        ("Ellipsoid", "0.1 0.2 0.3"),
        ("Brick", "0.1 0.2 0.3"),
        ("Brick", "0.5 1.0 1.5"),
    ]
    assert rendered[0].find("Appearance/color").text == "1.0 0.0 0.0"  # the longer of the two slabs
    world_from_part = {"root_part1": place, "root_part3": RigidTransform.from_translation([0.5, 1.0, 1.5])}
    for name, expected in world_from_part.items():
        frame = opensim.PhysicalOffsetFrame.safeDownCast(model.getComponent(f"/bodyset/root/{name}"))
        for local in np.vstack([np.zeros(3), np.eye(3)]):
            displayed = frame.findStationLocationInGround(state, opensim.Vec3(*local))
            np.testing.assert_allclose([displayed[k] for k in range(3)], expected.apply(local)[Y_UP], atol=1e-9)


def test_a_gap_ends_a_file_and_no_number_is_invented(tmp_path):
    take = take_of(tumbling(9, lost=(3, 4)), PERSON)
    first, second = write_mot(tmp_path / "run.mot", take)
    assert (first.name, second.name) == ("run_part1.mot", "run_part2.mot")
    for path, rows in ((first, slice(0, 3)), (second, slice(5, 9))):
        head, names, values = columns_of(path)
        assert head == [path.stem, "version=1", f"nRows={len(values)}", f"nColumns={len(names)}", "inDegrees=yes"]
        np.testing.assert_allclose(values[:, 0], take.time_s[rows], atol=1e-9)
        assert np.isfinite(values).all()
    assert not (tmp_path / "run.mot").exists()
    assert write_mot(tmp_path / "none.mot", take_of(tumbling(2, lost=(0, 1)), PERSON)) == []


def test_angles_are_ours_in_degrees_and_unwrapped(tmp_path):
    take = take_of(tumbling(60, turns=3.0), PERSON)
    _, names, values = columns_of(write_mot(tmp_path / "run.mot", take)[0])
    assert names[:8] == ["time", "somersault", "tilt", "twist", "pelvis_tx", "pelvis_ty", "pelvis_tz", "torso_x"]
    assert names[1:] == coordinate_names(take.model)
    np.testing.assert_allclose(values[:, 1:4], np.rad2deg(take.root_angles), atol=1e-5)
    np.testing.assert_allclose(values[:, 4:7], take.position[:, Y_UP], atol=1e-8)
    np.testing.assert_allclose(values[:, 7:], np.rad2deg(take.joint_angles).reshape(60, -1), atol=1e-6)
    assert values[-1, 1] > 1000
    assert np.abs(np.diff(values[:, 1:4], axis=0)).max() < 90


def test_names_of_a_body_file_become_names_that_opensim_takes(opensim, tmp_path):
    part = BOX.segments[0].parts
    model = BodyModel(
        "Übung | 1",
        (
            Segment("the trunk", None, np.zeros(3), part),
            Segment("l|arm", "the trunk", np.array([0, 0, 0.3]), part),
            Segment("l arm", "the trunk", np.array([0, 0, 0.4]), part),
        ),
    )
    write_osim(tmp_path / "body.osim", model)
    read = opensim.Model(str(tmp_path / "body.osim"))
    assert read.getName() == "Ubung_1"
    bodies = read.getBodySet()
    assert [bodies.get(k).getName() for k in range(3)] == ["the_trunk", "l_arm", "l_arm_2"]
    assert "l_arm_2_z" in coordinate_names(model)
