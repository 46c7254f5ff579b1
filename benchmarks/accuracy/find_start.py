"""Measure how often the start of a thrown thing is found without `[start]`: `python benchmarks/accuracy/find_start.py`.

40 synthetic throws, each with its own body, hall and two to four cameras, and the bundled thrown cross (about 10
minutes, nearly all of it rendering); `--quick` takes 5 throws, `--seeds 100-139` others, and neither writes rows. Right
is up to the body's symmetries, within 50 mm and 10 degrees.
"""

from __future__ import annotations

import sys
import tempfile
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

sys.path.insert(0, str(Path(__file__).resolve().parent))

from finding import measure

from airborne.body import BodyModel, Box, Part, Pose, Segment
from airborne.cameras import Rig, camera_looking_at
from airborne.evaluation import read_truth
from airborne.run.find import find_start
from airborne.synthetic.flight.rigid import Launch
from airborne.synthetic.throw.pictures import scene_frames
from airborne.synthetic.throw.scene import HALL_AMBIENT, PICTURE_SIZE, Scene, Throw, hall_spots
from airborne.synthetic.throw.surroundings import gym
from airborne.tracking.first_pose.candidates import find_thing
from airborne.tracking.first_pose.moments import empty_scenes, look, spread_sample
from airborne.tracking.first_pose.rigid_search import Thing
from airborne.tracking.model_based.render_model import RenderModel
from airborne.trial.examples import example_trial
from airborne.trial.file import read_trial
from airborne.trial.start import StartTable

_DENSITY_KG_M3 = 500.0
_N_PICTURES, _RATE = 12, Fraction(16)


def throw(seed: int) -> Scene:
    """Return a thing thrown in a hall of its own."""
    rng = np.random.default_rng([seed, 77])
    body = _thing(rng)
    launch = Launch(
        centre=np.array([-0.5, 0.0, 1.2]) + rng.normal(0, 0.1, 3),
        velocity=np.array([1.4, 0.1, 3.4]) + rng.normal(0, 0.2, 3),
        R=Rotation.random(random_state=rng).as_matrix(),
        angular_velocity=rng.normal(0, 5, 3),
    )
    n = int(rng.integers(2, 5))
    around = rng.permutation(np.array([-150.0, -90.0, -30.0, -60.0])[: max(n, 3)])[:n] + rng.uniform(-15, 15, n)
    heights = rng.uniform(0.8, 3.5, n)
    rig = Rig(
        tuple(
            camera_looking_at(
                f"cam{i + 1}",
                5.2 * np.array([np.cos(a), np.sin(a), 0]) + [0, 0, height],
                np.array([0.0, 0.0, 1.5]) + rng.normal(0, 0.05, 3),
                focal_px=float(rng.uniform(950, 1150)),
                size=PICTURE_SIZE,
            )
            for i, (a, height) in enumerate(zip(np.radians(around), heights, strict=True))
        )
    )
    return Scene(
        name=f"throw {seed}",
        seed=seed,
        rig=rig,
        body=body,
        flight=Throw(body, _DENSITY_KG_M3, launch),
        surroundings=gym(rng, clutter=int(rng.integers(6, 20))),
        spots=hall_spots(rng),
        ambient=HALL_AMBIENT,
        n_pictures=_N_PICTURES,
        rate=_RATE,
        is_interlaced=False,
    )


