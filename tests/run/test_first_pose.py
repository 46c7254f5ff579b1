"""The first pose of a trial, however it is given, and its cameras, resected where asked for."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose, human18
from airborne.cameras import Rig, write_pose2sim
from airborne.cameras.skeletons import SKELETONS
from airborne.errors import CalibrationError, MistakesError, TrialError
from airborne.run import detections as trial_detections
from airborne.run import first_pose
from airborne.run.identity import input_hashes
from airborne.run.opening import open_cameras, open_trial, video_source
from airborne.trial.file import read_trial
from airborne.video import inspect
from tests.support.cameras import camera_at
from tests.support.clips import numbered, write_clip
from tests.support.people_seen import knocked
from tests.support.tolerances import SOLVED


def read_detections(trial):
    return trial_detections.read_trial_detections(trial, [inspect(video_source(trial, c)) for c in trial.camera])


def find_first_pose(trial, model, rig):
    return first_pose.find_first_pose(trial, model, rig, read_detections(trial))


def landmarks_over_time(trial, rig):
    return trial_detections.landmarks_over_time(rig, read_detections(trial))


def resect_moved_cameras(trial, rig):
    return trial_detections.resect_moved_cameras(rig, read_detections(trial), trial.calibration.mend)


MODEL = human18(1.7, 60.0)
NAMES = [landmark.name for landmark in MODEL.landmarks]
COCO = SKELETONS["COCO"].points
CENTRES = {"cam1": (-4, -5, 1.5), "cam2": (4, -5, 2), "cam3": (6, 3, 2.5), "cam4": (-5, 4, 2.0)}
RIG = Rig(
    tuple(
        replace(camera_at(centre, name=name, focal=120.0, target=(0, 0, 1)), size=(96, 72)).resample(
            scale=(1.0, 1.0), offset=(335.5, 251.5), size=(96, 72)
        )
        for name, centre in CENTRES.items()
    )
)
N_FRAMES, RATE = 12, Fraction(25)
HEAD = 'name = "a jump"\n'
BODY = '[body]\npreset = "human18"\nstature_m = 1.7\nmass_kg = 60.0\n'
CALIBRATION = '[calibration]\nfile = "calib.toml"\n'
DETECTIONS = '[start]\ndetections = "found.npz"\n'


def pose_at(frame):
    """A man who turns and bends while he moves."""
    angles = np.zeros((17, 3))
    for name, deg in {
        "upper_arm_left": (-60, -20, 10),
        "forearm_left": (-50, 0, 0),
        "thigh_right": (-40, 10, 0),
        "shank_right": (60, 0, 0),
        "torso": (15, 5, 0),
    }.items():
        angles[MODEL.index_of(name) - 1] = np.radians(deg)
    rotation = Rotation.from_euler("zx", [30 + 5 * frame, 5], degrees=True)
    return Pose(
        world_from_root=RigidTransform.from_components([0.05 * frame - 0.2, 0.1, 1.1], rotation),
        joint_angles=angles * (1 - 0.02 * frame),
    )


TRUE = np.stack([MODEL.with_pose(pose_at(frame)).landmarks for frame in range(N_FRAMES)])


def coco(points):
    """COCO's 17 points of landmarks (..., 20, 3); the ears stand to the head's sides, the face before it."""
    head = points[..., NAMES.index("head"), :]
    side = 0.07 * (points[..., NAMES.index("shoulder_left"), :] - points[..., NAMES.index("shoulder_right"), :])
    positions = {"nose": head, "eye_left": head, "eye_right": head, "ear_left": head + side, "ear_right": head - side}
    return np.stack(
        [positions.get(name, points[..., NAMES.index(name) if name in NAMES else 0, :]) for name in COCO], axis=-2
    )


def detections(rig=RIG, frames=range(N_FRAMES), sd_px=0.0):
    points = coco(TRUE[list(frames)])
    px = {camera.name: camera.px_from_world(points) for camera in rig}
    rng = np.random.default_rng(0)
    return {
        name: np.concatenate([at + rng.normal(0, sd_px, at.shape), np.full((*at.shape[:-1], 1), 0.9)], axis=-1)
        for name, at in px.items()
    }


@pytest.fixture
def trial(tmp_path):
    """Write the videos and the calibration; return a function that reads a trial file with a given start."""
    for camera in RIG:
        write_clip(tmp_path / f"{camera.name}.mkv", numbered(N_FRAMES, size=(96, 72)), rate=RATE)
    write_pose2sim(tmp_path / "calib.toml", RIG)

    def read(start, *, calibration=CALIBRATION, body=BODY, tables=None, extra=None):
        if tables is not None:
            np.savez(tmp_path / "found.npz", **tables)
        cameras = "".join(
            f'[[camera]]\nname = "{name}"\nvideo = "{name}.mkv"\n{(extra or {}).get(name, "")}' for name in RIG.names
        )
        (tmp_path / "trial.toml").write_text(HEAD + cameras + calibration + body + start)
        return read_trial(tmp_path / "trial.toml")

    return read


def off_m(pose, frame=0, names=NAMES):
    """How far the pose's landmarks are from the truth, at most."""
    result = MODEL.with_pose(pose).landmarks
    return max(np.linalg.norm(result[NAMES.index(name)] - TRUE[frame, NAMES.index(name)]) for name in names)


