"""People whose joints lie elsewhere: `python benchmarks/accuracy/other_joints.py [SEED ...]`.

Synthetic tucks and twists of people with a skin of their own, whose lengths, hips, trunk and other joints differ from
the body's, and whose leotards, shorts and stripes end within segments. Each is tracked from joints set 15 mm off, with
the true stature and mass. Rows have the errors of joints, of the pelvis's orientation without what is constant, and how
many of the joints' rotations their deviations hold.
Some four minutes of rendering and half a minute of tracking each.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

from airborne.io.environment import set_up_libraries

set_up_libraries()  # as the command line does: with other threads, last digits differ

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.body import BodyModel, human18
from airborne.body.model import Inertia, Mesh, Part, Segment
from airborne.body.shaping import with_segment_lengths
from airborne.body.sides import without_side
from airborne.body.skin import skin_of
from airborne.cameras import Camera, Rig, camera_looking_at
from airborne.constants import GRAVITY_M_S2
from airborne.evaluation import compare_joints, read_joint_paths
from airborne.geometry.joint_rotations import rotation_vectors_between
from airborne.motion import Motion
from airborne.motion.joints import OPEN_SD_RAD
from airborne.motion.run_folder import read_body_run
from airborne.run.track import track_trial
from airborne.synthetic import Scene, Takeoff, gym, write_trial
from airborne.synthetic.flight.articulated import joint_motion, mass_at_angles
from airborne.synthetic.flight.skill import Skill
from airborne.synthetic.throw.scene import HALL_AMBIENT, hall_spots
from airborne.trial.body import BodyTable
from airborne.trial.file import Trial, read_trial
from airborne.trial.start import StartTable
from airborne.types import Array

SEEDS = (901, 902, 903, 904)  # on which the number of steps with a texture was chosen
QUICK = (905, 906)  # who tuck and open in 0.17 s instead of 0.3: on 905 the density of accelerations was chosen
DURATION_S, RATE_HZ, CLICK_SD_M = 1.05, 60, 0.015  # chosen: about those of the recorded somersaults
_HIDDEN = ("pelvis", "neck", "torso")  # landmarks that nobody clicks
_SKIN_SRGB, _HAIR_SRGB, _WHITE = np.array([206.0, 165.0, 138.0]), np.array([60.0, 42.0, 32.0]), np.full(3, 240.0)
_TUCK_DEG = {"thigh": -105, "shank": 110, "torso": 28, "chest": 16}  # chosen: about x, of a deep tuck


def person(seed: int) -> tuple[BodyModel, BodyModel, BodyTable]:
    """Return a person's skeleton with the landmarks at its joints, the same in a skin, and what is known of it."""
    rng = np.random.default_rng([seed, 77])
    stature_m = round(rng.uniform(1.55, 1.85), 2)
    mass_kg = round(rng.uniform(19.0, 25.0) * stature_m**2, 1)
    base = human18(stature_m, mass_kg)
    stems = sorted({without_side(segment.name) for segment in base.segments} - {"shoulder"})
    lengths = {stem: 1 + rng.normal(0, 0.035) for stem in stems}
    beside_m = {  # of joints in their parents: hips are as much as 4 cm higher, the trunk bends as much as 9 cm lower
        "thigh": [rng.normal(0, 0.006), rng.normal(0, 0.012), abs(rng.normal(0.02, 0.02))],
        "torso": [0, rng.normal(0.01, 0.015), -abs(rng.normal(0.06, 0.03))],
        "chest": [0, rng.normal(0, 0.01), rng.normal(0, 0.03)],
        "shank": [0, rng.normal(0, 0.008), rng.normal(0, 0.01)],
        "upper_arm": rng.normal(0, 0.01, 3),
        "forearm": [0, rng.normal(0, 0.006), rng.normal(0, 0.008)],
    }

    def shape(model: BodyModel) -> BodyModel:
        model = with_segment_lengths(model, lengths)
        for name in [each.name for each in model.segments]:
            to_left = np.array([-1.0 if name.endswith("_right") else 1.0, 1, 1])
            model = move_joint(model, name, to_left * beside_m.get(without_side(name), np.zeros(3)))
        return model

    body = dress(shape(skin_of(base, seed=seed, border_change_m=0.04)), rng)
    return shape(base), body, BodyTable(preset="human18", stature_m=stature_m, mass_kg=mass_kg)


