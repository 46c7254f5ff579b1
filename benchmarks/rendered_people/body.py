"""MakeHuman's body (CC0, by the package anny): its shape, its pose by joint angles, its skin by linear blending.

At rest the body stands along z, faces -y and has its left at +x.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import anny  # pyright: ignore[reportMissingImports]
import numpy as np
from clothes import dress
from people import Person
from rotations import about_x, about_y, about_z, rotation_between

_PREFIX = "mixamorig:"  # of the names of bones
_SIDES = (("Left", 1), ("Right", -1))
_HALVINGS = 14  # chosen: the stature to 0.1 mm, the rest by scaling
_COLLAR_SHARE, _COLLAR_MOST_DEG = 0.12, 150  # chosen: how far a collar bone rises with the arm, and up to which angle
_LIMB_JOINTS = {  # by the bone that begins there
    "hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "foot": "ToeBase",
    "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A dressed body at rest; bones turn about their heads."""

    bones: tuple[str, ...]
    parents: tuple[int, ...]  # -1 for the pelvis, which comes first
    heads_m: np.ndarray  # (bones, 3)
    tails_m: np.ndarray  # (bones, 3)
    weights: np.ndarray  # (vertices, bones), adding up to 1
    vertices_m: np.ndarray  # (vertices, 3)
    faces: np.ndarray  # (faces, 4) vertices
    materials: np.ndarray  # (faces,) skin, hair, top, shorts, socks: 0 to 4

    def head(self, bone: str) -> np.ndarray:
        """Return where a bone begins (3,) [m]."""
        return self.heads_m[self.bones.index(bone)]


class Pose(NamedTuple):
    """Bones in the pelvis's frame, whose origin is the pelvis's head."""

    R: dict[str, np.ndarray]  # (3, 3) from rest
    heads_m: dict[str, np.ndarray]  # (3,)


def body_of(person: Person) -> Body:
    """Return a person's body in the clothes."""
    model = anny.create_fullbody_model(rig="mixamo", topology="default", all_phenotypes=True)
    shape = {word: person.phenotype.get(word, 0.5) for word in model.phenotype_labels}
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        shape["height"] = (low + high) / 2
        rest = model(phenotype_kwargs=shape, return_bone_ends=True)
        vertices = rest["rest_vertices"][0].numpy().astype(float)
        if np.ptp(vertices[:, 2]) < person.stature_m:
            low = shape["height"]
        else:
            high = shape["height"]
    scale = person.stature_m / np.ptp(vertices[:, 2])
    weights = np.zeros((len(vertices), len(model.bone_labels)))
    np.put_along_axis(weights, model.vertex_bone_indices.numpy(), model.vertex_bone_weights.numpy(), axis=1)
    bones = tuple(name.removeprefix(_PREFIX) for name in model.bone_labels)
    heads_m = scale * rest["rest_bone_heads"][0].numpy().astype(float)
    weights /= weights.sum(axis=1, keepdims=True)
    faces = model.faces.numpy()
    dressed_m, materials = dress(
        scale * vertices,
        faces,
        dict(zip(bones, weights.T, strict=True)),
        dict(zip(bones, heads_m, strict=True)),
        person,
    )
    return Body(
        bones=bones,
        parents=tuple(int(parent) for parent in model.bone_parents),
        heads_m=heads_m,
        tails_m=scale * rest["rest_bone_tails"][0].numpy().astype(float),
        weights=weights,
        vertices_m=dressed_m,
        faces=faces,
        materials=materials,
    )


