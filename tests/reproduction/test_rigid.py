"""Paper B's somersault made anew: what is compared, how it is disturbed, and that the command leaves what it says."""

import csv
import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from airborne import cli
from airborne.body import surface_arrays
from airborne.body.outfits import PALETTE, with_flat_colours
from airborne.errors import BodyError, ResultError
from airborne.geometry.rotations import geodesic
from airborne.reproduction import (
    CASES,
    RIGID_METHODS,
    RunErrors,
    half_width,
    make_experiment,
    score_curves,
    track_experiment,
)
from airborne.reproduction.rigid import experiment
from airborne.reproduction.rigid.experiment import describe_rigid, reproduce_rigid
from airborne.reproduction.rigid.sensitivity import perturb_cameras, perturb_lights, run_case, scale_body
from airborne.reproduction.rigid.somersaults import PAPER_LARGEST, PAPER_RMS, VARIABLES
from airborne.synthetic.flight.somersault import LIGHTS
from tests.support.tolerances import EXACT, ROUNDTRIP


@pytest.fixture(scope="module")
def exact():
    """Three poses of ellipsoids."""
    return make_experiment("ellipsoids", n_poses=3)


@pytest.fixture(scope="module")
def followed(exact):
    """Their errors by the paper's own search."""
    return track_experiment(exact, "faithful")[0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What the quick command leaves."""
    folder = tmp_path_factory.mktemp("rigid") / "out"
    steps = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiment, "_QUICK", replace(experiment._QUICK, n_poses=2, n_curve_poses=1))
        reproduce_rigid(folder, quick=True, progress=lambda done, total: steps.append((done, total)))
    assert [done for done, _ in steps] == list(range(1, steps[0][1] + 1))
    return folder


def test_both_bodies_wear_one_colour_a_segment_and_no_two_the_same(exact):
    skin = make_experiment("skin", n_poses=1).scene.body
    for body in (exact.model, skin):
        assert [len(segment.parts) for segment in body.segments] == [1] * 18
    np.testing.assert_array_equal(surface_arrays(skin).colours, surface_arrays(exact.model).colours)
    assert len({*PALETTE.values()}) == 18
    light = LIGHTS.ambient + sum(lamp.intensity for lamp in LIGHTS.lamps)
    assert max(map(max, PALETTE.values())) * light < 255  # nothing is white in full light


def test_flat_colours_need_one_for_every_segment(exact):
    with pytest.raises(BodyError, match="no colour for segment 'pelvis'"):
        with_flat_colours(exact.model, {"head": (1.0, 2.0, 3.0)})


def test_errors_are_signed_in_the_papers_order_and_leave_the_lost_out():
    values = np.array([[3.0, 0, 0, 0, 0, 0], [-4.0, 1, 2, 0.3, 0.4, 0.5], [np.nan] * 6, [0, 900.0, 0, 0, 0, 0]])
    errors = RunErrors(values[:3])
    np.testing.assert_allclose(errors.rms, [np.sqrt(12.5), *np.array([1, 2, 0.3, 0.4, 0.5]) / np.sqrt(2)], atol=EXACT)
    np.testing.assert_array_equal(errors.largest, [4, 1, 2, 0.3, 0.4, 0.5])
    assert (errors.n_lost, RunErrors(values).n_lost) == (1, 2)
    assert np.isnan(RunErrors(values[2:3]).rms).all()


def test_refined_finds_the_ellipsoids_it_was_rendered_with(exact):
    errors, poses = track_experiment(exact, "refined")
    assert errors.largest[:3].max() < 0.1
    assert errors.largest[3:].max() < 0.02
    assert len(poses) == 3


def test_papers_search_follows_poses_a_tenth_of_the_movement_apart(exact, followed):
    step_rad = geodesic(*[pose.world_from_root.rotation.as_matrix() for pose in exact.poses[:2]])
    assert step_rad > np.radians(30)
    assert followed.n_lost == 0
    assert followed.rms[:3].max() < 5
    assert followed.rms[3:].max() < 0.5


def test_methods_have_the_papers_own_among_them():
    assert "faithful" in RIGID_METHODS
    assert len(PAPER_RMS) == len(PAPER_LARGEST) == len(VARIABLES) == 6


def test_score_of_the_true_body_is_lowest_at_the_truth_and_rises_on_both_sides(exact):
    for curve in score_curves(exact):
        assert curve.offset[curve.scores.argmin(axis=1)] == pytest.approx(0, abs=ROUNDTRIP)
        assert curve.scores.min() < 0.5  # rounding to whole grey levels
        assert curve.half_widths.min() > (50 if curve.variable < 3 else 10)


@pytest.mark.parametrize(
    ("values", "expected"),
    [([5, 4, 3, 0, 3, 4, 5], 3), ([5, 4, 3, 0, 3, 2, 5], 1), ([1, 4, 3, 0, 3, 4, 5], 2), ([5, 4, 0, 1, 2, 1, 5], 2)],
)
def test_half_width_ends_where_the_nearer_side_first_falls(values, expected):
    assert half_width(np.arange(-3.0, 4.0), np.array(values, float)) == expected


def test_perturbed_lights_rotate_about_the_flight_and_only_the_lamps_are_stronger():
    wrong = perturb_lights(LIGHTS, rotation_rad=np.radians(20), power=1.2)
    assert wrong.ambient == LIGHTS.ambient
    for lamp, true in zip(wrong.lamps, LIGHTS.lamps, strict=True):
        assert lamp.intensity == pytest.approx(1.2 * true.intensity)
        assert lamp.position_m[2] == pytest.approx(true.position_m[2])
        angle = np.subtract.outer(*[np.arctan2(*each.position_m[1::-1]) for each in (lamp, true)])
        assert np.degrees(angle) % 360 == pytest.approx(20)


def test_perturbed_cameras_shift_the_image_as_asked(exact):
    sd, moved = 2.0, []
    for seed in range(30):
        for true, wrong in zip(exact.frames[0].views, perturb_cameras(exact.frames, sd, seed)[0].views, strict=True):
            assert true is not None
            assert wrong is not None
            point = true.camera.camera_from_world.inv().apply([0.0, 0.0, 5.0])
            moved.append(wrong.camera.px_from_world(point) - true.camera.px_from_world(point))
    assert np.std(moved) == pytest.approx(sd, rel=3 / np.sqrt(2 * np.size(moved)))
    assert perturb_cameras(exact.frames, 0.0) is exact.frames


def test_bigger_body_is_bigger_all_over(exact):
    big = scale_body(exact.model, 1.05)
    pose = exact.poses[0]
    here, there = (body.with_pose(pose).landmarks - pose.world_from_root.translation for body in (exact.model, big))
    np.testing.assert_allclose(there, 1.05 * here, atol=2e-3)
    assert scale_body(exact.model, 1.0) is exact.model


def test_every_case_perturbs_one_thing(exact, followed):
    for case in CASES:
        wrong = (case.rotation_rad != 0, case.power != 1, case.camera_sd_px != 0, case.noise != 0, case.size != 1)
        assert sum(wrong) == 1
    big = next(case for case in CASES if case.size != 1)
    assert run_case(big, exact, "faithful").rms[:3].max() > followed.rms[:3].max()


def test_quick_run_leaves_its_files_and_says_the_same_in_each(folder):
    left = {path.name for path in folder.iterdir()}
    assert left == {
        "table.csv", "figure4.png", "convergence.png", "convergence.csv", "sensitivity.csv", "summary.json"
    }  # fmt: skip
    summary = json.loads((folder / "summary.json").read_text())
    table = csv.DictReader((folder / "table.csv").read_text().splitlines())
    rows = [row for row in table if row["method"] == "faithful"]
    written = [float(row["rms"]) for row in rows if row["target"] == "skin"]
    np.testing.assert_allclose(written, summary["skin"]["faithful"]["rms"], rtol=1e-4)
    text = describe_rigid(summary)
    assert "paper B" in text
    assert "faithful, NURBS" in text
    for name in ("figure4.png", "convergence.png"):
        assert (folder / name).read_bytes().startswith(b"\x89PNG")


def test_folder_that_holds_something_is_left_alone(folder, tmp_path):
    with pytest.raises(ResultError, match="not empty"):
        reproduce_rigid(folder, quick=True)
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultError, match="is a file"):
        reproduce_rigid(tmp_path / "file")


def test_stopped_command_says_where_the_files_are_and_exits_130(tmp_path, monkeypatch, capsys):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("airborne.reproduction.rigid.experiment.reproduce_rigid", stopped)
    monkeypatch.setattr(sys, "argv", ["airborne", "reproduce", "rigid", "-o", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == 130
    assert "stopped" in capsys.readouterr().err
