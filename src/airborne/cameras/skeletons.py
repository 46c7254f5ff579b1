"""Skeletons: which points of a person a pose network finds, in its order, and the landmarks between them.

Points have our own names (`hip_left`, `toe_right`, ...), whichever skeleton a network uses. The orders are those of the
networks' makers: COCO and COCO-WholeBody, OpenPose's COCO, BODY_25 and BODY_25B, Halpe-FullBody, BlazePose.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from airborne.errors import CalibrationError


@dataclass(frozen=True, slots=True)
class Skeleton:
    """The points of one kind of pose network."""

    name: str
    n_points: int  # of a person in a file
    points: tuple[str, ...]  # the names of the first ones; further ones, of hands and face, are not used


def choose_skeleton(where: str, n_points: int, said: Iterable[str], given: str | None) -> Skeleton:
    """Choose the skeleton of lists of `n_points`: as files say, or as the user gives; without a word the only one.

    `n_points` is that of at least one skeleton. Raises CalibrationError for an unknown name, for words that contradict
    each other or the number, and where several skeletons have as many points and nothing says which it is.
    """
    names = {skeleton_of_name(name, where).name for name in (*said, *(() if given is None else (given,)))}
    if len(names) > 1:
        raise CalibrationError(
            f"{where}: the skeleton is {' and '.join(sorted(names))}; expected one, correct the other"
        )
    alike = [skeleton for skeleton in SKELETONS.values() if skeleton.n_points == n_points]
    listed = " or ".join(skeleton.name for skeleton in alike)
    if names:
        skeleton = SKELETONS[names.pop()]
        if skeleton not in alike:
            raise CalibrationError(
                f"{where}: {n_points} points per image are those of {listed}; skeleton {skeleton.name} has "
                f"{skeleton.n_points}"
            )
        return skeleton
    if len(alike) > 1:
        raise CalibrationError(
            f"{where}: {n_points} points per image may be {listed}, and the files do not say which; "
            f'give skeleton = "{alike[0].name}" beside detections, or --skeleton {alike[0].name}'
        )
    return alike[0]


def skeleton_of_name(name: str, where: str) -> Skeleton:
    """Return the skeleton of a name, however it is written (body-25b). Raises CalibrationError for an unknown one."""
    for skeleton in SKELETONS.values():
        if _plain(skeleton.name) == _plain(name):
            return skeleton
    raise CalibrationError(f"{where}: no skeleton '{name:.40}'; expected one of {', '.join(SKELETONS)}")


def _plain(name: str) -> str:
    return "".join(letter for letter in name.casefold() if letter.isalnum())


def _both_sides(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}_{side}" for name in names for side in ("left", "right"))


def _limb(side: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{name}_{side}" for name in names)


_COCO = ("nose", *_both_sides("eye", "ear", "shoulder", "elbow", "wrist", "hip", "knee", "ankle"))
_HALPE = (*_COCO, "head_top", "mid_shoulder", "mid_hip", *_both_sides("toe", "small_toe", "heel"))
_ARM, _LEG, _TOES = ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"), ("toe", "small_toe", "heel")
_FACE = ("eye_right", "eye_left", "ear_right", "ear_left")
_RIGHT_FIRST = ("nose", "mid_shoulder", *_limb("right", *_ARM), *_limb("left", *_ARM))
_EYES = (*_limb("left", "inner_eye", "eye", "outer_eye"), *_limb("right", "inner_eye", "eye", "outer_eye"))
_FEET = (*_limb("left", *_TOES), *_limb("right", *_TOES))
_BODY_25 = (*_RIGHT_FIRST, "mid_hip", *_limb("right", *_LEG), *_limb("left", *_LEG), *_FACE, *_FEET)
_BLAZEPOSE = (
    *("nose", *_EYES, *_both_sides("ear", "mouth", "shoulder", "elbow", "wrist")),
    *_both_sides("little_knuckle", "index_knuckle", "thumb", "hip", "knee", "ankle", "heel", "toe"),
)

SKELETONS = {
    skeleton.name: skeleton
    for skeleton in (
        Skeleton("COCO", 17, _COCO),
        Skeleton("COCO_18", 18, (*_RIGHT_FIRST, *_limb("right", *_LEG), *_limb("left", *_LEG), *_FACE)),
        Skeleton("BODY_25", 25, _BODY_25),
        Skeleton("BODY_25B", 25, (*_COCO, "upper_neck", "head_top", *_FEET)),
        Skeleton("HALPE_26", 26, _HALPE),
        Skeleton("BLAZEPOSE", 33, _BLAZEPOSE),
        Skeleton("COCO_133", 133, (*_COCO, *_FEET)),
        Skeleton("HALPE_136", 136, _HALPE),
    )
}


def _recipes(side: str) -> dict[str, tuple[dict[str, float], ...]]:
    toe, small, heel = _limb(side, *_TOES)
    return {
        f"hand_{side}": ({f"index_knuckle_{side}": 0.5, f"little_knuckle_{side}": 0.5},),
        f"foot_{side}": ({heel: 0.25, toe: 0.375, small: 0.375}, {heel: 0.25, toe: 0.75}),
    }


LANDMARK_RECIPES: dict[str, tuple[dict[str, float], ...]] = {
    "head": ({"ear_left": 0.5, "ear_right": 0.5},),
    **_recipes("left"),
    **_recipes("right"),
}  # landmark -> shares of the points that it lies between, the first recipe that can be followed