def move_joint(model: BodyModel, name: str, shift_m: Array) -> BodyModel:
    """Return the body with a segment's joint elsewhere in its parent; in the zero pose the surface stays."""

    def move(segment: Segment) -> Segment:
        if segment.parent == name:
            return replace(segment, joint_m=segment.joint_m - shift_m)
        if segment.name != name:
            return segment
        back = RigidTransform.from_translation(-shift_m)
        parts = tuple(replace(part, segment_from_part=back * part.segment_from_part) for part in segment.parts)
        own = segment.inertia
        inertia = None if own is None else Inertia(own.mass_kg, own.centre_m - shift_m, own.tensor_kg_m2)
        return replace(segment, joint_m=segment.joint_m + shift_m, parts=parts, inertia=inertia)

    marks = tuple(
        replace(mark, position_m=mark.position_m - shift_m) if mark.segment == name and not mark.at_joint else mark
        for mark in model.landmarks
    )
    return replace(model, segments=tuple(map(move, model.segments)), landmarks=marks)


def dress(model: BodyModel, rng: np.random.Generator) -> BodyModel:
    """Return a body of meshes in a leotard, shorts or a unitard of chance colours, cut within its segments."""
    suit, second = rng.uniform(25, 230, (2, 3))
    skin, hair = _SKIN_SRGB * rng.uniform(0.55, 1.08), _HAIR_SRGB * rng.uniform(0.3, 2.5)
    kind, slope, has_stripe = rng.choice(["leotard", "shorts", "unitard"]), rng.uniform(0.3, 1.2), rng.random() < 0.5
    top = second if kind == "shorts" else suit

    def colours(stem: str, x: Array, y: Array, z: Array) -> Array:
        """Colours (n, 3) at places in a segment, in half sizes from its middle."""
        borders = {  # where a second colour is, and the two
            ("pelvis", "leotard"): (z > 0.3 * np.abs(x) + 0.8 * slope * np.maximum(y, -0.2) - 0.6, suit, skin),
            ("pelvis", "shorts"): (z > 0.35, second, suit),
            ("pelvis", "unitard"): (z > 0.1, suit, second),
            ("thigh", "shorts"): (z > 0.1, suit, skin),
            ("chest", "leotard"): ((z > 0.35) & (y > 0.1) & (np.abs(x) < 0.6), skin, suit),
        }
        even = {"thigh": second, "shank": second, "foot": second} if kind == "unitard" else {}
        even |= {"torso": top, "chest": top, "shoulder": top}
        where, one, other = borders.get((stem, kind), (np.zeros(len(x), bool), skin, even.get(stem, skin)))
        if stem == "head":
            where, one = (z > 0.45) | (y > 0.25), hair
        if stem == "upper_arm" and kind != "leotard":
            where, one = z > 0.4, top
        if stem == "chest" and has_stripe and kind != "leotard":
            where, one = (np.abs(x + 0.1) < 0.3) & (y < 0) & (np.abs(z) < 0.5), _WHITE
        return np.where(where[:, None], one, other)

    def paint(segment: Segment) -> Segment:
        corners = np.concatenate([_vertices(part) for part in segment.parts])
        low, high, parts = corners.min(axis=0), corners.max(axis=0), list[Part]()
        for part in segment.parts:
            mesh = part.shape
            assert isinstance(mesh, Mesh) and mesh.normals is not None
            middles = (_vertices(part)[mesh.faces].mean(axis=1) - (low + high) / 2) / ((high - low) / 2)
            found, number = np.unique(colours(without_side(segment.name), *middles.T), axis=0, return_inverse=True)
            for k, colour in enumerate(found):
                vertices, faces = np.unique(mesh.faces[number.ravel() == k], return_inverse=True)
                piece = Mesh(mesh.vertices_m[vertices], faces.reshape(-1, 3), mesh.normals[vertices])
                parts.append(Part(f"{part.name}_{k}", piece, part.segment_from_part, colour))
        return replace(segment, parts=tuple(parts))

    return replace(model, segments=tuple(map(paint, model.segments)))


