"""The block-jump paper's table made anew: what is tracked and how, that a stopped run goes on, and what it leaves."""

import csv
import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from airborne import cli
from airborne.errors import ResultError, TrialError
from airborne.reproduction.block import experiment, plan, tracking
from airborne.reproduction.block import takes as takes_module
from airborne.reproduction.block.experiment import describe_blockjump, reproduce_blockjump
from airborne.reproduction.block.plan import FULL, PAPER_PARTS, PAPER_SUCCESS, QUICK, BlockRun, BlockTake, Plan
from airborne.reproduction.block.table import markdown
from airborne.reproduction.block.takes import do_takes
from airborne.reproduction.block.tracking import hand_set_starts, track_scene, true_motion
from airborne.synthetic import block_frames, block_scene, noisy_starts
from airborne.tracking.particle import LegsSettings, legs_tracker
from tests.support.tolerances import EXACT, sampled

SHORT = 4
TINY = Plan(
    numbers=(11, 21),
    n_seeds=1,
    n_particles=50,
    has_variants=True,
    sweep=(50, 60),
    sweep_numbers=(21,),
    n_sweep_seeds=1,
)


@pytest.fixture(scope="module")
def scene():
    """Two blockers, a spiker and one more, four frames."""
    scene = block_scene(1011, n_blockers=2, n_frames=75)
    return replace(scene, players=scene.players[:4], n_frames=SHORT)


@pytest.fixture(scope="module")
def all_frames(scene):
    """The scene's frames, rendered once."""
    return list(block_frames(scene))


@pytest.fixture(scope="module")
def tiny(scene, all_frames):
    """Plans whose sequences are four frames of one scene, as a context for `reproduce_blockjump`."""
    patch = pytest.MonkeyPatch()
    patch.setattr(tracking, "block_frames", lambda _: iter(all_frames))
    patch.setattr(experiment, "QUICK", TINY)
    patch.setattr(BlockTake, "scene", lambda _: scene)
    patch.setattr(plan, "paper_lengths", lambda _: (np.full(22, SHORT), np.full(22, 2)))
    yield
    patch.undo()


def track_once(known):
    """Return `track_scene` of the one scene that gives what is known, after its reports of progress."""

    def track(scene, runs, progress):
        if runs not in known:
            known[runs] = track_scene(scene, runs, progress)
            return known[runs]
        for _ in range(SHORT):
            progress()
        return known[runs]

    return track


@pytest.fixture(scope="module")
def tracked():
    """What was tracked, by runs."""
    return {}


@pytest.fixture(scope="module")
def done(tiny, tracked, tmp_path_factory):
    """A folder with a finished run, its reports of progress, and its summary."""
    folder, reports = tmp_path_factory.mktemp("block") / "out", []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(takes_module, "track_scene", track_once(tracked))
        summary = reproduce_blockjump(folder, True, lambda *now: reports.append(now), n_processes=1)
    return folder, reports, summary


def test_full_form_is_the_papers_22_sequences_with_1798_frames_and_five_of_several_blockers():
    takes = FULL.takes()
    assert len(takes) == 22
    assert sum(take.n_frames for take in takes) == 1798
    assert sum(take.n_blockers > 1 for take in takes) == 5
    assert sorted(take.number for take in takes) == list(range(22))
    for take in takes:
        assert {run.seed for run in take.runs if run.method == "blocker"} == set(range(5))
        assert {run.method for run in take.runs} == {*PAPER_SUCCESS, "blocker"}
        assert len({run.key for run in take.runs}) == len(take.runs)


def test_sweep_of_the_full_form_goes_from_100_to_5000_particles():
    swept = [take for take in FULL.takes() if take.number in FULL.sweep_numbers]
    counts = {run.n_particles for take in swept for run in take.runs if run.row == "block-jump"}
    assert counts == set(FULL.sweep)
    assert (min(counts), max(counts)) == (100, 5000)
    assert any(take.n_blockers > 1 for take in swept)


def test_quick_form_has_a_sequence_with_one_and_one_with_two_blockers():
    assert sorted(take.n_blockers for take in QUICK.takes()) == [1, 2]


def test_seed_perturbs_the_hand_set_joints_and_nothing_else(scene):
    own = {name: joints["hip_left"] for name, joints in noisy_starts(scene).items() if "hip_left" in joints}
    starts = [hand_set_starts(scene, seed) for seed in range(20)]
    for start in starts[0]:
        if start.name in own:
            np.testing.assert_array_equal(start.joints_m["hip_left"], own[start.name])
    truth = true_motion(scene)
    true = truth.points[0, 0, truth.joints.index("knee_right")]
    errors = np.array([each[0].joints_m["knee_right"] - true for each in starts])
    assert len(np.unique(errors)) == errors.size
    sd_m = scene.difficulty.start_noise_m
    assert errors.std() == pytest.approx(sd_m, rel=sampled(errors.size))


def test_torsos_tracked_once_for_three_filters_are_those_that_each_would_track_for_itself(scene, all_frames, tiny):
    runs = [BlockRun(method=method, seed=3, n_particles=50) for method in PAPER_SUCCESS]
    frames = []
    shared = track_scene(scene, runs, lambda: frames.append(1))
    assert len(frames) == SHORT
    settings = LegsSettings(method="mixture", seed=3, n_particles=50)
    tracker = legs_tracker(settings, scene.calibrated_rig, hand_set_starts(scene, 3))
    state, alone = tracker.init(), []
    for each in all_frames:
        state, estimates = tracker.step(state, each)
        alone.append([estimate.points for estimate in estimates])
    np.testing.assert_array_equal(shared.motions[runs[1]].points, alone)