ON_COCO = [name for name in NAMES if name in COCO]


def test_root_and_joint_angles_set_by_hand(trial):
    true = pose_at(0)
    root = true.world_from_root
    start = (
        f"[start]\nposition_m = {root.translation.tolist()}\nrotation_matrix = {root.rotation.as_matrix().tolist()}\n"
    )
    start += "[start.joint_angles_deg]\n"
    for segment, xyz in zip(MODEL.segments[1:], np.degrees(true.joint_angles), strict=True):
        start += f"{segment.name} = {xyz.tolist()}\n" if xyz.any() else ""
    result = find_first_pose(trial(start), MODEL, RIG)
    assert off_m(result.pose) < 1e-9
    (note,) = result.notes
    assert note.startswith("no joint of this person was given, so joints lie where an average person")


def test_joint_angles_of_an_unknown_joint_are_refused_and_impossible_ones_noted(trial):
    root = "[start]\nposition_m = [0, 0, 1]\nquaternion_xyzw = [0, 0, 0, 1]\n"
    with pytest.raises(TrialError, match="body 'human18' has no joint 'knee_left'; it has: torso, chest"):
        find_first_pose(trial(root + "joint_angles_deg = {knee_left = [1, 2, 3]}\n"), MODEL, RIG)
    result = find_first_pose(trial(root + "joint_angles_deg = {shank_left = [-90, 0, 0]}\n"), MODEL, RIG)
    assert result.notes[0] == "start: shank_left beyond the body's joint limits, within which the fit draws it"


def test_positions_of_landmarks_in_the_file_or_in_a_table(trial, tmp_path):
    positions = dict(zip(NAMES, TRUE[0].tolist(), strict=True))
    written = ", ".join(f"{name} = {place}" for name, place in positions.items())
    result = find_first_pose(trial(f"[start]\njoints_m = {{{written}}}\n"), MODEL, RIG)
    assert off_m(result.pose) < 1e-3
    rows = [f"{name},{','.join(map(str, place))}" for name, place in positions.items()]
    (tmp_path / "joints.csv").write_text("\n".join(["joint,x_m,y_m,z_m", *rows]))
    again = find_first_pose(trial('[start]\njoints_m = "joints.csv"\n'), MODEL, RIG)
    assert off_m(again.pose) < 1e-3
    assert "first pose found; landmarks are 0 mm off (RMS)" in again.notes[0]


