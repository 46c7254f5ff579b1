"""A small trial of two players and a bystander, and a tracker that needs no pictures."""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.legs import LEG_POINTS
from airborne.cameras import Camera, Rig, write_pose2sim
from airborne.motion import PlayersWriter
from airborne.run import check, players, players_mix_ups
from airborne.tracking import Status
from airborne.tracking.players import PlayerEstimate
from tests.support.clips import write_clip

SIZE = (160, 120)
RATE = 50
PLAYERS = {"Anna": -0.6, "number 7": 0.6}  # place along x [m]
BYSTANDER = "referee"


PLACES = {"left": (-0.5, -5.0, 0.8), "right": (0.5, -5.5, 0.8), "middle": (0.0, -6.0, 1.0)}
FOCAL_PX = 130.0


def camera(name):
    """A camera that looks along +y, z up."""
    K = np.array([[FOCAL_PX, 0, (SIZE[0] - 1) / 2], [0, FOCAL_PX, (SIZE[1] - 1) / 2], [0, 0, 1]])
    turn = Rotation.from_matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    moved = RigidTransform.from_components(-turn.apply(PLACES[name]), turn)
    return Camera(name=name, K=K, size=SIZE, camera_from_world=moved)


def rig(names=("left", "right")):
    """Return the named cameras."""
    return Rig(tuple(camera(name) for name in names))


def points_of(x, height_m=0.0):
    """A standing player's points, as LEG_POINTS, lifted by a height: (6, 3) [m]."""
    heights = np.repeat([0.9, 0.5, 0.1], 2) + height_m
    sides = np.tile([-0.12, 0.12], 3)
    return np.stack([x + sides, np.zeros(6), heights], axis=1)


def start_tables():
    """The [[start.player]] tables of the players and of the bystander."""
    lines = []
    for name, x in PLAYERS.items():
        places = {"torso": [x, 0.0, 1.2], **dict(zip(LEG_POINTS, points_of(x).round(3).tolist(), strict=True))}
        lines += ["[[start.player]]", f'name = "{name}"', "[start.player.joints_m]"]
        lines += [f"{joint} = {place}" for joint, place in places.items()]
    return "\n".join([*lines, "[[start.player]]", f'name = "{BYSTANDER}"', "joints_m = {torso = [0.0, 2.0, 1.3]}", ""])


def trial_text(names=("left", "right"), track="", start="", video="{}.mkv"):
    """A whole trial file."""
    cameras = "\n".join(f'[[camera]]\nname = "{name}"\nvideo = "{video.format(name)}"' for name in names)
    return (
        f'name = "a block"\n{cameras}\n[calibration]\nfile = "calib.toml"\n[body]\npreset = "legs"\n'
        f"[track]\n{track}\n[start]\n{start}\n{start_tables()}"
    )


def pictures(n, level=90):
    """Pictures that are bright, but for `level` None: black."""
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 60, (SIZE[1], SIZE[0], 3), dtype=np.uint8)
    return [noise + np.uint8(level + k % 3) for k in range(n)]


def write_trial(folder: Path, n=6, names=("left", "right"), **text) -> Path:
    """Write videos of n pictures, the calibration and trial.toml, and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        write_clip(folder / f"{name}.mkv", pictures(n), codec="libx264", pix_fmt="yuv420p")
    write_pose2sim(folder / "calib.toml", rig(names))
    (folder / "trial.toml").write_text(trial_text(names, **text), encoding="utf-8")
    return folder / "trial.toml"


def height_at(index):
    """How high the stand-in finds Anna's feet over standing [m]."""
    return 0.5 * max(np.sin(np.pi * (index - 2) / 6), 0.0) if 2 <= index <= 8 else 0.0


@dataclass(frozen=True)
class StandIn:
    """Finds everybody where they stood, Anna a jump higher; number 7 is uncertain at every fourth frame."""

    joints: tuple[str, ...] = LEG_POINTS

    def init(self):
        return 0

    def step(self, state, frames):
        lifted = {"Anna": height_at(frames.index), "number 7": 0.0}
        n_views = sum(view is not None for view in frames.views)
        return state + 1, tuple(
            PlayerEstimate(
                player=name,
                index=frames.index,
                time_s=frames.time_s,
                joint_status=(Status.UNCERTAIN if name != "Anna" and frames.index % 4 == 3 else Status.TRACKED,)
                * len(LEG_POINTS),
                points=points_of(x, lifted[name]),
                covariance=np.tile(np.diag([1e-4, 4e-4, 4e-4]), (6, 1, 1)),
                score=-float(frames.index),
                n_views=n_views,
            )
            for name, x in PLAYERS.items()
        )


def stand_in(monkeypatch, tracker=None) -> None:
    """Let a stand-in find the players of trials whose pictures show nobody: no mix-up is looked for in them either."""
    monkeypatch.setattr(players, "players_tracker_of", lambda trial, rig: tracker or StandIn())
    for user in (players_mix_ups, check):  # of `track`, which imports it when it is needed, and of `check`
        monkeypatch.setattr(user, "refuse_players_mix_ups", lambda starts, recording: None)


def write_run(folder: Path, n=12) -> Path:
    """Leave what a run with the stand-in leaves that `evaluate` reads, without pictures, and return the folder."""
    folder.mkdir(parents=True)
    tracker = StandIn()
    with PlayersWriter(folder / "joints.csv", tracker.joints) as writer:
        for index in range(n):
            seen = SimpleNamespace(index=index, time_s=Fraction(index, RATE), views=(True, True))
            writer.append(tracker.step(0, seen)[1])
    write_pose2sim(folder / "calib.toml", rig())
    (folder / "summary.json").write_text(
        '{"name": "a block", "n_frames": 1, "n_tracked": 1, "n_uncertain": 0, "n_lost": 0}\n', encoding="utf-8"
    )
    return folder


def write_truth(path: Path, n=12, off_m=0.0) -> Path:
    """Write the true table of such a run, in which everybody is lower by `off_m`, and return its path."""
    stems = [f"{name.split('_')[1][0]}_{name.split('_')[0]}" for name in LEG_POINTS]
    lines = [",".join(["frame", "time_s", "player", *(f"{stem}_{axis}" for stem in stems for axis in "xyz")])]
    for index in range(n):
        for name, x in PLAYERS.items():
            points = points_of(x, (height_at(index) if name == "Anna" else 0.0) - off_m)
            lines.append(",".join([str(index), repr(index / RATE), name, *map(repr, points.ravel().tolist())]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