def test_true_motion_has_every_player_with_blockers_first(scene):
    truth = true_motion(scene)
    assert truth.players == tuple(player.name for player in scene.players)
    assert truth.joints[: len(PAPER_PARTS)] == PAPER_PARTS
    thigh_m = np.linalg.norm(truth.points[:, :, 0] - truth.points[:, :, 2], axis=-1)
    np.testing.assert_allclose(thigh_m, np.broadcast_to(thigh_m[0], thigh_m.shape), atol=1e-9)


def test_run_leaves_its_files_and_says_the_same_in_each(done):
    folder, reports, summary = done
    assert reports == [(k + 1, 2 * SHORT) for k in range(2 * SHORT)]
    left = {path.name for path in folder.iterdir()}
    figures = {"success.png", "worst.png", "sweep.png"}
    assert left == {"plan.json", "sequences", "table1.csv", "table.md", "summary.json", *figures}
    for name in figures:
        assert (folder / name).read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in (folder / "sequences").iterdir()} == {"11.json", "11.npz", "21.json", "21.npz"}
    stored = json.loads((folder / "summary.json").read_text())
    rows = list(csv.DictReader((folder / "table1.csv").read_text().splitlines()))
    assert len(rows) == 6 * len(PAPER_PARTS)
    reports = [float(row["success_percent"]) for row in rows if row["row"] == "blocker"]
    np.testing.assert_allclose(reports, 100 * np.array(stored["rows"]["blocker"]["success"]["mean"]), rtol=1e-4)
    assert stored["n_frames"] == 2 * SHORT
    assert stored["n_player_frames"] == 4 * SHORT
    assert stored["jumps"]["blocker"]["n"] == 0
    text = (folder / "table.md").read_text()
    assert text == markdown(summary)
    for said in ("paper's `framework`", "may be off by [m]", "`block-jump`, torsos given", "| 93.9 | 93.8 |"):
        assert said in text
    assert describe_blockjump(summary) in text


def test_hand_set_joints_are_a_success_in_every_method_and_off_by_their_noise(done):
    folder, _, summary = done
    for name in summary["rows"]:
        assert min(summary["rows"][name]["success"]["mean"]) > 0.2, name  # one frame of four at least
    with np.load(folder / "sequences" / "21.npz") as stored:
        first = np.linalg.norm(stored["mixture-tracked-50-0/0"][0] - stored["truth/0"][0], axis=-1)
    assert 0.005 < first.mean() < 0.05


def test_run_goes_on_with_the_sequences_that_are_missing_and_gives_the_same(done, tiny, monkeypatch, tmp_path):
    folder, _, summary = done
    again = tmp_path / "again"
    (again / "sequences").mkdir(parents=True)
    (again / "plan.json").write_text((folder / "plan.json").read_text())
    for name in ("11.json", "11.npz"):
        (again / "sequences" / name).write_bytes((folder / "sequences" / name).read_bytes())
    tracked = []
    monkeypatch.setattr(takes_module, "track_scene", lambda *args: tracked.append(args[0].name) or track_scene(*args))
    monkeypatch.setattr(experiment, "write_block_figures", lambda *_: None)
    reports = []
    resumed = reproduce_blockjump(again, True, lambda *now: reports.append(now), n_processes=1)
    assert len(tracked) == 1
    assert reports[0] == (SHORT + 1, 2 * SHORT)
    for name, row in summary["rows"].items():
        np.testing.assert_allclose(resumed["rows"][name]["mean_mm"]["mean"], row["mean_mm"]["mean"], atol=EXACT)


def test_stopped_run_leaves_whole_sequences_only(done, tracked, monkeypatch, tmp_path):
    monkeypatch.setattr(takes_module, "track_scene", track_once(tracked))

    def stop_in_the_second(done, _):
        if done > SHORT + 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reproduce_blockjump(tmp_path / "out", True, stop_in_the_second, n_processes=1)
    assert len(list((tmp_path / "out" / "sequences").glob("*.json"))) == 1


def test_folder_of_another_plan_or_with_anything_else_is_left_alone(done, tiny, tmp_path):
    folder, _, _ = done
    with pytest.raises(ResultError, match="other choices"):
        reproduce_blockjump(folder, True, n_seeds=2)
    (tmp_path / "other").write_text("")
    with pytest.raises(ResultError, match="not empty"):
        reproduce_blockjump(tmp_path, True)
    with pytest.raises(ResultError, match="is a file"):
        reproduce_blockjump(tmp_path / "other", True)


def test_stopped_command_says_how_to_go_on_and_exits_130(tmp_path, monkeypatch, capsys):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("airborne.reproduction.block.experiment.reproduce_blockjump", stopped)
    monkeypatch.setattr(sys, "argv", ["airborne", "reproduce", "blockjump", "-o", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == 130
    assert "to resume" in capsys.readouterr().err


def test_what_goes_wrong_in_another_process_is_raised_here(tmp_path, monkeypatch):
    pool = takes_module.ProcessPoolExecutor
    monkeypatch.setattr(takes_module, "ProcessPoolExecutor", lambda n, *options: pool(1, *options))  # one is enough
    takes = [BlockTake(number=k, scene_seed=k, n_blockers=1, n_frames=10, runs=()) for k in range(2)]
    with pytest.raises(TrialError, match="too few"):
        do_takes(tmp_path / "sequences", takes, n_processes=2)
    assert list((tmp_path / "sequences").iterdir()) == []
