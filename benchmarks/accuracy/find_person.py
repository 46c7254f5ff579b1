"""Measure how often a person's start is found without `[start]`: `python benchmarks/accuracy/find_person.py`.

30 synthetic people in flight, each with a posture, clothes, hall and three or four cameras of its own, drawn with a
skin that is not the body tracked (about 40 minutes); `--quick` takes 2, `--seeds 5100-5129` others, and neither writes
rows. Right is a mean error of the landmarks up to 60 mm.
"""

from __future__ import annotations

import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parent))

from finding import measure

from airborne.body import BodyModel, human18
from airborne.body.outfits import SAMPLED, Outfit
from airborne.body.skin import skin_of
from airborne.cameras import Rig, camera_looking_at
from airborne.geometry.rotations import angles_from_matrix
from airborne.synthetic.flight.articulated import Takeoff, joint_motion
from airborne.synthetic.flight.skill import Skill
from airborne.synthetic.throw.pictures import scene_frames
from airborne.synthetic.throw.scene import HALL_AMBIENT, PICTURE_SIZE, Scene, hall_spots
from airborne.synthetic.throw.surroundings import gym
from airborne.tracking.first_pose.moments import empty_scenes, look, spread_sample
from airborne.tracking.first_pose.person_candidates import find_person
from airborne.types import Array

_RIGHT_M = 0.06
_N_PICTURES, _RATE = 20, Fraction(24)
_HALF_SYMMETRIC = 0.8  # share of people whose arms, and whose legs, do about the same


def person(seed: int) -> tuple[Scene, BodyModel]:
    """Return a person who moves from one posture to another in flight, and the body with the true joints."""
    rng = np.random.default_rng([seed, 78])
    stature_m = rng.uniform(1.55, 1.95)
    mass_kg = rng.uniform(19.5, 25) * stature_m**2
    true = human18(stature_m, mass_kg, outfit=_outfit(rng))
    known = human18(stature_m * rng.normal(1, 0.01), mass_kg * rng.normal(1, 0.04), outfit=SAMPLED)
    duration_s = (_N_PICTURES - 1) / float(_RATE)
    postures = np.unwrap(np.array([_posture(true, rng) for _ in range(2)]), axis=0)
    joints = joint_motion(np.array([0.1 * duration_s, 0.9 * duration_s]), postures)
    is_upright = rng.random() < 0.4
    turned = rng.normal(0, 10, 2) if is_upright else [rng.uniform(0, 360), rng.normal(0, 20)]
    R = Rotation.from_euler("zxy", [rng.uniform(0, 360), *turned], degrees=True).as_matrix()
    momentum = rng.normal(0, 1, 3) * (4 if is_upright else [45, 6, 3])
    takeoff = Takeoff(
        centre=np.array([rng.normal(-1.0, 0.1), rng.normal(0, 0.2), rng.uniform(1.0, 1.3)]),
        velocity=np.array([rng.uniform(1.5, 3.0), rng.normal(0, 0.3), rng.uniform(3.2, 4.2)]),
        R=R,
        angular_momentum=R @ momentum,
    )
    scene = Scene(
        name=f"person {seed}",
        seed=seed,
        rig=_rig(rng),
        body=skin_of(true),
        tracking_body=known,
        flight=Skill(model=true, takeoff=takeoff, joints=joints, duration_s=duration_s),
        surroundings=gym(rng, clutter=int(rng.integers(6, 20))),
        spots=hall_spots(rng),
        ambient=HALL_AMBIENT,
        n_pictures=_N_PICTURES,
        rate=_RATE,
        is_interlaced=False,
        noise_sd=4.0,
    )
    return scene, true


def _outfit(rng: np.random.Generator) -> Outfit:
    colours = [tuple(rng.uniform(25, 230, 3)) for _ in range(4)]
    tone = rng.uniform(0.35, 1)
    return Outfit(
        skin=(225 * tone, 180 * tone**1.15, 150 * tone**1.3),
        hair=tuple(np.array([60, 45, 35]) * rng.uniform(0.4, 2.2)),
        shirt=colours[0],
        shorts=colours[1],
        socks=colours[2],
        shoes=colours[3],
        sleeve_share=rng.uniform(0, 1),
        shorts_share=rng.uniform(0.1, 0.9),
        socks_share=rng.uniform(0, 0.5),
    )


