"""Body models: a tree of segments with coloured parts; with a pose, a posed body."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body.kinematics import chain_segments
from airborne.body.limits import FREE, JointLimits
from airborne.errors import BodyError, count
from airborne.geometry.joint_rotations import move_matrix
from airborne.io.names import check_column, check_name
from airborne.types import Array


@dataclass(frozen=True, slots=True, eq=False)
class Ellipsoid:
    """An ellipsoid about its own origin."""

    semi_axes_m: Array  # (3,) [m]

    def __post_init__(self) -> None:
        _require_positive(self.semi_axes_m, "semi_axes_m")


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """A rectangular prism about its own origin."""

    size_m: Array  # (3,) full lengths [m]

    def __post_init__(self) -> None:
        _require_positive(self.size_m, "size_m")


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A triangle mesh, faces counter-clockwise from outside; closed by itself or with the segment's other parts."""

    vertices_m: Array  # (v, 3) [m]
    faces: NDArray[np.integer]  # (f, 3)
    normals: Array | None = None  # (v, 3) unit, outward, for smooth shading; None: each face has its own
    note: str = ""  # what its file had that was not as it should be


Shape = Ellipsoid | Box | Mesh

LONGEST_M = 20.0  # no part of a body is longer
_SHORTEST_M = 1e-9  # nor shorter: areas of sides would vanish in rounding
WHOLE = (-np.inf, np.inf)  # a part that is not clipped to a slab


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One coloured solid, fixed in its segment."""

    name: str
    shape: Shape
    segment_from_part: RigidTransform
    colour: Array | None  # (3,) sRGB 0..255; None: to be sampled from the video at the first pose
    slab_m: tuple[float, float] = WHOLE  # ellipsoids: only what lies between these heights along the part's own z

    def __post_init__(self) -> None:
        low, high = self.slab_m
        if not low < high:
            raise BodyError(f"part '{self.name}': slab_m is [{low}, {high}]; give the lower height first, in metres")
        if self.slab_m != WHOLE and not isinstance(self.shape, Ellipsoid):
            raise BodyError(f"part '{self.name}': only an ellipsoid can be cut to a slab; leave slab_m out")
        if isinstance(self.shape, Ellipsoid):
            top = self.shape.semi_axes_m[2]
            if low >= top or high <= -top:
                raise BodyError(
                    f"part '{self.name}': slab_m [{low}, {high}] misses the ellipsoid, [{-top:g}, {top:g}]; move it"
                )


@dataclass(frozen=True, slots=True, eq=False)
class Inertia:
    """A segment's mass, centre of mass and inertia tensor."""

    mass_kg: float
    centre_m: Array  # (3,) centre of mass, segment's frame [m]
    tensor_kg_m2: Array  # (3, 3) about the centre of mass, segment's axes [kg m^2]


@dataclass(frozen=True, slots=True, eq=False)
class Landmark:
    """A named point fixed in a segment: a joint centre, a toe, the head."""

    name: str
    segment: str
    position_m: Array  # (3,) segment's frame [m]
    is_joint: bool = False  # it stands for the segment's joint, also where it lies beside

    @property
    def at_joint(self) -> bool:
        """Whether it stands for the segment's joint."""
        return self.is_joint or not self.position_m.any()


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """A rigid segment of the body; it rotates about a joint centre fixed in its parent."""

    name: str
    parent: str | None
    joint_m: Array  # (3,) the joint in the parent's frame [m]; the segment's own origin
    parts: tuple[Part, ...]
    limits: JointLimits = FREE
    inertia: Inertia | None = None  # None: unknown


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pose:
    """A body's degrees of freedom: the root's position and orientation, and the joint angles."""

    world_from_root: RigidTransform
    joint_angles: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (segments - 1, 3) x-y-z [rad]

    def move(self, translation_m: Array, rotation_vector: Array) -> Pose:
        """Translate by (3,) [m] and rotate about the root by a rotation vector (3,) [rad], both in world axes."""
        translation, vector = np.ascontiguousarray(translation_m, float), np.ascontiguousarray(rotation_vector, float)
        moved = move_matrix(self.world_from_root.as_matrix(), translation, vector)
        return Pose(world_from_root=RigidTransform(moved, normalize=False), joint_angles=self.joint_angles)