def pose_of(body: Body, angles_deg: dict[str, float]) -> Pose:
    """Return the pose at joint angles, named as in people.py, with a side at the limbs'."""
    step = (
        about_x(angles_deg["trunk"] / 3)
        @ about_y(angles_deg["trunk_side"] / 3)
        @ about_z(angles_deg["trunk_twist"] / 3)
    )
    nod = about_x(angles_deg["head"] / 2)
    chest = step @ step @ step
    R = {"Hips": np.eye(3), "Spine": step, "Spine1": step @ step, "Spine2": chest, "Neck": chest @ nod}
    R["Head"] = R["Neck"] @ nod
    for side, sign in _SIDES:
        of_side = {name[:-2]: angle for name, angle in angles_deg.items() if name.endswith(f"_{side[0].lower()}")}
        R |= _arm(body, side, sign, chest, of_side) | _leg(side, sign, of_side)
    heads_m: dict[str, np.ndarray] = {}
    for index, (bone, parent) in enumerate(zip(body.bones, body.parents, strict=True)):
        above = body.bones[parent]
        at_rest_m = body.heads_m[index] - body.heads_m[parent]
        heads_m[bone] = np.zeros(3) if parent < 0 else heads_m[above] + R[above] @ at_rest_m
    return Pose(R, heads_m)


def _arm(body: Body, side: str, sign: int, chest: np.ndarray, angles_deg: dict[str, float]) -> dict[str, np.ndarray]:
    """Return the rotations of a side's collar, arm, forearm, hand and fingers."""
    down = np.array([0, 0, -1.0])
    shoulder, elbow, wrist = (body.head(side + bone) for bone in ("Arm", "ForeArm", "Hand"))
    raised_deg = min(abs(max(angles_deg["arm"], angles_deg["abd"])), _COLLAR_MOST_DEG)
    arm = (
        chest @ about_x(-angles_deg["arm"]) @ about_y(-sign * angles_deg["abd"]) @ about_z(sign * angles_deg["armrot"])
    )
    forearm = arm @ about_x(-angles_deg["elbow"]) @ rotation_between(wrist - elbow, down)
    hand = {bone: forearm for bone in body.bones if bone.startswith(f"{side}Hand")}
    return {
        f"{side}Shoulder": chest @ about_y(-sign * _COLLAR_SHARE * raised_deg),
        f"{side}Arm": arm @ rotation_between(elbow - shoulder, down),
        f"{side}ForeArm": forearm,
        **hand,
    }


def _leg(side: str, sign: int, angles_deg: dict[str, float]) -> dict[str, np.ndarray]:
    """Return the rotations of a side's thigh, shank, foot and toes."""
    thigh = about_x(-angles_deg["hip"]) @ about_y(-sign * angles_deg["hipabd"]) @ about_z(sign * angles_deg["hiprot"])
    shank = thigh @ about_x(angles_deg["knee"])
    foot = shank @ about_x(angles_deg["plantar"])
    return {f"{side}UpLeg": thigh, f"{side}Leg": shank, f"{side}Foot": foot, f"{side}ToeBase": foot}


def joints_of(body: Body, pose: Pose) -> dict[str, np.ndarray]:
    """Return the joints by the names of airborne's landmarks, in the pelvis's frame (3,) [m]."""
    joints = {}
    for side, _ in _SIDES:
        at = f"_{side.lower()}"
        joints |= {joint + at: pose.heads_m[side + bone] for joint, bone in _LIMB_JOINTS.items()}
        to_knuckle_m = body.head(f"{side}HandMiddle1") - body.head(f"{side}Hand")
        joints[f"hand{at}"] = pose.heads_m[f"{side}Hand"] + pose.R[f"{side}Hand"] @ to_knuckle_m
    joints["neck"] = pose.heads_m["Neck"]
    to_middle_m = (body.tails_m[body.bones.index("Head")] - body.head("Head")) / 2
    joints["head"] = pose.heads_m["Head"] + pose.R["Head"] @ to_middle_m
    joints["pelvis"] = (joints["hip_left"] + joints["hip_right"]) / 2
    return joints


def skin_of(body: Body, pose: Pose) -> np.ndarray:
    """Return the vertices in a pose, in the pelvis's frame: (vertices, 3) [m]."""
    skin_m = np.zeros_like(body.vertices_m)
    for index, bone in enumerate(body.bones):
        moved = body.weights[:, index] > 0
        posed_m = (body.vertices_m[moved] - body.heads_m[index]) @ pose.R[bone].T + pose.heads_m[bone]
        skin_m[moved] += body.weights[moved, index, None] * posed_m
    return skin_m
