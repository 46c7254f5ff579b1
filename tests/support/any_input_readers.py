"""Every reader of the package with a whole file of its kind, for `any_input.py` to mutate."""

import contextlib
import io
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from airborne import cli
from airborne.batch.trials import list_trials
from airborne.body import human18
from airborne.body.files import read_body, write_body
from airborne.body.measurements import read_measurements
from airborne.body.mesh_files import read_mesh
from airborne.calibration.sources.boards import read_board
from airborne.calibration.sources.control_points import read_control_points
from airborne.calibration.sources.files import read_sources
from airborne.calibration.sources.wand import read_wand
from airborne.cameras import PixelConvention, read_detections, read_rig, write_rig
from airborne.cameras.clicks import read_clicks, read_positions
from airborne.cameras.detections import Detections, write_detections
from airborne.cameras.formats.dltdv import read_digitisation, triangulate_digitisation, write_digitisation
from airborne.cameras.formats.options import FileOptions
from airborne.cameras.skeletons import SKELETONS
from airborne.evaluation import read_clicked_frames, read_flight_paths, read_joint_paths, read_players_truth, read_truth
from airborne.evaluation.players_truth import read_reference_jumps
from airborne.evaluation.variables import read_joint_angles
from airborne.export.conversion import ConversionOptions, convert
from airborne.motion import MotionWriter, read_estimates, read_players
from airborne.run.evaluate import assess
from airborne.run.folder import holds_run_of
from airborne.run.players_tracker import read_torsos
from airborne.study.comparison import compare_trials
from airborne.study.trials import read_study
from airborne.tracking.players import PlayerStart
from airborne.trial.file import read_trial
from airborne.video.decoding import VideoSource, inspect
from tests.body.test_measurements import PERSON
from tests.support import players_trial as players
from tests.support.any_study import batches, clocks, studio
from tests.support.athletes import write_results
from tests.support.bodies import write_measurements
from tests.support.cameras import LENS, scattered, three_cameras
from tests.support.motions import run_with_gap
from tests.support.places import THROWN_CROSS

EXAMPLE = THROWN_CROSS
CAMERAS = ("left", "right", "side")


@dataclass(frozen=True)
class Case:
    """One kind of file: where it lies, whole, and who reads it."""

    name: str
    path: Path
    whole: bytes
    read: Callable[[], object]


# --- valid files ------------------------------------------------------------------------------------------------------


def calibrations(folder):
    rig, plain = three_cameras(LENS), three_cameras()
    for kind, name in {
        **{"pose2sim": "a.toml", "aniposelib": "b.toml", "caliscope": "c.toml", "qualisys": "d.qca.txt"},
        **{"vicon": "e.xcp", "opencv": "f.yml", "dlt": "g.csv"},
    }.items():
        path = folder / kind / name
        path.parent.mkdir()
        write_rig(path, plain if kind == "dlt" else rig, format=kind, pixels=PixelConvention("lower-left"))
        size, pixels = ((768, 576), PixelConvention("lower-left")) if kind == "dlt" else (None, None)
        yield case(f"calibration {kind}", path, lambda p=path, s=size, x=pixels: read_rig(p, size=s, pixels=x))
    write_rig(folder / "pair", rig, format="easymocap")
    yield case("calibration easymocap", folder / "pair" / "intri.yml", lambda: read_rig(folder / "pair"))
    yield case("calibration half", folder / "pair" / "extri.yml", lambda: read_rig(folder / "pair" / "extri.yml"))