@dataclass(frozen=True, eq=False)
class BodyModel:
    """A body without a pose: x = subject's left, y = posterior, z = toward the head [m]."""

    name: str
    segments: tuple[Segment, ...]  # parents before children; the first is the root
    landmarks: tuple[Landmark, ...] = ()  # empty: the origin of every segment, under the segment's name

    def __post_init__(self) -> None:
        self._check_names()
        names: list[str] = []
        for segment in self.segments:
            if segment.name in names:
                raise BodyError(f"two segments are named '{segment.name}'; give each its own name")
            if (segment.parent is None) != (not names):
                raise BodyError(f"segment '{segment.name}': exactly the first segment has no parent")
            if segment.parent is not None and segment.parent not in names:
                listed = ", ".join(names)
                raise BodyError(
                    f"segment '{segment.name}': parent '{segment.parent}' must stand before it; so far: {listed}"
                )
            names.append(segment.name)
        for landmark in self.landmarks:
            if landmark.segment not in names:
                raise BodyError(
                    f"landmark '{landmark.name}': no segment '{landmark.segment}'; it has: {', '.join(names)}"
                )
        if len({landmark.name for landmark in self.landmarks}) < len(self.landmarks):
            raise BodyError(f"two landmarks of body '{self.name}' share a name; give each its own")
        if not self.landmarks:
            origins = tuple(Landmark(segment.name, segment.name, np.zeros(3)) for segment in self.segments)
            object.__setattr__(self, "landmarks", origins)
        if not any(segment.parts for segment in self.segments):
            raise BodyError(f"body '{self.name}' has no part to see; add a [[segment.part]]")

    def __repr__(self) -> str:
        return f"<BodyModel '{self.name}': {count(len(self.segments), 'segment')}, {self.n_dofs} degrees of freedom>"

    def _check_names(self) -> None:
        try:
            list(map(check_name, [self.name, *(part.name for part in self.parts)]))
            list(map(check_column, [*(each.name for each in self.segments), *(each.name for each in self.landmarks)]))
        except ValueError as error:
            raise BodyError(str(error)) from None

    @cached_property
    def parents(self) -> NDArray[np.int64]:
        """The index of each segment's parent, -1 for the root: (segments,)."""
        names = [segment.name for segment in self.segments]
        return np.array([-1 if s.parent is None else names.index(s.parent) for s in self.segments])

    @cached_property
    def joints_m(self) -> Array:
        """Where every segment's joint lies in its parent: (segments, 3) [m]."""
        return np.array([segment.joint_m for segment in self.segments], float)

    @cached_property
    def landmark_segments(self) -> NDArray[np.int64]:
        """The index of each landmark's segment: (landmarks,)."""
        return np.array([self.index_of(landmark.segment) for landmark in self.landmarks], np.int64)

    @cached_property
    def landmarks_m(self) -> Array:
        """Where every landmark lies in its segment: (landmarks, 3) [m]."""
        return np.array([landmark.position_m for landmark in self.landmarks], float).reshape(-1, 3)

    @property
    def n_joints(self) -> int:
        """The number of joints: every segment but the root has one."""
        return len(self.segments) - 1

    @property
    def has_joints(self) -> bool:
        """Whether the body is more than one rigid piece."""
        return self.n_joints > 0

    @property
    def n_dofs(self) -> int:
        """The number of degrees of freedom: six of the root, three of each joint."""
        return 6 + 3 * self.n_joints

    @cached_property
    def limits(self) -> JointLimits:
        """The limits of every joint, stacked: (segments - 1)."""
        return JointLimits.stack(segment.limits for segment in self.segments[1:])

    def index_of(self, segment: str) -> int:
        """Return a segment's index; raises BodyError for a name that is not there."""
        names = [each.name for each in self.segments]
        if segment not in names:
            raise BodyError(f"body '{self.name}' has no segment '{segment}'; it has: {', '.join(names)}")
        return names.index(segment)

    @property
    def parts(self) -> tuple[Part, ...]:
        """Every part, in the order of the segments."""
        return tuple(part for segment in self.segments for part in segment.parts)

    @property
    def notes(self) -> tuple[str, ...]:
        """What its file had in an older form, and those of its meshes that was not as it should be."""
        of_meshes = tuple(part.shape.note for part in self.parts if isinstance(part.shape, Mesh) and part.shape.note)
        older = ", ".join(segment.name for segment in self.segments if segment.limits.is_from_angles)
        return (*of_meshes, f"body: limits_deg of {older} are read as a swing and a twist") if older else of_meshes

    @property
    def needs_colours(self) -> bool:
        """Whether a part's colour has yet to be sampled from the video."""
        return any(part.colour is None for part in self.parts)

    def with_colours(self, colours: Array) -> BodyModel:
        """Return the body with the colours (parts, 3), sRGB 0..255, in the order of `parts`."""
        rows = iter(np.asarray(colours, float))
        segments = tuple(replace(s, parts=tuple(replace(p, colour=next(rows)) for p in s.parts)) for s in self.segments)
        return replace(self, segments=segments)

    def with_pose(self, pose: Pose) -> PosedBody:
        """Pose the body in the world (forward kinematics)."""
        angles = pose.joint_angles if pose.joint_angles.size else np.zeros((self.n_joints, 3))
        if angles.shape != (self.n_joints, 3):
            raise BodyError(f"body '{self.name}' has {self.n_joints} joints, the pose {len(angles)}")
        root = pose.world_from_root.as_matrix()
        R, t = self.pose_segments(root[:3, :3], root[:3, 3], angles[None])
        return PosedBody(self, R[0], t[0])

    def pose_segments(self, root_R: Array, root_t: Array, joint_angles: Array) -> tuple[Array, Array]:
        """Pose the segments of n hypotheses in the world (forward kinematics): R (n, s, 3, 3), t (n, s, 3) [m].

        root_R (n, 3, 3) or (3, 3), root_t (n, 3) or (3,) [m] world from root; joint_angles (n, s - 1, 3) [rad],
        successive rotations about the moving x, y and z axes, in the order of the segments.
        """
        n, s = len(joint_angles), len(self.segments)
        R, t = np.empty((n, s, 3, 3)), np.empty((n, s, 3))
        R[:, 0], t[:, 0] = root_R, root_t
        chain_segments(self.parents, self.joints_m, np.ascontiguousarray(joint_angles, float), R, t)
        return R, t


