"""Trials of several players: what is read, and what is refused in one line."""

import re
from contextlib import nullcontext
from typing import get_args

import numpy as np
import pytest

from airborne.errors import TrialError
from airborne.run.players_tracker import player_starts, players_tracker_of, read_torsos
from airborne.tracking.capsules import Blocker
from airborne.tracking.methods import UNREAD_SETTINGS
from airborne.tracking.particle import LegsTracker
from airborne.trial.file import read_trial
from airborne.trial.settings import BodySettings, ParticleSettings
from tests.support.players_trial import BYSTANDER, PLAYERS, rig, trial_text


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "calib.toml").write_text("")
    return tmp_path


def read(folder, text, **kwargs):
    (folder / "trial.toml").write_text(text, encoding="utf-8")
    return read_trial(folder / "trial.toml", **kwargs)


def complaint(folder, text, **kwargs):
    with pytest.raises(TrialError) as caught:
        read(folder, text, **kwargs)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_players_and_bystanders_are_read_with_their_points(folder):
    trial = read(folder, trial_text())
    assert trial.has_players
    assert [start.name for start in player_starts(trial, rig())] == [*PLAYERS, BYSTANDER]
    anna, _, referee = player_starts(trial, rig())
    np.testing.assert_array_equal(anna.joints_m["knee_left"], [-0.72, 0.0, 0.5])
    assert list(referee.joints_m) == ["torso"]


@pytest.mark.parametrize("inline", [True, False])
def test_clicked_players_start_where_the_clicks_of_two_cameras_meet(folder, inline):
    text, metres = trial_text(), player_starts(read(folder, trial_text()), rig())
    head = text[: text.index("[[start.player]]")]
    for start in metres:
        clicks = {
            point: {c.name: c.px_from_world(at).round(3).tolist() for c in rig()}
            for point, at in start.joints_m.items()
        }
        if inline:
            head += f'[[start.player]]\nname = "{start.name}"\n[start.player.points_px]\n'
            for point, by_camera in clicks.items():
                head += f"{point} = {{ " + ", ".join(f"{name} = {px}" for name, px in by_camera.items()) + " }\n"
        else:
            head += f'[[start.player]]\nname = "{start.name}"\npoints_px = "{start.name}.csv"\n'
            rows = [",".join(["point", *(f"{c.name}_{axis}" for c in rig() for axis in "uv")])]
            rows += [",".join([point, *(str(n) for px in by.values() for n in px)]) for point, by in clicks.items()]
            (folder / f"{start.name}.csv").write_text("\n".join(rows))
    for clicked, start in zip(player_starts(read(folder, head), rig()), metres, strict=True):
        assert clicked.name == start.name
        for point, at in start.joints_m.items():
            np.testing.assert_allclose(clicked.joints_m[point], at, atol=1e-3)


def test_a_point_clicked_in_one_camera_only_is_refused(folder):
    text = trial_text()
    head = text[: text.index("[[start.player]]")]
    points = read(folder, text).start.player[0].joints_m
    table = ", ".join(f"{point} = {{ left = [100.0, 100.0] }}" for point in points)
    trial = read(folder, f'{head}[[start.player]]\nname = "anna"\npoints_px = {{ {table} }}\n')
    with pytest.raises(TrialError, match="no two cameras agree where torso"):
        player_starts(trial, rig())


@pytest.mark.parametrize(("apart_m", "is_refused"), [(0.0, True), (0.1, True), (0.2, False)])
def test_two_players_in_one_place_are_refused(folder, apart_m, is_refused):
    text = trial_text()
    twin = f"\n[[start.player]]\nname = 'twin'\njoints_m = {{torso = [{-0.6 + apart_m}, 0.0, 1.2]}}\n"
    with pytest.raises(TrialError, match="'Anna' and 'twin' are in one place") if is_refused else nullcontext():
        player_starts(read(folder, text + twin), rig())


