"""`airborne export`: whatever a run holds, finished or not, goes out; what is no run is refused in one line."""

import errno
import json
import re
import sys
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from pyarrow.csv import read_csv
from scipy.spatial.transform import RigidTransform, Rotation

from airborne import cli
from airborne.body import Pose
from airborne.body.files import write_body
from airborne.errors import ResultError
from airborne.evaluation import read_joint_paths
from airborne.export.takes import with_axis_markers
from airborne.io.folder_lock import sole_writer
from airborne.motion import MotionWriter, landmarks, measure_flight, read_motion, read_players
from airborne.motion.covariance_file import write_covariances
from airborne.run import export
from airborne.run.evaluate import assess
from airborne.run.export import EXPORT_FORMATS, export_run
from airborne.tracking import Estimate, Status
from tests.support.export_scenes import BOX, PERSON
from tests.support.motions import motion_of, small_covariance
from tests.support.players_trial import write_run
from tests.support.takes import tumbling
from tests.support.tolerances import EXACT

UNFINISHED = (
    "the run is not finished: these are the frames so far, `airborne track --resume` goes on; their standard "
    "deviations leave out what the self-check adds in the end"
)
MARKED = "status in .csv, sd as residual in .c3d, unmarked in .trc, .mot, .bvh and .glb"
UNCERTAIN = f"number_7: 18 of 72 points are uncertain: {MARKED}"
SUFFIXES = ["c3d", "trc", "mot", "osim", "glb", "bvh", "csv", "parquet"]


def write_body_run(folder, motion, model):
    """Leave what a run that was killed leaves: the rows so far, the last one torn, and the body."""
    folder.mkdir()
    write_body(folder / "body.toml", model)
    with MotionWriter(folder / "motion.csv", motion.joints) as writer:
        for row in range(len(motion)):
            is_lost = motion.status[row] == "lost"
            writer.append(
                Estimate(
                    index=int(motion.index[row]),
                    time_s=Fraction(motion.time_s[row]),
                    status=Status(motion.status[row]),
                    score=float(motion.score[row]),
                    pose=None if is_lost else motion.pose(row),
                    covariance=None if is_lost else motion.covariance[row],
                    n_views=2,
                )
            )
    with (folder / "motion.csv").open("a") as file:
        file.write("99,1.5,trac")
    return folder


@pytest.fixture(scope="module")
def person_run(tmp_path_factory):
    return write_body_run(tmp_path_factory.mktemp("run") / "my run", tumbling(5), PERSON)


@pytest.fixture(scope="module")
def players_run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("run") / "block")


def names(exported):
    return [path.name for path in exported.files]


def test_a_full_disk_is_told_with_the_file_and_leaves_no_torn_one(tmp_path, monkeypatch):
    def fill(path, columns):
        path.write_bytes(b"torn")
        raise OSError(errno.ENOSPC, "No space left on device")

    write_body_run(tmp_path / "run", tumbling(), PERSON)
    monkeypatch.setattr(export, "write_csv", fill)
    with pytest.raises(
        ResultError, match=r"out/run\.csv cannot be written \(No space left on device\): \d+ MB are free"
    ):
        export_run(tmp_path / "run", tmp_path / "out", ["csv"])
    assert list((tmp_path / "out").iterdir()) == []


def test_points_that_the_images_do_not_show_are_noted(tmp_path):
    motion = tumbling()
    forearm = slice(3 + 3 * PERSON.index_of("forearm_left"), 6 + 3 * PERSON.index_of("forearm_left"))
    motion.covariance[:] = 1e-4 * np.eye(PERSON.n_dofs)
    motion.covariance[2, forearm, forearm] = np.diag([np.inf] * 3)
    write_body_run(tmp_path / "run", motion, PERSON)
    notes = export_run(tmp_path / "run", tmp_path / "out", ["trc"]).notes
    n_markers = len(with_axis_markers(PERSON).landmarks)
    said = f"2 of {len(motion) * n_markers} points are unknown, what stands for them is a guess: gaps in .trc"
    assert any(note.startswith(said) for note in notes), notes


def test_a_killed_run_of_a_person_is_exported_in_every_format(person_run, tmp_path):
    exported = export_run(person_run, tmp_path / "out")
    assert names(exported) == [f"my_run.{suffix}" for suffix in SUFFIXES]
    assert exported.notes == (UNFINISHED,)
    assert all(path.stat().st_size > 0 for path in exported.files)
    paths = read_joint_paths(tmp_path / "out" / "my_run.trc")
    points, _ = landmarks(tumbling(5), PERSON)
    np.testing.assert_allclose(paths.points, points, atol=1e-6)