def _vertices(part: Part) -> Array:
    assert isinstance(part.shape, Mesh)
    return part.segment_from_part.apply(part.shape.vertices_m)


def record(seed: int, folder: Path) -> Trial:
    """Record a person's somersault; return its trial, which starts from joints that are set by hand."""
    rng = np.random.default_rng([seed, 78])
    bones, body, known = person(seed)

    def bend(**about_x_deg: float) -> Array:
        angles = rng.normal(0, np.radians(2.5), (bones.n_joints, 3)) * [1, 1, 0]
        for index, segment in enumerate(bones.segments[1:]):
            of_both = about_x_deg.get(without_side(segment.name), 0)
            angles[index, 0] += np.radians(about_x_deg.get(segment.name, of_both))
        return angles

    depth = rng.uniform(0.5, 1.1)
    start = bend(upper_arm=-165, foot=30, torso=-5)
    tuck = bend(upper_arm=-75, forearm=-50, head=15, foot=25, **{k: depth * v for k, v in _TUCK_DEG.items()})
    dropped = bend(upper_arm=-150, upper_arm_left=-60, foot=25, thigh=-10)
    end = bend(thigh=-35, shank=30, torso=8, upper_arm=-80)
    poses, shares = (start, tuck, tuck, end), (0.08, 0.38, 0.62, 0.95)
    if seed % 2 == 0:
        poses, shares = (start, dropped, tuck, end), (0.05, 0.3, 0.6, 0.95)
    if seed in QUICK:
        poses, shares = (start, start, tuck, tuck, end, end), (0.02, 0.12, 0.28, 0.62, 0.80, 0.98)
    if seed in QUICK and seed % 2 == 0:
        poses, shares = (start, start, dropped, tuck, tuck, end), (0.02, 0.1, 0.25, 0.42, 0.65, 0.83)
    upright = float(np.asarray(mass_at_angles(bones, np.zeros_like(start)).inertia).reshape(-1, 3)[0, 0])
    takeoff = Takeoff(
        centre=np.array([rng.normal(0, 0.05), 0.1, 1.25]),
        velocity=np.array([rng.normal(0, 0.1), -0.3, GRAVITY_M_S2 * DURATION_S / 2]),
        R=Rotation.from_rotvec(rng.normal(0, 0.08, 3)).as_matrix(),
        angular_momentum=np.array([rng.choice([-1, 1]) * rng.uniform(2.2, 3.6) * upright, 0, 0]),
    )
    joints = joint_motion(DURATION_S * np.array(shares), np.array(poses))
    flight = Skill(model=bones, takeoff=takeoff, joints=joints, duration_s=DURATION_S)
    scene = Scene(
        name=f"person {seed}",
        seed=seed,
        rig=Rig(_cameras(rng, 3 + seed % 2)),
        body=body,
        flight=flight,
        surroundings=gym(np.random.default_rng([seed, 1]), clutter=14),
        spots=hall_spots(rng),
        ambient=HALL_AMBIENT,
        tracking_body=bones,
        n_pictures=int(DURATION_S * RATE_HZ) + 1,
        rate=Fraction(RATE_HZ),
        is_interlaced=False,
        is_surveyed=False,
        noise_sd=4.0,
    )
    write_trial(scene, folder)
    at_start = bones.with_pose(flight(np.zeros(1)).pose(0)).landmarks
    clicked = {
        mark.name: (at + rng.normal(0, CLICK_SD_M, 3)).tolist()
        for mark, at in zip(bones.landmarks, at_start, strict=True)
        if mark.name not in _HIDDEN
    }
    update = {"body": known, "start": StartTable(frame=0, joints_m=clicked)}
    return read_trial(folder / "trial.toml").model_copy(update=update)