def test_a_player_whose_axes_are_exchanged_is_told_so(folder):
    exchanged = re.sub(r"= \[([-\d.]+), ([-\d.]+), ([-\d.]+)\]", r"= [\1, \3, \2]", trial_text())
    assert "the legs lie along y, not along z: were axes exchanged? z must point up" in complaint(folder, exchanged)


def test_legs_are_tracked_by_blocker_by_default(folder):
    assert read(folder, trial_text()).track.method == "blocker"
    assert read(folder, trial_text(track='method = "mixture"')).track.method == "mixture"
    assert read(folder, trial_text(), track={"method": "framework"}).track.method == "framework"
    assert read(folder, trial_text().replace("[track]\n", "")).track.method == "blocker"


def test_a_method_gets_only_the_settings_it_reads(folder):
    of_filter = read(folder, trial_text(track='method = "block-jump"\nseed = 3\nn_particles = 200')).track.model_dump()
    assert set(of_filter) == {
        *("method", "every", "stop", "overlay"),
        *("n_particles", "seed", "swing", "estimate", "views", "tempered"),
        *("torso_shift", "resample", "resample_when", "torso"),
    }
    assert (of_filter["seed"], of_filter["n_particles"], of_filter["estimate"]) == (3, 200, None)
    assert set(read(folder, trial_text()).track.model_dump()) == {"method", "every", "stop", "overlay"}


def test_settings_of_the_filters_may_stay_in_a_file_tracked_by_blocker(folder):
    text = trial_text(track='method = "mixture"\nseed = 3')
    assert "seed" not in read(folder, text, track={"method": "blocker"}).track.model_dump()


def test_the_shared_clip_is_read_as_it_is(shared_data):
    trial = read_trial(shared_data("block_jump") / "trial.toml")
    (blocker,) = player_starts(trial, rig())
    assert (blocker.name, len(blocker.joints_m), trial.track.method) == ("blocker1", 9, "blocker")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'preset = "legs"',
            'preset = "human18"\nstature_m = 1.8\nmass_kg = 70',
            "[[start.player]] goes with body preset",
        ),
        ('preset = "legs"', 'preset = "legs"\nstature_m = 1.8', "takes no stature_m"),
        ("[track]", '[track]\nmethod = "refined"', 'does not go with preset "legs"; use one of: blocker, block-jump'),
        ("[track]", '[track]\nv_rule = "v_sym"', "track: v_rule: not read by method 'blocker'; remove it"),
        ("[track]", "[lights]\nambient = 0.5\n[track]", "[lights]"),
        ("[track]", "[track]\nmethod = 'mixture'\nn_particles = 3", "track.n_particles"),
        ("[track]", "[track]\nmethod = 'mixture'\nseed = -1", "track.seed"),
        ("[track]", '[track]\nmethod = "mixture"\nswing = "wild"', "track.swing"),
        ("[track]", '[track]\noverlay = "fancy"', "track.overlay"),
        ("[track]", '[track]\nmethod = "mixture"\ntorso = "torso.csv"', "torso.csv not found in "),
        ('"number 7"', '"Anna"', "two players share a name: Anna, Anna, referee"),
        (
            '"number 7"',
            '"a, b"',
            "start.player 'a, b': name: must not contain a comma or a quote; rename 'a, b'",
        ),
        ('"number 7"', '""', "start.player 2: name: a name has 1 to 80 characters"),
        ("knee_left =", "knie_left =", "player 'Anna': no point knie_left; there are: torso, hip_left"),
        ("knee_left = [-0.72, 0.0, 0.5]\n", "", "player 'Anna': joints_m has no knee_left; give all of torso"),
        ("torso = [-0.6, 0.0, 1.2]\n", "", "player 'Anna': joints_m has no torso"),
        (
            "knee_left = [-0.72, 0.0, 0.5]",
            "knee_left = [-720, 0, 500]",
            "player 'Anna': knee_left = [",
        ),
        ("knee_left = [-0.72, 0.0, 0.5]", "knee_left = [-0.72, 3.0, 0.5]", "player 'Anna': a thigh of"),
        ("knee_left = [-0.72, 0.0, 0.5]", "knee_left = [-0.72, 0.0]", "knee_left: holds 2 values, expected 3"),
        (
            "knee_left = [-0.72, 0.0, 0.5]",
            'knee_left = [-0.72, 0.0, "a"]',
            "knee_left, value 3: expected a number (found",
        ),
        ("hip_left = [-0.72, 0.0, 0.9]", "hip_left = [-0.72, 0.0, 0.05]", "a hip lies lower than an ankle"),
        ("ankle_left = [-0.72, 0.0, 0.1]", "ankle_left = [-0.72, 0.0, -0.35]", "0.35 m under the floor"),
        ("torso = [-0.6, 0.0, 1.2]", "torso = [0.2, 0.0, 1.2]", "lies 0.85 m from the hips; is it another's?"),
        ("[start]", "[start]\nposition_m = [0, 0, 1]", "of several players [[start.player]] tables"),
    ],
)
def test_what_cannot_be_tracked_is_refused_in_one_line(folder, old, new, said):
    text = trial_text()
    assert old in text
    assert said in complaint(folder, text.replace(old, new, 1))