def points_in_pictures(folder):
    table = folder / "table.csv"
    table.write_text("point,left_u,left_v,right_u,right_v\nhip,1.5,2,3,4\nknee,,,5.5,6\n")
    yield case("clicks", table, lambda: read_clicks(table, CAMERAS))
    places = folder / "places.csv"
    places.write_text("joint,x_m,y_m,z_m\nhip,0.1,0.2,1.0\nknee,,,\n")
    yield case("places", places, lambda: read_positions(places))
    rig = three_cameras()
    px = np.stack([camera.px_from_world(scattered(5 * 26).reshape(5, 26, 3)) for camera in rig], axis=2)
    points = SKELETONS["HALPE_26"].points
    seen = Detections(cameras=rig.names, points=points, px=px, visibility=np.full(px.shape[:-1], 0.9))
    npz = folder / "detections.npz"
    write_detections(npz, seen)
    yield case("detections npz", npz, lambda: read_detections(npz, CAMERAS))
    pose = folder / "pose"
    write_detections(pose, seen, as_folder=True)
    yield case("detections OpenPose", pose / "left_json" / "left_000002.json", lambda: read_detections(pose, CAMERAS))
    few = Detections.from_clicks(rig.names, ("a", "b"), px[:, :2])
    xypts = folder / "t_xypts.csv"
    write_digitisation(xypts, triangulate_digitisation(few, rig), FileOptions())
    yield case("DLTdv xypts", xypts, lambda: read_digitisation(xypts, FileOptions()))
    xyz = folder / "t_xyzpts.csv"
    yield case("DLTdv xyzpts", xyz, lambda: read_digitisation(xypts, FileOptions()))
    sources = folder / "sources.toml"
    sources.write_text(
        '[[camera]]\nname = "left"\nsize = [768, 576]\n[[camera]]\nname = "right"\nsize = [768, 576]\n'
        '[wand]\nfile = "wand.csv"\nlength_m = 0.5\n[world]\nframe = "camera"\n'
    )
    yield case("sources", sources, lambda: read_sources(sources))
    wand = folder / "wand.csv"
    wand.write_text("frame,marker,camera,u_px,v_px\n0,1,left,5,6\n0,2,left,7,8\n1,1,right,,\n")
    yield case("wand", wand, lambda: read_wand(wand, CAMERAS, FileOptions(), [0.5]))
    board = folder / "board.toml"
    board.write_text('kind = "charuco"\ncolumns = 4\nrows = 5\nsquare_m = 0.054\ndictionary = "DICT_4X4_50"\n')
    yield case("board", board, lambda: read_board(board))
    yield example_case("control points", folder, "control_points.csv", read_control_points)
    yield example_case("digitised", folder, "digitised.csv", lambda p: read_clicked_frames(p, ("cam1", "cam2", "cam3")))
    out = folder / "converted"
    copy = folder / "any_xypts.csv"
    copy.write_bytes(xypts.read_bytes())
    yield case("convert points", copy, lambda: convert(copy, out, ConversionOptions(to="digitised")))
    some = folder / "some.toml"
    write_rig(some, three_cameras(LENS))
    yield case("convert cameras", some, lambda: convert(some, out, ConversionOptions(to="vicon")))


def bodies(folder):
    person = folder / "person.toml"
    write_body(person, human18())
    yield case("body", person, lambda: read_body(person))
    cube = folder / "cube.toml"
    cube.write_text(
        'name = "cube"\n[[segment]]\nname = "cube"\njoint_m = [0, 0, 0]\n[[segment.part]]\nname = "skin"\n'
        'shape = "mesh"\nfile = "MESH"\ncolour_srgb = [1, 0, 0]\n'
    )
    import trimesh

    for kind in ("obj", "ply", "stl"):
        mesh, body = folder / f"cube.{kind}", folder / f"cube_{kind}.toml"
        trimesh.creation.box((0.5, 0.5, 0.5)).export(mesh)
        body.write_text(cube.read_text().replace("MESH", mesh.name))
        yield case(f"mesh.{kind}", mesh, lambda b=body: read_body(b))
    measured = folder / "athlete.txt"
    write_measurements(measured, PERSON)
    yield case("measurements", measured, lambda: read_measurements(measured))
    ascii_stl = folder / "cube_ascii.stl"
    trimesh.creation.box((0.5, 0.5, 0.5)).export(ascii_stl, file_type="stl_ascii")
    yield case("mesh.ascii.stl", ascii_stl, lambda: read_mesh(ascii_stl, 1.0))