def test_a_body_in_one_piece_is_exported_in_every_format(tmp_path):
    folder = write_body_run(tmp_path / "throw", tumbling(5, model=BOX, lost=(0, 2)), BOX)
    exported = export_run(folder)
    assert {path.parent for path in exported.files} == {folder / "export"}
    parts = [f"throw_part{k}.{suffix}" for suffix in ("mot", "bvh") for k in (1, 2)]
    assert names(exported) == [
        "throw.c3d",
        "throw.trc",
        *parts[:2],
        "throw.osim",
        "throw.glb",
        *parts[2:],
        "throw.csv",
        "throw.parquet",
    ]
    note, unfinished = exported.notes
    assert unfinished == UNFINISHED
    assert note == "2 of 5 frames have no pose and stay gaps; .mot and .bvh are in 2 parts, one a stretch without a gap"


def test_players_share_some_files_and_have_others_each(players_run, tmp_path):
    exported = export_run(players_run, tmp_path)
    each = [f"block_{who}.{kind}" for kind in ("trc", "mot", "osim") for who in ("Anna", "number_7")]
    bvh = [f"block_{who}.bvh" for who in ("Anna", "number_7")]
    assert names(exported) == ["block.c3d", *each, "block.glb", *bvh, "block.csv", "block.parquet"]
    result = read_joint_paths(tmp_path / "block_number_7.trc")
    np.testing.assert_allclose(result.points, read_players(players_run / "joints.csv").points[:, 1], atol=1e-6)