@dataclass(frozen=True, slots=True, eq=False)
class PosedBody:
    """A body in the world."""

    model: BodyModel
    R: Array  # (segments, 3, 3) world from segment, rotations
    t: Array  # (segments, 3) world from segment, translations [m]

    @property
    def landmarks(self) -> Array:
        """The positions of the model's landmarks: (landmarks, 3) world [m]."""
        owners = self.model.landmark_segments
        return np.einsum("nij,nj->ni", self.R[owners], self.model.landmarks_m) + self.t[owners]

    def move(self, motion: Array) -> PosedBody:
        """Move the whole body: motion (6,) is a translation [m], a rotation about the root [rad], world axes."""
        R = Rotation.from_rotvec(motion[3:]).as_matrix()
        return PosedBody(self.model, R @ self.R, (self.t - self.t[0]) @ R.T + self.t[0] + motion[:3])


def _require_positive(values: Array, name: str) -> None:
    if values.shape != (3,) or not np.all(np.isfinite(values)) or np.any(values < _SHORTEST_M):
        raise BodyError(f"{name} is {np.asarray(values).tolist()}; it needs three lengths above zero, in metres")
    if np.any(values > LONGEST_M):
        raise BodyError(f"{name} is {np.asarray(values).tolist()}: over {LONGEST_M:.0f} m; is it in mm or cm?")