def _posture(model: BodyModel, rng: np.random.Generator) -> Array:
    """Return joint angles (joints, 3) [rad] of a posture within the limits."""
    angles = dict(zip((segment.name for segment in model.segments[1:]), np.zeros((model.n_joints, 3)), strict=True))
    is_symmetric = rng.random() < _HALF_SYMMETRIC
    leg, arm = _leg(rng), _arm(rng)
    for side, sign in (("left", 1), ("right", -1)):
        if side == "left" or is_symmetric:
            own_leg = np.array(leg) + (0 if side == "left" else rng.normal(0, 4, 4))
            own_arm = np.array(arm) + (0 if side == "left" else rng.normal(0, 6, 4))
        else:
            own_leg, own_arm = _leg(rng), _arm(rng)
        hip, spread, knee, ankle = own_leg
        shoulder, aside, elbow, twist = own_arm
        angles[f"thigh_{side}"][:] = -hip, -sign * spread, 0
        angles[f"shank_{side}"][0] = knee
        angles[f"foot_{side}"][0] = ankle
        angles[f"upper_arm_{side}"][:] = -shoulder, -sign * aside, sign * twist / 2
        angles[f"forearm_{side}"][:] = -elbow, 0, sign * twist / 2
    bend = rng.normal(0, 8) + (12 if leg[0] > 60 else 0)
    angles["torso"][:] = bend, *rng.normal(0, 5, 2)
    angles["chest"][0] = 0.6 * bend
    angles["head"][:] = rng.normal(0, 12), 0, rng.normal(0, 12)
    R = Rotation.from_euler("XYZ", np.array(list(angles.values())), degrees=True).as_matrix()
    return angles_from_matrix(model.limits.clamp(R))


def _leg(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Return flexion and abduction of the hip, flexion of the knee and the ankle [deg]."""
    hip = rng.choice([rng.uniform(-15, 20), rng.uniform(20, 70), rng.uniform(70, 115)], p=[0.5, 0.25, 0.25])
    knee = rng.choice([rng.uniform(0, 15), rng.uniform(15, 70), rng.uniform(70, 130)], p=[0.5, 0.25, 0.25])
    spread = rng.uniform(0, 12) if rng.random() < 0.7 else rng.uniform(12, 40)
    return hip, spread, knee, rng.uniform(-10, 40)


def _arm(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Return flexion and abduction of the shoulder, flexion of the elbow, and a twist [deg]."""
    aside = rng.uniform(0, 40) if rng.random() < 0.7 else rng.uniform(40, 90)
    elbow = rng.choice([rng.uniform(0, 30), rng.uniform(30, 120)])
    return rng.uniform(-40, 175), aside, elbow, rng.uniform(-60, 60)


def _rig(rng: np.random.Generator) -> Rig:
    n = int(rng.integers(3, 5))
    around_deg = rng.permutation(np.array([-160.0, -112.0, -20.0, -66.0])[:n]) + rng.uniform(-15, 15, n)
    return Rig(
        tuple(
            camera_looking_at(
                f"cam{i + 1}",
                6.5 * np.array([np.cos(a), np.sin(a), 0]) + [0, 0, rng.uniform(0.8, 3.5)],
                np.array([0.1, 0, 1.5]) + rng.normal(0, 0.05, 3),
                focal_px=float(rng.uniform(950, 1100)),
                size=PICTURE_SIZE,
            )
            for i, a in enumerate(np.radians(around_deg))
        )
    )


def verdict(seed: int) -> tuple[str, float]:
    """Find one person; return right, wrong or undecided, and the CPU time [s] without rendering."""
    scene, true = person(seed)
    sample = spread_sample(list(scene_frames(scene)), scene.n_pictures)
    start_s = time.process_time()
    finding = find_person(scene.model, look(sample, empty_scenes(sample)))
    cpu_s = time.process_time() - start_s
    index, best = finding.moment.frames.index, finding.candidates[0]
    pose = scene.flight(np.array([float(scene.time_s(index))])).pose(0)
    away_m = np.linalg.norm(scene.model.with_pose(best.pose).landmarks - true.with_pose(pose).landmarks, axis=1).mean()
    word = "undecided" if not finding.is_decided else "right" if away_m <= _RIGHT_M else "wrong"
    print(f"{scene.name}: {len(scene.rig)} cameras, frame {index}: {word}, the likeliest ", end="")
    print(f"({best.probability:.3f}) is {1e3 * away_m:.0f} mm off, {cpu_s:.1f} s", flush=True)
    return word, cpu_s


if __name__ == "__main__":
    measure(
        "find_person",
        "people",
        verdict,
        seeds=(5000, 5029),
        n_quick=2,
        floors=(">= 80", "<= 3"),
    )