def test_legs_without_players_and_players_who_all_stand_by_are_refused(folder):
    text = trial_text()
    alone = text[: text.index("[[start.player]]")] + "position_m = [0, 0, 1]\nquaternion_xyzw = [0, 0, 0, 1]\n"
    assert "needs [[start.player]] tables" in complaint(folder, alone)
    torsos = text[: text.index("[[start.player]]")] + '[[start.player]]\nname = "a"\njoints_m = {torso = [0, 0, 1]}\n'
    assert "every player is a bystander" in complaint(folder, torsos)
    columns = ",".join(f"{camera.name}_u,{camera.name}_v" for camera in rig())
    px = ",".join(f"{u},{v}" for u, v in (camera.px_from_world([0, 0, 1.0]) for camera in rig()))
    (folder / "a.csv").write_text(f"point,{columns}\ntorso,{px}\n")
    in_a_table = read(folder, torsos.replace("joints_m = {torso = [0, 0, 1]}", 'points_px = "a.csv"'))
    with pytest.raises(TrialError, match="every player is a bystander"):
        players_tracker_of(in_a_table, rig())


def test_settings_of_legs_are_refused_for_a_body(folder, thrown_cross):
    text = (thrown_cross / "trial.toml").read_text(encoding="utf-8").replace("[track]", "[track]\nseed = 1", 1)
    for name in ("control_points.csv", "cross.toml"):
        (folder / name).write_bytes((thrown_cross / name).read_bytes() if (thrown_cross / name).exists() else b"")
    assert "track: seed: not read by method 'refined'" in complaint(folder, text)


def test_a_trial_of_players_has_no_body(folder):
    with pytest.raises(TrialError, match="needs one whole body"):
        read(folder, trial_text()).model()


@pytest.mark.parametrize(
    ("method", "kind"), [("blocker", Blocker), ("block-jump", LegsTracker), ("mixture", LegsTracker)]
)
def test_the_tracker_is_that_of_the_method(folder, method, kind):
    assert isinstance(players_tracker_of(read(folder, trial_text(track=f'method = "{method}"')), rig()), kind)


def test_settings_reach_the_filter(folder):
    track = 'method = "block-jump"\nseed = 3\nn_particles = 200\nswing = "literal"\nestimate = "mean"'
    settings = players_tracker_of(read(folder, trial_text(track=track)), rig()).settings
    assert (settings.method, settings.seed, settings.n_particles) == ("block-jump", 3, 200)
    assert (settings.swing, settings.estimate) == ("literal", "mean")
    track = 'method = "mixture"\nviews = "robust"\ntempered = true\ntorso_shift = true\nresample = "residual"'
    settings = players_tracker_of(read(folder, trial_text(track=track + '\nresample_when = "ess"')), rig()).settings
    assert (settings.views, settings.tempered, settings.torso_shift) == ("robust", True, True)
    assert (settings.resample, settings.resample_when) == ("residual", "ess")


