"""The package `yeadon` as an oracle: the same person in the same configuration, here and there.

Its shapes, densities, masses, joints and rotations are taken at their word. Its centres and tensors are not: version
2.0.1 mirrors the centre of a solid with two round ends, has a section's width where its depth belongs in the moment
about x, and turns a tensor to world axes the wrong way round. `by_slices` integrates its solids anew.
"""

import contextlib
import io

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Inertia, Pose
from airborne.body.anthropometry import FOOT_SLOPE_RAD
from airborne.body.human import PARENTS
from airborne.body.inertia import combine_inertias, transform_inertia

# where yeadon's 21 configuration angles go: the segment whose joint angle, or the root, about x, y, z
ANGLES = {
    None: ("somersault", "tilt", "twist"),
    "torso": ("PTsagittalFlexion", "PTbending", None),
    "chest": ("TCsagittalSpinalFlexion", None, "TCspinalTorsion"),
    "upper_arm_left": ("CA1extension", "CA1adduction", "CA1rotation"),
    "upper_arm_right": ("CB1extension", "CB1abduction", "CB1rotation"),
    "forearm_left": ("A1A2extension", None, None),
    "forearm_right": ("B1B2extension", None, None),
    "thigh_left": ("PJ1extension", "PJ1adduction", None),
    "thigh_right": ("PK1extension", "PK1abduction", None),
    "shank_left": ("J1J2flexion", None, None),
    "shank_right": ("K1K2flexion", None, None),
}
SEGMENTS = {  # yeadon's segments and ours with the same origin and, but for the forearm's half turn, the same axes
    "T": "torso",
    "C": "chest",
    "A1": "upper_arm_left",
    "B1": "upper_arm_right",
    "A2": "forearm_left",
    "B2": "forearm_right",
    "J1": "thigh_left",
    "K1": "thigh_right",
    "J2": "shank_left",
    "K2": "shank_right",
}


def yeadon_person(measurements, configuration=None):
    """Make yeadon's Human of the measurements as they stand, with angles [rad] by name; others are zero."""
    from yeadon import Human

    human = Human(dict(measurements.values_m), symmetric=False)
    with contextlib.redirect_stdout(io.StringIO()):  # angles out of its bounds are only printed
        human.set_CFG_dict(dict.fromkeys(Human.CFGnames, 0.0) | (configuration or {}))
    return human


def same_pose(measurements, configuration):
    """Return the pose of ours that yeadon's configuration [rad] means, its hip centre at the origin.

    Yeadon's palms face forward and the toes point down: a forearm turned by 90 degrees, a foot flexed to its slope.
    """
    angles = np.zeros((len(PARENTS), 3))
    for segment, names in ANGLES.items():
        row = 0 if segment is None else list(PARENTS).index(segment)
        angles[row] = [0.0 if name is None else configuration.get(name, 0.0) for name in names]
    for side in ("left", "right"):
        angles[list(PARENTS).index(f"forearm_{side}"), 2] = -np.pi / 2
        angles[list(PARENTS).index(f"foot_{side}"), 0] = np.pi / 2 - FOOT_SLOPE_RAD
    R = Rotation.from_euler("XYZ", angles[0])
    top_of_pelvis = R.apply([0, 0, measurements.values_m["Ls2L"]])
    return Pose(world_from_root=RigidTransform.from_components(top_of_pelvis, R), joint_angles=angles[1:])


def random_configuration(seed):
    """Draw all 21 angles [rad]."""
    rng = np.random.default_rng(seed)
    return {name: rng.uniform(-1.4, 1.4) for names in ANGLES.values() for name in names if name is not None}


_SLICED: dict = {}  # a person's solids are the same in every configuration


def by_slices(piece):
    """Integrate one of yeadon's solids in its own frame, once; see `_by_slices`."""
    key = (piece.label, piece.mass, piece.height)
    if key not in _SLICED:
        _SLICED[key] = _by_slices(piece)
    return _SLICED[key]


def _by_slices(piece, n=600):
    """Integrate one of yeadon's solids in its own frame, by n slices; each section is a polygon (Green's theorem)."""
    share = (np.arange(n) + 0.5) / n
    if hasattr(piece, "stads"):
        low, high = piece.stads
        flat = low.thickness + (high.thickness - low.thickness) * share
        radius = low.radius + (high.radius - low.radius) * share
    else:
        flat, radius = 0 * share, piece.radius * np.sqrt(1 - share**2)
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False) + np.pi / 720
    x = radius[:, None] * np.cos(angle) + flat[:, None] * np.sign(np.cos(angle))
    y = radius[:, None] * np.sin(angle)
    if getattr(piece, "alignment", "ML") == "AP":
        x, y = y, x
    u, v = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    cross = x * v - u * y
    area = np.abs(cross.sum(axis=1)) / 2
    xx = np.abs((cross * (x * x + x * u + u * u)).sum(axis=1)) / 12
    yy = np.abs((cross * (y * y + y * v + v * v)).sum(axis=1)) / 12
    dm, z = piece.density * piece.height / n, share * piece.height
    centre = area @ z / area.sum()
    spread = dm * np.array([xx.sum(), yy.sum(), area @ (z - centre) ** 2])
    return Inertia(dm * area.sum(), np.array([0, 0, centre]), np.diag(spread.sum() - spread))


def whole_by_slices(human):
    """Put all of a yeadon person's solids together in world axes."""
    return combine_inertias(
        [
            transform_inertia(by_slices(p), segment.rot_mat, p.pos.ravel())
            for segment in human.segments
            for p in segment.solids
        ]
    )