def trials(folder):
    for name in ("calib_true.toml", "control_points.csv", "cross.toml", "digitised.csv"):
        (folder / name).write_bytes((EXAMPLE / name).read_bytes())
    for name in ("cam1.mp4", "cam2.mp4", "cam3.mp4"):
        (folder / name).touch()

    def whole(path):
        trial = read_trial(path)
        return trial.start.player if trial.has_players else (trial.settings, trial.model())

    yield example_case("trial", folder, "trial.toml", whole)
    shared = folder / "shared"
    shared.mkdir()
    for name in ("calib_true.toml", "cross.toml"):
        (shared / name).write_bytes((EXAMPLE / name).read_bytes())
    (shared / "one.toml").write_text('session = "session.toml"\nlabels = { athlete = "anna", n = 1 }\n')
    (shared / "session.toml").write_text(
        'camera = [{ name = "left", video = "{athlete}_{n}.mp4" }]\ncalibration = { file = "calib_true.toml" }\n'
        'body = { preset = "human18", stature_m = 1.7, mass_kg = 60 }\n[athletes.anna.body]\nfile = "cross.toml"\n'
    )
    yield case("session", shared / "session.toml", lambda: whole(shared / "one.toml"))
    yield case("trial of a session", shared / "one.toml", lambda: whole(shared / "one.toml"))
    (shared / "trials.csv").write_text("trial,athlete,condition\none,anna,dry\nother.toml,berta,wet\n")
    yield case("table of trials", shared / "trials.csv", lambda: list_trials(str(shared)))
    legs = folder / "legs"
    legs.mkdir()
    write_rig(legs / "calib.toml", players.rig())
    (legs / "trial.toml").write_text(players.trial_text())
    yield case("trial of players", legs / "trial.toml", lambda: whole(legs / "trial.toml"))
    torsos = folder / "torsos.csv"
    torsos.write_text("player,frame,x_m,y_m,z_m\nAnna,0,0.1,0.2,1.2\nAnna,3,,,\nBea,0,1,1,1\n")
    starts = [PlayerStart(name=name, joints_m={"torso": np.zeros(3)}) for name in ("Anna", "Bea")]
    yield case("torsos", torsos, lambda: read_torsos(torsos, starts, first=0))
    run = folder / "run"
    run.mkdir()
    (run / "run.json").write_text('{"inputs": {"a": "b"}, "settings": {}, "version": "1"}')
    videos = folder / "with videos"
    videos.mkdir()
    for path in EXAMPLE.iterdir():
        if path.is_file():
            (videos / path.name).write_bytes(path.read_bytes())
    yield case("run record", run / "run.json", lambda: holds_run_of(read_trial(videos / "trial.toml"), run))
    video = folder / "video.mp4"
    video.write_bytes((EXAMPLE / "cam1.mp4").read_bytes())
    yield case("video", video, lambda: inspect(VideoSource("cam1", video)))