def _thing(rng: np.random.Generator) -> BodyModel:
    """Return a cross, a T, an L, a tripod of bars, or a box with a lid of another colour."""
    kind = rng.integers(5)
    long, short = rng.uniform(0.5, 1.0), rng.uniform(0.3, 0.6)
    thick = rng.uniform(0.04, 0.08, 2)
    colours = rng.uniform(30, 235, (3, 3))
    if rng.random() < 0.4:
        colours[:] = colours[0]
    bar = (thick[0], long, thick[1])
    if kind == 0:
        boxes = [(bar, (0, 0, 0)), ((short, thick[0], thick[1]), (0, rng.uniform(0.05, 0.4) * long, 0))]
    elif kind == 1:
        boxes = [(bar, (0, 0, 0)), ((short, thick[0], thick[1]), (0, (long - thick[0]) / 2, 0))]
    elif kind == 2:
        boxes = [(bar, (0, 0, 0)), ((short, thick[0], thick[1]), (short / 2, (long - thick[0]) / 2, 0))]
    elif kind == 3:
        boxes = [(bar, (0, 0, 0)), ((short, thick[0], thick[1]), (0, 0, 0)), ((thick[0], thick[1], short), (0, 0, 0.2))]
    else:
        size = rng.uniform(0.2, 0.5, 3)
        colours[1] = (colours[0] + 110) % 230
        boxes = [(tuple(size), (0, 0, 0)), ((size[0], size[1], 0.06), (0, 0, size[2] / 2 + 0.03))]
    parts = tuple(
        Part(
            f"part_{i}", Box(np.array(size, float)), RigidTransform.from_components(centre, Rotation.identity()), colour
        )
        for i, ((size, centre), colour) in enumerate(zip(boxes, colours, strict=False))
    )
    return BodyModel(("cross", "T", "L", "tripod", "box")[kind], (Segment("thing", None, np.zeros(3), parts),))


def verdict(seed: int) -> tuple[str, float]:
    """Find one throw; return right, wrong or undecided, and the CPU time [s] without rendering."""
    scene = throw(seed)
    frames = list(scene_frames(scene))
    start_s = time.process_time()
    sample = spread_sample(frames, len(frames))
    finding = find_thing(scene.body, look(sample, empty_scenes(sample)))
    cpu_s = time.process_time() - start_s
    index, best = finding.moment.frames.index, finding.candidates[0]
    true = scene.flight(np.array([float(scene.time_s(index))])).pose(0)
    right = is_right(scene.body, best.pose, true)
    word = ("right" if right else "wrong") if finding.is_decided else "undecided"
    print(f"{scene.name}: {scene.body.name}, {len(scene.rig)} cameras, frame {index}: {word}, ", end="")
    print(f"likeliest {'right' if right else 'wrong'} ({best.probability:.3f}), {cpu_s:.1f} s", flush=True)
    return word, cpu_s


def is_right(body: BodyModel, pose: Pose, true: Pose) -> bool:
    """Say whether a pose is the true one, up to symmetry, within 50 mm and 10 degrees."""
    off_m = np.linalg.norm(pose.world_from_root.translation - true.world_from_root.translation)
    R, R_true = (each.world_from_root.rotation.as_matrix() for each in (pose, true))
    off_rad = Thing(RenderModel.of(body)).angles(R[None], R_true)[0]
    return bool(off_m < 0.05 and off_rad < np.radians(10))


def verdict_of_example() -> tuple[str, float]:
    """Find the bundled thrown cross, from its videos."""
    trial = read_trial(example_trial("thrown_cross")).model_copy(update={"start": StartTable(find=True)})
    truth = read_truth(example_trial("thrown_cross").parent / "truth.csv")
    start_s = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        start = find_start(trial, Path(folder)).trial.start
    cpu_s = time.process_time() - start_s
    world_from_root = RigidTransform.from_components(
        truth.position[start.frame], Rotation.from_matrix(truth.R[start.frame])
    )
    right = is_right(trial.model(), start.pose, Pose(world_from_root=world_from_root))
    print(f"thrown cross, frame {start.frame}: {'right' if right else 'wrong'}, {cpu_s:.1f} s", flush=True)
    return "right" if right else "wrong", cpu_s


if __name__ == "__main__":
    measure(
        "find_start",
        "thrown cross and throws",
        verdict,
        seeds=(0, 39),
        n_quick=5,
        floors=(">= 95", "<= 1"),
        recordings=[verdict_of_example],
    )