def _cameras(rng: np.random.Generator, n: int) -> tuple[Camera, ...]:
    """Return cameras in a half circle in front, 960 x 720."""
    angles = np.radians(np.linspace(-168, -12, n) + rng.uniform(-10, 10, n))
    places = [(7 * np.cos(angle), 7 * np.sin(angle), rng.uniform(1.0, 2.6)) for angle in angles]
    return tuple(
        camera_looking_at(f"cam{i}", place, (0.0, 0.0, 1.75), focal_px=1120.0, size=(960, 720))
        for i, place in enumerate(places, start=1)
    )


def measure(seed: int) -> list[dict]:
    """Return the rows of one person."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "trial"
        track_trial(record(seed, folder), Path(name) / "run", pictures=False)
        return rows_of(seed, folder, Path(name) / "run")


def rows_of(seed: int, folder: Path, run: Path) -> list[dict]:
    """Return the rows of a person's recording and its run."""
    motion, model = read_body_run(run)
    found = compare_joints(motion, model, read_joint_paths(folder / "truth_joints.csv"))
    pelvis_deg = pelvis_errors_deg(motion, read_columns(folder / "truth.csv"))
    angles = joint_errors_in_sds(motion, read_columns(folder / "truth_angles.csv"))
    common = {"data": f"person {seed}", "method": "refined", "n": found.whole.n}
    return [
        {**common, "metric": "mean joint error", "unit": "mm", "value": found.whole.mean_mm},
        {**common, "metric": "the same without constant offsets", "unit": "mm",
         "value": found.whole.mean_without_offset_mm},
        {**common, "metric": "pelvis, without its mean", "unit": "deg", "value": float(pelvis_deg.mean())},
        {**common, "metric": "held by the 95 % interval", "unit": "",
         "value": found.coverage_with_offset.within_95, "floor": "0.88..0.99"},
        {**common, "metric": "joint rotations within 2 sds", "unit": "",
         "value": float(np.mean(np.abs(angles[np.isfinite(angles)]) < 2)), "floor": "0.88..0.99"},
    ]  # fmt: skip


def read_columns(path: Path) -> np.ndarray:
    """Read a table of numbers with named columns."""
    return np.genfromtxt(path, delimiter=",", names=True)


def joint_errors_in_sds(motion: Motion, truth: np.ndarray) -> Array:
    """Return the errors of the joints' rotations, about the segments' axes, in their sds: (n, 3 joints).

    NaN where the images do not show them.
    """
    assert truth.dtype.names is not None
    true = np.array(truth[list(truth.dtype.names[2:])].tolist())[: len(motion)].reshape(motion.joint_angles.shape)
    off = rotation_vectors_between(true.reshape(-1, 3), motion.joint_angles.reshape(-1, 3))
    sd = np.sqrt(np.diagonal(motion.covariance, axis1=1, axis2=2)[:, 6:])
    return np.where(sd < OPEN_SD_RAD, off.reshape(sd.shape) / sd, np.nan)


def pelvis_errors_deg(motion: Motion, truth: np.ndarray) -> Array:
    """Return how far the root's orientation is off in each frame, without its mean error: (n,) [deg]."""
    true = np.stack([truth[f"r{i}{j}"] for i in range(3) for j in range(3)], axis=-1).reshape(-1, 3, 3)
    off = Rotation.from_matrix(true[: len(motion)].swapaxes(1, 2) @ motion.R)
    return np.degrees((off * off.mean().inv()).magnitude())


if __name__ == "__main__":
    for each in [int(seed) for seed in sys.argv[1:]] or (*SEEDS, *QUICK):
        append("other_joints", measure(each))