def results(folder):
    rigid, jointed = folder / "rigid", folder / "jointed"
    for run, joints in ((rigid, ()), (jointed, ("arm", "leg"))):
        run.mkdir()
        with MotionWriter(run / "motion.csv", joints) as writer:
            for estimate in run_with_gap(n_joints=len(joints)):
                writer.append(estimate)
    yield case("motion", rigid / "motion.csv", lambda: read_estimates(rigid / "motion.csv"))
    yield case("motion with joints", jointed / "motion.csv", lambda: read_estimates(jointed / "motion.csv"))
    yield case("covariances", jointed / "covariance.bin", lambda: read_estimates(jointed / "motion.csv"))
    of_players = players.write_run(folder / "players")
    truth = players.write_truth(folder / "truth_of_players.csv")
    yield case("joints of players", of_players / "joints.csv", lambda: read_players(of_players / "joints.csv"))
    yield case("truth of players", truth, lambda: read_players_truth(truth))
    assessed, their_truth = players.write_run(folder / "assessed"), players.write_truth(folder / "theirs.csv")
    yield case("run summary", assessed / "summary.json", lambda: assess(assessed, their_truth, None))
    yield example_case("truth", folder, "truth.csv", read_truth)
    jumps = folder / "players.json"
    jumps.write_text('[{"name": "Anna", "jump": {"flight_s": 0.5, "last_contact_frame": 3.5}}, {"name": "Bea"}]')
    yield case("known jumps", jumps, lambda: read_reference_jumps(jumps))
    long = folder / "joints.csv"
    long.write_text("time_s,joint,x_m,y_m,z_m\n0,hip,1,2,3\n0,knee,1,2,\n0.02,hip,1,2,3\n0.02,knee,,,\n")
    yield case("paths of joints", long, lambda: read_joint_paths(long))
    trc = folder / "paths.trc"
    trc.write_text(
        "PathFileType\t4\t(X/Y/Z)\tpaths.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n50\t50\t2\t2\tm\n"
        "Frame#\tTime\tRHip\t\t\tLHip\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n1\t0.0\t1\t2\t3\tNaN\tNaN\tNaN\n"
        "2\t0.02\t1\t2\t3\t4\t5\t6\n"
    )
    yield case("TRC", trc, lambda: read_joint_paths(trc))
    flight = folder / "flight.csv"
    flight.write_text("time_s,com_x_m,com_y_m,com_z_m,somersault_deg\n0,0.1,0.2,1.3,5\n0.02,0.1,,1.4,9\n")
    yield case("flight", flight, lambda: read_flight_paths(flight))
    angles = folder / "angles.csv"
    angles.write_text("time_s,knee_x_rad,knee_y_rad,knee_z_rad\n0,0.1,0.2,0.3\n0.02,0.1,,0.3\n")
    yield case("joint angles", angles, lambda: read_joint_angles(angles))
    throws = [(f"{who}{what}", who, what) for who in ("anna", "bea") for what in ("dry", "wet")]
    rows = [{"trial": name, "athlete": who, "condition": what, "rise_m": len(name)} for name, who, what in throws]
    batch = write_results(folder / "batch", rows, {name: [0.0, 90.0, 200.0, 270.0] for name, _, _ in throws})
    yield case("table of a batch", batch / "trials.csv", lambda: compare_trials(read_study(batch), "rise_m", ()))
    compare_curves = partial(compare_trials, variable="somersault_deg", events=("start", "end"))
    tables = batch / "annadry" / "tables" / "angles.csv"
    yield case("curve of a study", tables, lambda: compare_curves(read_study(batch)))


def commands(folder):
    calib = folder / "calib.toml"
    write_rig(calib, three_cameras(LENS))

    def run():
        words = ["convert", str(calib), str(folder / "out.xcp")]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            sys.argv = ["airborne", *words]
            try:
                cli.main()
            except SystemExit as left:
                if left.code not in (0, 2, None):
                    raise ValueError(f"exit code {left.code}") from left

    yield case("command line", calib, run)


def case(name, path, read):
    return Case(name, path, path.read_bytes(), read)


def example_case(name, folder, file, read):
    (folder / file).write_bytes((EXAMPLE / file).read_bytes())
    return case(name, folder / file, lambda: read(folder / file))


def cases(folder):
    for i, make in enumerate((calibrations, points_in_pictures, bodies, trials, results, commands)):
        inner = folder / f"{i}"
        inner.mkdir()
        yield from make(inner)
    for make in (studio, batches, clocks):
        inner = folder / make.__name__
        inner.mkdir()
        for name, path, read in make(inner):
            yield case(name, path, read)