def test_a_point_that_cannot_be_right_is_a_mistake_and_a_wrong_stature_a_doubt(trial):
    positions = dict(zip(NAMES, TRUE[0].tolist(), strict=True))
    x, y, z = positions["hip_left"]
    written = ", ".join(f"{name} = {place}" for name, place in {**positions, "hip_left": [x + 3, y, z]}.items())
    result = find_first_pose(trial(f"[start]\njoints_m = {{{written}}}\n"), MODEL, RIG)
    (mistake,) = result.mistakes
    assert mistake.startswith("start.joints_m: hip_left lies 2.") and mistake.endswith("or the body's size")
    small = {name: (0.85 * np.array(place)).tolist() for name, place in positions.items()}
    written = ", ".join(f"{name} = {place}" for name, place in small.items())
    result = find_first_pose(trial(f"[start]\njoints_m = {{{written}}}\n"), MODEL, RIG)
    assert not result.mistakes and result.notes[0].endswith("; check the points and the body's size")
    assert result.wrong_size is not None and abs(result.wrong_size.value + 0.15) < 2 * result.wrong_size.sd
    assert "are those of a body 15 ± 3 % smaller" in result.wrong_size.sentence
    assert result.doubts == result.notes[:1]


def test_a_stature_that_is_right_is_not_doubted_by_landmarks_25_mm_off(trial):
    off_m = np.random.default_rng(4).normal(scale=0.025 / np.sqrt(3), size=TRUE[0].shape)
    written = ", ".join(f"{name} = {place}" for name, place in zip(NAMES, (TRUE[0] + off_m).tolist(), strict=True))
    assert find_first_pose(trial(f"[start]\njoints_m = {{{written}}}\n"), MODEL, RIG).wrong_size is None


def test_points_clicked_in_the_images(trial, tmp_path):
    px = {camera.name: camera.px_from_world(TRUE[0]) for camera in RIG}
    header = ["point", *(f"{name}_{axis}" for name in px for axis in "uv")]
    rows = [[name, *np.concatenate([at[i] for at in px.values()]).tolist()] for i, name in enumerate(NAMES)]
    rows[NAMES.index("wrist_left")][1:5] = [""] * 4  # two cameras are enough
    (tmp_path / "clicks.csv").write_text("\n".join(",".join(map(str, row)) for row in [header, *rows]))
    assert off_m(find_first_pose(trial('[start]\npoints_px = "clicks.csv"\n'), MODEL, RIG).pose) < 1e-3
    (tmp_path / "clicks.csv").write_text("\n".join(",".join(map(str, row)) for row in [header, ["hip", *rows[0][1:]]]))
    with pytest.raises(TrialError, match=r"clicks\.csv: body 'human18' has no landmark hip; it has: hip_left"):
        find_first_pose(trial('[start]\npoints_px = "clicks.csv"\n'), MODEL, RIG)


def inline(px, leave_out=()) -> str:
    """A [start] with clicks in the trial file itself; `leave_out` are pairs of a landmark and a camera."""
    rows = [
        f"{name} = {{ "
        + ", ".join(f"{camera} = {at[i].tolist()}" for camera, at in px.items() if (name, camera) not in leave_out)
        + " }"
        for i, name in enumerate(NAMES)
    ]
    return "[start.points_px]\n" + "\n".join(rows)


def test_points_clicked_in_the_trial_file_itself(trial):
    px = {camera.name: camera.px_from_world(TRUE[0]) for camera in RIG}
    assert off_m(find_first_pose(trial(inline(px)), MODEL, RIG).pose) < 1e-3
    with pytest.raises(TrialError, match="points_px: no camera cam9"):
        trial(inline(px).replace("cam4 =", "cam9 ="))


def test_a_click_in_one_camera_alone_constrains_the_start(trial):
    """The hand's end of a forearm is known across the line of sight of one camera, and nearer to it than without."""
    px = {camera.name: camera.px_from_world(TRUE[0]) for camera in RIG}
    arm = ("wrist_left", "hand_left")
    unseen = [(name, camera) for name in arm for camera in RIG.names]
    without = find_first_pose(trial(inline(px, unseen)), MODEL, RIG)
    lone = find_first_pose(trial(inline(px, [each for each in unseen if each != ("wrist_left", "cam1")])), MODEL, RIG)
    index, camera = NAMES.index("wrist_left"), RIG["cam1"]
    off_px = [
        np.linalg.norm(camera.px_from_world(MODEL.with_pose(each.pose).landmarks[index]) - px["cam1"][index])
        for each in (without, lone)
    ]
    assert off_px[1] < 0.8 * off_px[0]  # of images so small that a click is worth little
    assert any("wrist_left clicked in one camera" in note for note in lone.notes)