def test_a_player_whom_no_camera_sees_is_refused_and_a_bystander_is_not(folder):
    text = trial_text()
    away = text.replace("[0.0, 2.0, 1.3]", "[0.0, -50.0, 1.3]")
    players_tracker_of(read(folder, away), rig())
    gone = text.replace("0.0, 0.9]", "90.0, 0.9]").replace("0.0, 0.5]", "90.0, 0.5]").replace("0.0, 0.1]", "90.0, 0.1]")
    gone = gone.replace("0.0, 1.2]", "90.0, 1.2]").replace("[-0", "[-80").replace("[0.", "[80.")
    with pytest.raises(TrialError, match="player 'Anna' lies in no camera's image"):
        players_tracker_of(read(folder, gone), rig())


TORSOS = "player,frame,x_m,y_m,z_m\n" + "".join(
    f"{name},{frame},{x + 0.01 * frame},0.0,1.2\n"
    for frame in (2, 3, 5)
    for name, x in {**PLAYERS, BYSTANDER: 0.0, "stranger": 9.0}.items()
)


def test_given_torsos_follow_the_players_order_and_hold_over_gaps(folder):
    (folder / "torso.csv").write_text(TORSOS)
    trial = read(folder, trial_text(start="frame = 2", track='method = "mixture"\ntorso = "torso.csv"'))
    starts = player_starts(trial, rig())
    given = read_torsos(folder / "torso.csv", starts, first=2)
    assert given.positions.shape == (4, 3, 3)
    np.testing.assert_allclose(
        given.positions[[0, 1, 3], :, 0], [[-0.58, 0.62, 0.02], [-0.57, 0.63, 0.03], [-0.55, 0.65, 0.05]]
    )
    assert np.isnan(given.positions[2]).all()


def test_torsos_of_a_joints_table_are_those_of_its_torso_rows(folder):
    rows = "".join(
        f"{name},0,torso,{x},0.0,1.2\n{name},0,hip_left,9,9,9\n" for name, x in {**PLAYERS, BYSTANDER: 0.0}.items()
    )
    (folder / "joints.csv").write_text("player,frame,joint,x_m,y_m,z_m\n" + rows)
    given = read_torsos(folder / "joints.csv", player_starts(read(folder, trial_text()), rig()), first=0)
    np.testing.assert_array_equal(given.positions[0, :, 0], [*PLAYERS.values(), 0.0])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("player,frame,x_m\n", "no column y_m, z_m"),
        (TORSOS.replace("Anna,2,", "Anna,1,"), "no torso of Anna at frame 2"),
        (TORSOS.replace("Anna,2,-0.58", "Anna,2,west"), "not a table of torsos"),
        (TORSOS.replace("Anna,2,-0.58,0.0,1.2", "Anna,2"), "no torso of Anna at frame 2"),
    ],
)
def test_a_table_of_torsos_that_cannot_serve_is_refused_in_one_line(folder, text, said):
    (folder / "torso.csv").write_text(text)
    trial = read(folder, trial_text(start="frame = 2", track='method = "mixture"\ntorso = "torso.csv"'))
    with pytest.raises(TrialError) as caught:
        players_tracker_of(trial, rig())
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_every_setting_named_as_unread_is_one_of_its_method():
    kinds = (BodySettings, ParticleSettings)
    for method, unread in UNREAD_SETTINGS.items():
        (kind,) = (kind for kind in kinds if method in get_args(kind.model_fields["method"].annotation))
        assert unread <= set(kind.model_fields)


def test_players_without_a_start_are_looked_for_at_the_net(folder):
    text = trial_text()
    head = text[: text.index("[start]")]
    trial = read(folder, head)
    assert trial.has_players and trial.start.find and trial.start.near_net
    assert not read(folder, head + "[start]\nfind = true\nnear_net = false\n").start.near_net
    assert "near_net goes with find = true" in complaint(folder, text.replace("[start]", "[start]\nnear_net = true", 1))