def test_only_what_is_asked_for_is_written_and_the_rest_of_the_folder_stays(players_run, tmp_path):
    (tmp_path / "block.c3d").write_text("mine, of the same name")
    (tmp_path / "notes.txt").write_text("mine")
    assert names(export_run(players_run, tmp_path, ["csv", "c3d"])) == ["block.c3d", "block.csv"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["block.c3d", "block.csv", "notes.txt"]
    assert (tmp_path / "block.c3d").read_bytes()[1] == 0x50


def test_uneven_times_are_kept_out_of_files_without_times(tmp_path):
    motion = tumbling(5, model=BOX, rate=Fraction(50))
    motion.time_s[2] += 0.003
    folder = write_body_run(tmp_path / "run", motion, BOX)
    exported = export_run(folder)
    assert not {path.suffix for path in exported.files} & {".c3d", ".bvh"}
    assert exported.notes == (
        "frames are off an even rate by up to 0.15 frames: left out c3d, bvh, which hold no times",
        UNFINISHED,
    )
    with pytest.raises(ResultError, match=r"0\.15 frames, and c3d hold no times; write trc"):
        export_run(folder, formats=["c3d", "trc"])


def test_without_pyarrow_parquet_is_left_out_and_refused_where_asked_for(players_run, tmp_path, monkeypatch):
    monkeypatch.setattr("airborne.run.export.CAN_WRITE_PARQUET", False)
    exported = export_run(players_run, tmp_path)
    assert "block.parquet" not in names(exported) and "block.csv" in names(exported)
    advice = "Parquet needs pyarrow, which is not installed: pip install pyarrow"
    assert exported.notes == (UNCERTAIN, f"not written: {advice}")
    with pytest.raises(ResultError, match=re.escape(advice)):
        export_run(players_run, tmp_path, ["csv", "parquet"])


def test_a_run_that_has_only_begun_is_told_from_none(tmp_path):
    with sole_writer(tmp_path), pytest.raises(ResultError, match="the run there has no frame yet"):
        export_run(tmp_path)


def test_where_nothing_was_found_there_is_nothing_to_export_or_to_compare(tmp_path):
    folder = write_body_run(tmp_path / "run", tumbling(3, model=BOX, lost=(0, 1, 2)), BOX)
    with pytest.raises(ResultError, match="found in no frame"):
        export_run(folder)
    assert not (folder / "export").exists()
    with pytest.raises(ResultError, match="found in no frame, so there is nothing to compare"):
        assess(folder, tmp_path / "truth.csv", None)


def test_the_centre_of_mass_is_that_of_the_whole_run_with_lasting_errors(tmp_path):
    turns = [
        RigidTransform.from_components([0, 0, 1 + 2 * t - 9.81 / 2 * t**2], Rotation.from_rotvec([5 * t, 0, 0]))
        for t in np.arange(21) / 50
    ]
    still = np.zeros((len(PERSON.segments) - 1, 3))
    poses = [Pose(world_from_root=turn, joint_angles=still) for turn in turns]
    motion = motion_of(PERSON, poses, covariance=small_covariance(PERSON))
    folder = write_body_run(tmp_path / "run", replace(motion, time_s=np.round(motion.time_s, 6)), PERSON)
    write_covariances(folder / "lasting.bin", np.tile(1e-4 * np.eye(6), (len(motion), 1, 1)))
    export_run(folder, tmp_path, formats=["csv"])
    stored = read_motion(folder / "motion.csv")
    table = measure_flight(stored, PERSON)
    assert (table["com_sd"] > 0.01).all()
    columns = read_csv(tmp_path / "run.csv")
    for name, values in (("com_z_m", table["com"]), ("com_z_m_sd", table["com_sd"])):
        np.testing.assert_allclose(columns[name].to_numpy(), values.sel(space="z"), atol=EXACT)


def test_progress_grows_to_its_end(person_run, tmp_path):
    calls = []
    export_run(person_run, tmp_path, ["csv", "trc"], lambda *said: calls.append(said))
    assert calls == [("measuring", 5, 10), ("measuring", 10, 10), ("writing trc", 0, 2), ("writing csv", 1, 2)]


def run_command(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["airborne", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return ended.value.code or 0


def test_the_command_lists_its_files(players_run, tmp_path, monkeypatch, capsys):
    assert run_command(monkeypatch, "export", players_run, "-o", tmp_path, "--trc", "--osim") == 0
    lines = capsys.readouterr().out.splitlines()
    files = [str(tmp_path / f"block_{who}.{kind}") for kind in ("trc", "osim") for who in ("Anna", "number_7")]
    assert lines == [*files, f"note: {UNCERTAIN}"]
    assert run_command(monkeypatch, "export", players_run, "-o", tmp_path, "--gltf", "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"files": [str(tmp_path / "block.glb")], "notes": [UNCERTAIN]}


def test_every_format_has_its_option(players_run, tmp_path, monkeypatch):
    for kind in EXPORT_FORMATS:
        assert run_command(monkeypatch, "export", players_run, "-o", tmp_path / kind, f"--{kind}") == 0
        suffix = "glb" if kind == "gltf" else kind
        assert {path.suffix for path in (tmp_path / kind).iterdir()} == {f".{suffix}"}


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({}, "holds no run"),
        ({"joints.csv": "frame,time_s,joint\n"}, "has no column player, status, x_m"),
        ({"motion.csv": "a,b\n1,2\n"}, "has no column frame"),
        ({"motion.csv": b"\xff\xfe\x00"}, "motion.csv"),
        ({"joints.csv": b""}, "is empty"),
    ],
)
def test_a_folder_without_a_run_is_refused_in_one_line(files, said, tmp_path, monkeypatch, capsys):
    for name, content in files.items():
        (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
    assert run_command(monkeypatch, "export", tmp_path) == 2
    error = capsys.readouterr().err
    assert said in " ".join(error.split())
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "export").exists()


def test_a_missing_body_and_a_missing_folder_are_refused_in_one_line(person_run, tmp_path, monkeypatch, capsys):
    (tmp_path / "motion.csv").write_bytes((person_run / "motion.csv").read_bytes())
    assert run_command(monkeypatch, "export", tmp_path) == 2
    assert "body.toml is missing, the body that was tracked" in capsys.readouterr().err
    assert run_command(monkeypatch, "export", tmp_path / "nowhere") == 2
    assert "holds no run" in capsys.readouterr().err
    (tmp_path / "file").touch()
    assert run_command(monkeypatch, "export", person_run, "-o", tmp_path / "file", "--trc") == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_fewer_gaps_leave_no_older_parts(tmp_path):
    for k, lost in enumerate([(1, 3), (2,), ()]):
        folder = write_body_run(tmp_path / str(k), tumbling(5, model=BOX, lost=lost), BOX)
        folder = folder.rename(tmp_path / "run")
        written = export_run(folder, tmp_path / "out", ["mot"])
        assert {path.name for path in (tmp_path / "out").iterdir()} == set(names(written))
        folder.rename(tmp_path / f"done{k}")