def test_detections_at_the_first_frame_tracked(trial):
    given = trial(DETECTIONS + "frame = 7\n", tables=detections())
    result = find_first_pose(given, MODEL, RIG)
    assert off_m(result.pose, 7, ON_COCO) < 2e-3
    assert result.notes[0].startswith("found.npz, frame 7: first pose found; landmarks are ")


def test_cameras_with_other_times_are_matched_by_time(trial):
    tables = detections()
    late = detections(frames=range(3, N_FRAMES))
    tables["cam2"] = late["cam2"]  # began three frames later
    given = trial(DETECTIONS + "frame = 5\n", tables=tables, extra={"cam2": "offset_s = 0.12\n"})
    assert off_m(find_first_pose(given, MODEL, RIG).pose, 5, ON_COCO) < 2e-3
    result = landmarks_over_time(given, RIG)
    for name in ON_COCO:
        np.testing.assert_allclose(result[name], TRUE[:, NAMES.index(name)], atol=SOLVED)


def test_a_field_takes_the_detections_of_its_frame(trial):
    given = trial(
        DETECTIONS + "frame = 9\n", tables=detections(), extra={n: 'fields = "top-first"\n' for n in RIG.names}
    )
    assert off_m(find_first_pose(given, MODEL, RIG).pose, 4, ON_COCO) < 2e-3


def test_camera_that_saw_something_else_is_left_out_and_named(trial):
    tables = detections()
    tables["cam3"][0, COCO.index("wrist_left")] += [25, 0, 0]
    tables["cam3"][0, COCO.index("nose")] += [25, 0, 0]
    result = find_first_pose(trial(DETECTIONS, tables=tables), MODEL, RIG)
    assert off_m(result.pose, 0, ON_COCO) < 2e-3
    assert result.notes[0] == (
        "found.npz, frame 0: cam3 left out at wrist_left, up to 25 px from where the other cameras see them"
    )


def test_missing_limb_is_named(trial):
    tables = detections()
    for name in ("wrist_left", "elbow_left"):
        for table in tables.values():
            table[:, COCO.index(name), 2] = 0.1
    notes = find_first_pose(trial(DETECTIONS, tables=tables), MODEL, RIG).notes
    assert any("no place of elbow_left, wrist_left; " in note for note in notes)


def test_detections_that_do_not_determine_a_pose_are_refused(trial):
    tables = detections()
    for table in tables.values():
        table[:, COCO.index("hip_left"), 2] = 0.0
    with pytest.raises(TrialError, match=r"found\.npz, frame 0: a pose needs both hips .* not given: hip_left"):
        find_first_pose(trial(DETECTIONS, tables=tables), MODEL, RIG)
    with pytest.raises(TrialError, match=r"found\.npz, frame 40: a pose needs both hips"):
        find_first_pose(trial(DETECTIONS + "frame = 40\n", tables=detections()), MODEL, RIG)


def test_camera_without_detections_is_refused(trial):
    tables = detections()
    del tables["cam4"]
    with pytest.raises(CalibrationError, match=r"found\.npz holds no detections of 'cam4'"):
        find_first_pose(trial(DETECTIONS, tables=tables), MODEL, RIG)


def test_camera_is_resected_where_the_trial_asks_for_it(trial, tmp_path):
    write_pose2sim(tmp_path / "calib.toml", knocked(RIG, "cam3", (0.5, -0.4, 0.3), (8, -9, 3)))
    tables = detections(sd_px=0.1)
    resected = trial(DETECTIONS, tables=tables, calibration=CALIBRATION + 'mend = ["cam3"]\n')
    recording = open_trial(resected).recording
    assert np.linalg.norm(recording.rig["cam3"].centre - RIG["cam3"].centre) < 0.15
    assert len(recording.events) == 1 and recording.events[0].startswith("cam3: moved by ")
    rig = open_cameras(resected).rig
    np.testing.assert_array_equal(rig.P, recording.rig.P)


