"""Clothes and hair: a material for each face, and skin moved out to where the cloth is, with wrinkles."""

from __future__ import annotations

import numpy as np
from people import Person

Parts = dict[str, np.ndarray]  # by bone

_SKIN, _HAIR, _TOP, _SHORTS, _SOCKS = range(5)
_SIDES = ("Left", "Right")
_TRUNK = ("Spine", "Spine1", "Spine2", "Hips", "LeftShoulder", "RightShoulder")
_COLLAR_M = 0.01  # chosen: how far a top reaches over the neck's joint
_WRINKLES, _WRINKLE_SD_PER_M, _WRINKLE_SHARE = 12, 40, 0.35  # chosen: waves, their wave numbers, depth of the looseness


def dress(
    vertices_m: np.ndarray, faces: np.ndarray, weights: Parts, heads_m: Parts, person: Person
) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (v, 3) [m] of the dressed body and the faces' materials (f,), from those of the bare one.

    Weights (v,) and heads (3,) [m] are by bone.
    """
    outfit = person.outfit
    socks = _socks(vertices_m, weights, heads_m, outfit.socks)
    where = {
        _TOP: _top(vertices_m, weights, heads_m, outfit.sleeve),
        _SOCKS: socks,
        _SHORTS: _shorts(vertices_m, weights, heads_m, outfit.shorts) & ~socks,
        _HAIR: _hair(vertices_m, weights, heads_m),
    }
    off_m = {_TOP: outfit.loose_m, _SOCKS: outfit.shoe_m, _SHORTS: outfit.loose_shorts_m, _HAIR: outfit.hair_m}
    materials, thickness_m = np.full(len(vertices_m), _SKIN), np.zeros(len(vertices_m))
    for material, is_here in where.items():  # later ones lie over earlier ones
        materials[is_here], thickness_m[is_here] = material, off_m[material]
    is_cloth = np.isin(materials, [_TOP, _SHORTS])
    waves = _waves(np.random.default_rng(person.seed), vertices_m)
    thickness_m *= 1 + _WRINKLE_SHARE * waves * is_cloth
    dressed_m = vertices_m + _normals(vertices_m, faces) * thickness_m[:, None]
    return dressed_m, np.array([np.bincount(corners).argmax() for corners in materials[faces]])


def _along(vertices_m: np.ndarray, start_m: np.ndarray, end_m: np.ndarray) -> np.ndarray:
    """Return how far vertices lie along a bone, as a share of its length: (v,)."""
    bone_m = end_m - start_m
    return (vertices_m - start_m) @ bone_m / (bone_m @ bone_m)


def _trunk(weights: Parts) -> np.ndarray:
    return sum((weights[bone] for bone in _TRUNK), np.zeros(())) > 0.5


def _top(vertices_m: np.ndarray, weights: Parts, heads_m: Parts, sleeve: float) -> np.ndarray:
    z = vertices_m[:, 2]
    top = _trunk(weights) & (z > heads_m["Spine"][2]) & (z < heads_m["Neck"][2] + _COLLAR_M)
    for side in _SIDES if sleeve > 0 else ():
        shoulder, elbow, wrist = (heads_m[side + bone] for bone in ("Arm", "ForeArm", "Hand"))
        top |= (weights[f"{side}Arm"] > 0.3) & (_along(vertices_m, shoulder, elbow) < min(sleeve, 1.2))
        if sleeve > 1:
            top |= (weights[f"{side}ForeArm"] > 0.5) & (_along(vertices_m, elbow, wrist) < sleeve - 1)
    return top


def _shorts(vertices_m: np.ndarray, weights: Parts, heads_m: Parts, length: float) -> np.ndarray:
    shorts = _trunk(weights) & (vertices_m[:, 2] <= heads_m["Spine"][2])
    for side in _SIDES:
        hip, knee, ankle = (heads_m[side + bone] for bone in ("UpLeg", "Leg", "Foot"))
        shorts |= (weights[f"{side}UpLeg"] > 0.3) & (_along(vertices_m, hip, knee) < min(length, 1.3))
        if length > 1:
            shorts |= (weights[f"{side}Leg"] > 0.4) & (_along(vertices_m, knee, ankle) < length - 1)
    return shorts


def _socks(vertices_m: np.ndarray, weights: Parts, heads_m: Parts, length: float) -> np.ndarray:
    socks = np.zeros(len(vertices_m), bool)
    for side in _SIDES if length > 0 else ():
        along = _along(vertices_m, heads_m[f"{side}Leg"], heads_m[f"{side}Foot"])
        socks |= weights[f"{side}Foot"] + weights[f"{side}ToeBase"] > 0.5
        socks |= (weights[f"{side}Leg"] > 0.4) & (along > 1 - length)
    return socks


def _hair(vertices_m: np.ndarray, weights: Parts, heads_m: Parts) -> np.ndarray:
    """Return which vertices have hair: the top and the back of the head, not the face."""
    z = vertices_m[:, 2]
    is_head = sum((share for bone, share in weights.items() if bone.startswith("Head")), np.zeros(())) > 0.5
    up = (z - heads_m["Head"][2]) / (z.max() - heads_m["Head"][2])
    of_head = vertices_m[is_head, 1]
    back = (vertices_m[:, 1] - of_head.min()) / np.ptp(of_head)
    return is_head & ((up > 0.72) | ((back > 0.45) & (up > 0.18))) & ~((back < 0.25) & (up < 0.85))


def _waves(rng: np.random.Generator, vertices_m: np.ndarray) -> np.ndarray:
    """Return a sum of plane waves at the vertices, with a mean square of one: (v,)."""
    waves = np.zeros(len(vertices_m))
    for _ in range(_WRINKLES):
        wave_numbers = rng.normal(0, _WRINKLE_SD_PER_M, 3)
        waves += np.sin(vertices_m @ wave_numbers + rng.uniform(0, 6))
    return waves / np.sqrt(_WRINKLES / 2)


def _normals(vertices_m: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit normals (v, 3) from faces of four corners."""
    a, b, c, _ = vertices_m[faces].swapaxes(0, 1)
    of_faces = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices_m)
    for corner in faces.T:
        np.add.at(normals, corner, of_faces)
    return normals / (np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12)
