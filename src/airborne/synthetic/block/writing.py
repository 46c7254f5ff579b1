"""A block scene written as a trial: videos, cameras, hand-set start, truth."""

from __future__ import annotations

import csv
import json
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from airborne.cameras import write_pose2sim
from airborne.io.writing import write_text
from airborne.synthetic.block.pictures import block_frames
from airborne.synthetic.block.players import Player
from airborne.synthetic.block.scene import BlockScene
from airborne.synthetic.block.truth import TRUTH_JOINTS, jump_truth, noisy_starts, true_joints
from airborne.synthetic.throw.writing import fill_folder
from airborne.types import Array, Progress
from airborne.video import VideoWriter

_CRF = 20  # of x264
_TRUTH_NAMES = {**{landmark: column for column, landmark in TRUTH_JOINTS.items()}, "torso": "torso"}


def write_block(folder: Path, scene: BlockScene, *, overwrite: bool = False, progress: Progress | None = None) -> None:
    """Record a scene into a folder, which is made; nothing is left of it where that is broken off.

    `<camera>.mp4`, `calib.toml` (the calibrated cameras), `calib_true.toml` where they differ, `first_frame.json` and
    `trial.toml` (the start set by hand), `truth.csv` (the joints of all players) and `players.json` (clothes, and the
    truth of the jumps). `progress` is called after every frame. Raises TrialError for a folder that holds anything,
    unless `overwrite`: then files of these names are replaced.
    """
    with fill_folder(folder, overwrite) as part:
        starts = noisy_starts(scene)
        write_pose2sim(part / "calib.toml", scene.calibrated_rig)
        if scene.difficulty.calibration_error_px > 0:
            write_pose2sim(part / "calib_true.toml", scene.rig)
        _write_json(part / "first_frame.json", _first_frame(scene, starts))
        _write_json(part / "players.json", [_player_record(player, scene) for player in scene.players])
        _write_truth(part / "truth.csv", scene)
        _write_videos(part, scene, progress)
        write_text(part / "trial.toml", block_toml(scene, starts))


def block_toml(scene: BlockScene, starts: dict[str, dict[str, Array]]) -> str:
    """Return the trial file of a scene's recording; `starts` as of `starts_of`."""
    lines = [f"name = {json.dumps(scene.name)}"]
    for name in scene.rig.names:
        lines += ["", "[[camera]]", f"name = {json.dumps(name)}", f"video = {json.dumps(name + '.mp4')}"]
    lines += ["", "[calibration]", 'file = "calib.toml"', "", "[body]", 'preset = "legs"']
    lines += ["", "[track]", 'method = "blocker"', ""]
    off = f"{1000 * scene.difficulty.start_noise_m:.0f} mm off"
    lines += [f"[start]                # joints set by hand, {off}", "frame = 0"]
    for player, joints in starts.items():
        lines += ["", "[[start.player]]", f"name = {json.dumps(player)}", "[start.player.joints_m]"]
        lines += [f"{joint} = {np.round(position, 4).tolist()}" for joint, position in joints.items()]
    return "\n".join(lines) + "\n"


def _first_frame(scene: BlockScene, starts: dict[str, dict[str, Array]]) -> dict:
    blockers = {player.name for player in scene.blockers}
    return {
        "frame": 0,
        "unit": "m",
        "note": f"set by hand: {1000 * scene.difficulty.start_noise_m:.0f} mm (one sigma, each axis) off; "
        "foot = ball of the foot; torso = mean of hips and shoulders",
        "blockers": {
            player: {_TRUTH_NAMES[joint]: np.round(position, 4).tolist() for joint, position in joints.items()}
            for player, joints in starts.items()
            if player in blockers
        },
    }


def _player_record(player: Player, scene: BlockScene) -> dict:
    clothes = ("skin", "hair", "shorts", "shirt", "socks", "shoes")
    colours = {name: np.round(getattr(player.outfit, name)).astype(int).tolist() for name in clothes}
    record = {
        "name": player.name,
        "role": player.role,
        "stature_m": round(player.stature_m, 3),
        "side": "y<0 (target team)" if player.side < 0 else "y>0",
        "jumps": player.takeoff_s is not None,
        "colours_srgb": colours,
    }
    return record | ({} if player.takeoff_s is None else {"jump": jump_truth(player, float(scene.rate))})


def _write_truth(path: Path, scene: BlockScene) -> None:
    columns = [*TRUTH_JOINTS, "torso"]
    joints_by_player = [true_joints(player, scene.times_s) for player in scene.players]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["frame", "time_s", "player", *(f"{name}_{axis}" for name in columns for axis in "xyz")])
        for i, time in enumerate(scene.times_s):
            for player, joints in zip(scene.players, joints_by_player, strict=True):
                numbers = np.concatenate([joints[TRUTH_JOINTS.get(name, name)][i] for name in columns])
                writer.writerow([i, repr(float(time)), player.name, *(f"{number:.6f}" for number in numbers)])


def _write_videos(folder: Path, scene: BlockScene, progress: Progress | None) -> None:
    with ExitStack() as stack:
        writers = [
            stack.enter_context(VideoWriter(folder / f"{camera.name}.mp4", size=camera.size, rate=scene.rate, crf=_CRF))
            for camera in scene.rig
        ]
        uncompressed = replace(scene, difficulty=replace(scene.difficulty, jpeg_quality=0))
        for frames in block_frames(uncompressed):
            for writer, view in zip(writers, frames.views, strict=True):
                if view is not None:
                    writer.write(view.rgb)
            if progress is not None:
                progress(frames.index + 1, scene.n_frames)


def _write_json(path: Path, value: object) -> None:
    write_text(path, json.dumps(value, indent=1) + "\n")