def test_camera_that_disagrees_is_named_with_the_remedy_and_left_alone(trial, tmp_path):
    wrong = knocked(RIG, "cam3", (0.5, -0.4, 0.3), (8, -9, 3))
    rig, notes = resect_moved_cameras(trial(DETECTIONS, tables=detections()), wrong)
    assert rig is wrong
    assert len(notes) == 1
    assert notes[0].startswith("cam3 disagrees with the other cameras: half of its detections lie over ")
    assert 'give mend = ["cam3"] under [calibration]' in notes[0]
    assert resect_moved_cameras(trial(DETECTIONS, tables=detections()), RIG) == (RIG, ())


def test_exchanged_detections_are_named_before_any_camera(trial):
    large = Rig(tuple(replace(each, K=each.K * [[10], [10], [1]], size=(960, 720)) for each in RIG))
    tables = detections(large)
    tables["cam1"], tables["cam2"] = tables["cam2"], tables["cam1"]
    with pytest.raises(MistakesError, match=r"the detections: they lie \d+ px .* cam1 and cam2 are exchanged"):
        resect_moved_cameras(trial(DETECTIONS, tables=tables), large)


def test_another_start_is_another_run(trial):
    one = input_hashes(trial(DETECTIONS, tables=detections()))
    other = input_hashes(trial(DETECTIONS, tables=detections(sd_px=1.0)))
    assert {name for name in one if one[name] != other[name]} == {"found.npz"}
    resected = input_hashes(trial(DETECTIONS, calibration=CALIBRATION + 'mend = ["cam3"]\n'))
    assert [name for name in other if other[name] != resected[name]] == ["[calibration]"]


def test_impossible_person_is_refused(trial):
    with pytest.raises(MistakesError, match=r"stature_m is 17; expected 0\.8 to 2\.5 metres"):
        trial(DETECTIONS, tables=detections(), body=BODY.replace("1.7", "17"))


def test_the_man_on_the_beam(shared_data, tmp_path):
    data = shared_data("balance")
    saved = {"cam01": "saved_scale = 1.00741\nsaved_offset_px = [0, -7.11]\n"}
    saved["cam02"] = saved["cam01"]
    text = HEAD + "".join(
        f'[[camera]]\nname = "{name}"\nvideo = "{data / name}.mp4"\n{saved.get(name, "")}'
        for name in ("cam01", "cam02", "cam03", "cam04")
    )
    text += f'[calibration]\nfile = "{data / "Calib.qca.txt"}"\n' + BODY
    text += f'[start]\ndetections = "{data / "detections_2d.npz"}"\n'
    (tmp_path / "trial.toml").write_text(text)
    asked = read_trial(tmp_path / "trial.toml")
    recording = open_trial(asked).recording
    rig = recording.rig
    assert [event.split(" with ")[0] for event in recording.events] == ["cam03 disagrees"]
    (tmp_path / "trial.toml").write_text(text.replace("[body]", 'mend = ["cam03"]\n[body]'))
    with_mend = read_trial(tmp_path / "trial.toml")
    resected, notes = resect_moved_cameras(with_mend, rig)
    assert [note.split(":")[0] for note in notes] == ["cam03"]
    static = np.array(  # white dots on the platform's left, near and far, and a post's rim, by hand; 2 px
        [
            [(318, 1335), (325, 1207), (515, 1090), (889, 1070)],
            [(110, 1060), (438, 1040), (875, 1234), (837, 1411)],
            [(668, 1520), (273, 1317), (261, 972), (832, 863)],
        ],
        float,
    )
    others = static.copy()
    others[:, 2] = np.nan
    positions = resected.points_from_px(others)
    before, after = (
        np.median(np.linalg.norm(cameras["cam03"].px_from_world(positions) - static[:, 2], axis=-1))
        for cameras in (rig, resected)
    )
    assert after < 10 < 15 < before
    result = find_first_pose(with_mend, MODEL, resected)
    joints = landmarks_over_time(with_mend, resected)
    posed = MODEL.with_pose(result.pose).landmarks
    off = [
        np.linalg.norm(posed[NAMES.index(name)] - joints[name][0]) for name in ("hip_left", "knee_right", "wrist_left")
    ]
    assert max(off) < 0.1
    assert not any("exchanged" in note for note in result.notes)
