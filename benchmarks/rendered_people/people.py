"""Who is recorded: ten people of other builds, in other clothes, with other skills.

Angles are named as follows, zero in upright stance with hanging arms, with `_l` or `_r` for one side only:

- `trunk`, `head`: bent forward; `trunk_side`: bent to the side; `trunk_twist`: turned about the trunk
- `arm`: raised forward; `abd`: raised sideways; `armrot`: turned about itself; `elbow`: bent
- `hip`: thigh raised forward; `hipabd`: spread; `hiprot`: turned about itself; `knee`: bent; `plantar`: foot stretched
"""

from __future__ import annotations

from dataclasses import dataclass, fields

Triple = tuple[float, float, float]
Keys = tuple[tuple[float, float], ...]  # (time [s], angle [deg]), with rest at each


@dataclass(frozen=True, slots=True, kw_only=True)
class Outfit:
    """Where clothes end, and how far they and the hair stand off the skin."""

    sleeve: float  # share of the upper arm; over 1, also of the forearm; 0 for none
    loose_m: float  # of the top
    shorts: float  # share of the thigh; over 1, also of the shank
    loose_shorts_m: float
    socks: float  # share of the shank, from below; 0 for bare feet
    shoe_m: float = 0.003
    hair_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Colours:
    """The colours of a person's surfaces, sRGB from 0 to 255, in the order of `Body.materials`."""

    skin: Triple
    hair: Triple
    top: Triple
    shorts: Triple
    socks: Triple

    def by_material(self) -> list[Triple]:
        """Return the colours in their order."""
        return [getattr(self, field.name) for field in fields(self)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Person:
    """One recording: who flies, how, and what the cameras are."""

    seed: int
    is_female: bool
    stature_m: float
    mass_kg: float
    n_frames: int  # at 60 per second
    n_cameras: int
    light: str  # "hall" (lamps above) or "window" (from one side)
    angular_momentum: Triple  # [kg m^2/s], world axes, about the centre of mass
    centre_m: Triple  # of mass, in frame 0
    velocity_m_s: Triple  # in frame 0
    phenotype: dict[str, float]  # MakeHuman's words, 0 to 1; others are 0.5, and its height follows the stature
    outfit: Outfit
    colours: Colours
    angles_deg: dict[str, Keys]


# fmt: off
PEOPLE = {  # all chosen: builds, clothes and skills unlike each other
    "1": Person(  # piked front somersault with half a twist, tall man in T-shirt and long shorts
        seed=1, is_female=False, stature_m=1.88, mass_kg=82, n_frames=54, n_cameras=4, light="hall",
        angular_momentum=(95, 0, 0), centre_m=(0, 0.2, 1.5), velocity_m_s=(0.1, -0.6, 4),
        phenotype={
            "gender": 1, "age": 0.5, "muscle": 0.75, "weight": 0.5, "proportions": 0.6, "caucasian": 1, "african": 0,
            "asian": 0,
        },
        outfit=Outfit(
            sleeve=0.55, loose_m=0.012, shorts=0.7, loose_shorts_m=0.018, socks=0.35, shoe_m=0.012, hair_m=0.01,
        ),
        colours=Colours(
            skin=(214, 172, 146), hair=(120, 84, 50), top=(240, 240, 235), shorts=(30, 60, 130), socks=(40, 40, 44),
        ),
        angles_deg={
            "arm": ((0, 165), (0.25, 80), (0.75, 30)), "abd": ((0, 10), (0.3, 30)), "elbow": ((0, 15), (0.3, 40)),
            "hip": ((0, 5), (0.3, 115), (0.62, 115), (0.9, 15)), "knee": ((0, 5), (0.3, 8), (0.9, 15)),
            "plantar": ((0, 20), (0.2, 40)), "trunk": ((0, -5), (0.3, 25), (0.6, 25), (0.9, 0)),
            "head": ((0, 0), (0.3, 25), (0.8, 0)), "abd_r": ((0, 10), (0.35, 30), (0.55, 110)),
        },
    ),
    "2": Person(  # back layout with a full twist, young woman in a leotard with long sleeves
        seed=2, is_female=True, stature_m=1.57, mass_kg=50, n_frames=51, n_cameras=3, light="window",
        angular_momentum=(-52, 3, 0), centre_m=(0.1, 0, 1.3), velocity_m_s=(0, 0.9, 3.8),
        phenotype={
            "gender": 0, "age": 0.42, "muscle": 0.6, "weight": 0.4, "proportions": 0.6, "caucasian": 0, "african": 1,
            "asian": 0, "cupsize": 0.3,
        },
        outfit=Outfit(sleeve=1.95, loose_m=0.002, shorts=0.14, loose_shorts_m=0.003, socks=0, hair_m=0.012),
        colours=Colours(
            skin=(116, 78, 56), hair=(20, 17, 16), top=(150, 30, 90), shorts=(150, 30, 90), socks=(90, 60, 50),
        ),
        angles_deg={
            "arm_l": ((0, 170), (0.22, 120), (0.7, 60)), "arm_r": ((0, 170), (0.22, 60), (0.7, 60)),
            "abd_l": ((0, 5), (0.22, 10), (0.45, 70)), "abd_r": ((0, 5), (0.22, 60), (0.45, 75)),
            "elbow_l": ((0, 5), (0.22, 100), (0.55, 90), (0.8, 20)),
            "elbow_r": ((0, 5), (0.25, 70), (0.55, 80), (0.8, 20)), "hip": ((0, -12), (0.4, 5), (0.8, 20)),
            "knee": ((0, 5),), "plantar": ((0, 45),), "trunk": ((0, -25), (0.4, -5), (0.8, 10)),
            "head": ((0, -20), (0.4, 0)), "trunk_twist": ((0, 0), (0.2, -20), (0.5, 0)),
        },
    ),
    "3": Person(  # volleyball spike, man in a sleeveless jersey and shoes; hardly turns
        seed=3, is_female=False, stature_m=1.95, mass_kg=88, n_frames=38, n_cameras=3, light="hall",
        angular_momentum=(6, 2, 4), centre_m=(0.2, 0, 1.28), velocity_m_s=(0.2, -1.2, 3),
        phenotype={
            "gender": 1, "age": 0.55, "muscle": 0.7, "weight": 0.45, "proportions": 0.7, "caucasian": 0.4,
            "african": 0, "asian": 0.6,
        },
        outfit=Outfit(
            sleeve=0, loose_m=0.014, shorts=0.6, loose_shorts_m=0.02, socks=0.3, shoe_m=0.016, hair_m=0.012,
        ),
        colours=Colours(
            skin=(222, 184, 150), hair=(25, 22, 22), top=(220, 120, 20), shorts=(20, 20, 22), socks=(235, 235, 235),
        ),
        angles_deg={
            "arm_r": ((0, 60), (0.12, 150), (0.3, 185), (0.42, 150), (0.52, 40)),
            "abd_r": ((0, 40), (0.15, 40), (0.3, 10)), "elbow_r": ((0, 70), (0.15, 120), (0.31, 110), (0.4, 10)),
            "armrot_r": ((0, 0), (0.2, -50), (0.4, 0)), "arm_l": ((0, 110), (0.2, 150), (0.42, 30)),
            "abd_l": ((0, 20),), "elbow_l": ((0, 20), (0.4, 60)), "hip_l": ((0, -15), (0.3, -10), (0.5, 25)),
            "hip_r": ((0, -10), (0.3, -25), (0.5, 20)), "knee_l": ((0, 20), (0.25, 75), (0.5, 20)),
            "knee_r": ((0, 10), (0.25, 90), (0.5, 25)), "plantar": ((0, 40), (0.5, 20)),
            "trunk": ((0, -15), (0.3, -25), (0.5, 20)), "trunk_twist": ((0, -20), (0.3, -30), (0.5, 20)),
            "head": ((0, -15),), "hipabd": ((0, 5),),
        },
    ),
    "4": Person(  # tucked back somersault, boy in long trousers
        seed=4, is_female=False, stature_m=1.66, mass_kg=58, n_frames=53, n_cameras=3, light="window",
        angular_momentum=(-42, 0, 0), centre_m=(-0.1, 0.1, 1.25), velocity_m_s=(0, 0.5, 3.6),
        phenotype={
            "gender": 0.9, "age": 0.38, "muscle": 0.6, "weight": 0.35, "proportions": 0.5, "caucasian": 1,
            "african": 0, "asian": 0,
        },
        outfit=Outfit(
            sleeve=0.5, loose_m=0.008, shorts=1.9, loose_shorts_m=0.006, socks=0.05, shoe_m=0.004, hair_m=0.018,
        ),
        colours=Colours(
            skin=(232, 196, 172), hair=(170, 130, 70), top=(30, 120, 70), shorts=(90, 92, 98), socks=(225, 222, 216),
        ),
        angles_deg={
            "arm": ((0, 170), (0.25, 60), (0.6, 55), (0.85, 90)), "abd": ((0, 10), (0.25, 15)),
            "elbow": ((0, 5), (0.25, 45), (0.6, 45), (0.85, 15)),
            "hip": ((0, -5), (0.25, 125), (0.58, 125), (0.8, 10)), "hipabd": ((0, 2), (0.25, 10)),
            "knee": ((0, 5), (0.25, 125), (0.58, 125), (0.8, 12)), "plantar": ((0, 40),),
            "trunk": ((0, -10), (0.25, 35), (0.58, 35), (0.8, 0)), "head": ((0, -5), (0.25, 15), (0.7, 0)),
        },
    ),
    "5": Person(  # split leap turning about the vertical, woman with bare legs
        seed=5, is_female=True, stature_m=1.7, mass_kg=60, n_frames=39, n_cameras=4, light="hall",
        angular_momentum=(-4, 2, 9), centre_m=(-0.3, 0.8, 1.22), velocity_m_s=(0.1, -2.2, 3),
        phenotype={
            "gender": 0, "age": 0.5, "muscle": 0.5, "weight": 0.45, "proportions": 0.8, "caucasian": 0.7,
            "african": 0, "asian": 0.3, "cupsize": 0.5,
        },
        outfit=Outfit(sleeve=0, loose_m=0.003, shorts=0.35, loose_shorts_m=0.003, socks=0, hair_m=0.014),
        colours=Colours(
            skin=(226, 180, 150), hair=(60, 35, 25), top=(20, 20, 24), shorts=(200, 40, 45), socks=(200, 160, 130),
        ),
        angles_deg={
            "arm_l": ((0, 20), (0.3, 90)), "arm_r": ((0, 20), (0.3, 70)), "abd_l": ((0, 30), (0.3, 20)),
            "abd_r": ((0, 30), (0.3, 80)), "elbow": ((0, 20), (0.3, 8)), "hip_l": ((0, 10), (0.28, 85), (0.65, 20)),
            "hip_r": ((0, -10), (0.28, -60), (0.65, -5)), "knee_l": ((0, 60), (0.25, 4)),
            "knee_r": ((0, 15), (0.28, 6)), "plantar": ((0, 45),), "trunk": ((0, 0), (0.3, -12)),
            "hiprot_r": ((0, 0), (0.3, 20)),
        },
    ),
    "6": Person(  # twisting dive of a heavy man, seen by two cameras
        seed=6, is_female=False, stature_m=1.75, mass_kg=92, n_frames=54, n_cameras=2, light="window",
        angular_momentum=(70, 6, 5), centre_m=(0, 0.3, 1.5), velocity_m_s=(0.1, -1, 3.7),
        phenotype={
            "gender": 1, "age": 0.6, "muscle": 0.55, "weight": 0.75, "proportions": 0.4, "caucasian": 1,
            "african": 0, "asian": 0,
        },
        outfit=Outfit(
            sleeve=0.5, loose_m=0.01, shorts=0.75, loose_shorts_m=0.02, socks=0.2, shoe_m=0.014, hair_m=0.006,
        ),
        colours=Colours(
            skin=(208, 160, 134), hair=(70, 60, 55), top=(70, 75, 160), shorts=(120, 115, 100), socks=(50, 50, 52),
        ),
        angles_deg={
            "arm_l": ((0, 160), (0.3, 60), (0.7, 150)), "arm_r": ((0, 160), (0.3, 100), (0.7, 150)),
            "abd_l": ((0, 10), (0.3, 50), (0.7, 10)), "abd_r": ((0, 10), (0.3, 20), (0.7, 10)),
            "elbow": ((0, 10), (0.3, 50), (0.7, 5)), "hip": ((0, 0), (0.3, 60), (0.7, 10)),
            "knee": ((0, 10), (0.3, 40), (0.7, 5)), "plantar": ((0, 30),), "trunk": ((0, 0), (0.3, 15)),
            "trunk_twist": ((0, 0), (0.2, 25), (0.5, 0)), "head": ((0, 0), (0.3, 10)),
        },
    ),
    "7": Person(  # tucked front somersault, man in loose long clothes
        seed=7, is_female=False, stature_m=1.8, mass_kg=75, n_frames=52, n_cameras=3, light="window",
        angular_momentum=(60, 0, 0), centre_m=(0.1, 0.2, 1.4), velocity_m_s=(0.1, -0.7, 3.7),
        phenotype={
            "gender": 1, "age": 0.45, "muscle": 0.65, "weight": 0.45, "proportions": 0.55, "caucasian": 0,
            "african": 1, "asian": 0,
        },
        outfit=Outfit(
            sleeve=1.8, loose_m=0.014, shorts=1.85, loose_shorts_m=0.014, socks=0.08, shoe_m=0.014, hair_m=0.008,
        ),
        colours=Colours(
            skin=(98, 66, 48), hair=(18, 16, 15), top=(205, 190, 60), shorts=(60, 62, 70), socks=(230, 230, 232),
        ),
        angles_deg={
            "arm": ((0, 160), (0.2, 70), (0.6, 60), (0.85, 120)), "abd": ((0, 15), (0.25, 20), (0.85, 30)),
            "elbow": ((0, 15), (0.25, 60), (0.6, 50), (0.85, 10)),
            "hip": ((0, 0), (0.22, 120), (0.6, 118), (0.85, 20)), "hipabd": ((0, 4), (0.25, 14)),
            "knee": ((0, 10), (0.22, 120), (0.6, 115), (0.85, 20)), "plantar": ((0, 25),),
            "trunk": ((0, 0), (0.25, 35), (0.6, 30), (0.85, 5)), "head": ((0, 0), (0.25, 20), (0.7, 0)),
        },
    ),
    "8": Person(  # straddle jump turning a little, woman in white shorts and long socks
        seed=8, is_female=True, stature_m=1.74, mass_kg=63, n_frames=42, n_cameras=3, light="hall",
        angular_momentum=(5, -2, -6), centre_m=(0.2, 0, 1.3), velocity_m_s=(0.1, -1, 3.2),
        phenotype={
            "gender": 0, "age": 0.5, "muscle": 0.6, "weight": 0.45, "proportions": 0.7, "caucasian": 1, "african": 0,
            "asian": 0, "cupsize": 0.4,
        },
        outfit=Outfit(
            sleeve=0.45, loose_m=0.01, shorts=0.8, loose_shorts_m=0.016, socks=0.45, shoe_m=0.012, hair_m=0.016,
        ),
        colours=Colours(
            skin=(230, 190, 165), hair=(190, 150, 90), top=(40, 90, 170), shorts=(235, 235, 230), socks=(30, 30, 34),
        ),
        angles_deg={
            "arm_l": ((0, 30), (0.25, 120), (0.5, 80), (0.7, 30)),
            "arm_r": ((0, -20), (0.25, 60), (0.5, 110), (0.7, 20)), "abd_l": ((0, 20), (0.3, 70)),
            "abd_r": ((0, 20), (0.3, 80)), "elbow": ((0, 30), (0.3, 15)),
            "hip": ((0, 5), (0.3, 95), (0.42, 95), (0.7, 10)), "hipabd": ((0, 5), (0.3, 48), (0.42, 48), (0.7, 5)),
            "knee": ((0, 25), (0.25, 5)), "plantar": ((0, 40),), "trunk": ((0, 0), (0.3, 18), (0.6, 0)),
            "head": ((0, 0),),
        },
    ),
    "9": Person(  # piked back somersault, man in singlet and short shorts
        seed=9, is_female=False, stature_m=1.7, mass_kg=66, n_frames=54, n_cameras=4, light="hall",
        angular_momentum=(-62, 0, 0), centre_m=(0, 0.1, 1.5), velocity_m_s=(0, 0.6, 4),
        phenotype={
            "gender": 1, "age": 0.42, "muscle": 0.8, "weight": 0.4, "proportions": 0.6, "caucasian": 0.3,
            "african": 0, "asian": 0.7,
        },
        outfit=Outfit(sleeve=0, loose_m=0.003, shorts=0.3, loose_shorts_m=0.004, socks=0, hair_m=0.01),
        colours=Colours(
            skin=(215, 170, 135), hair=(22, 20, 20), top=(245, 245, 245), shorts=(180, 30, 40),
            socks=(200, 150, 120),
        ),
        angles_deg={
            "arm": ((0, 170), (0.3, 80), (0.6, 70), (0.9, 150)), "abd": ((0, 5), (0.3, 12)),
            "elbow": ((0, 5), (0.3, 12)), "hip": ((0, -10), (0.3, 125), (0.6, 120), (0.88, 5)), "knee": ((0, 3),),
            "plantar": ((0, 45),), "trunk": ((0, -12), (0.3, 30), (0.6, 25), (0.88, 0)),
            "head": ((0, -10), (0.3, 15), (0.8, 0)),
        },
    ),
    "10": Person(  # front turn with a twist, arms and legs unlike each other, woman in tights
        seed=10, is_female=True, stature_m=1.6, mass_kg=54, n_frames=46, n_cameras=3, light="window",
        angular_momentum=(38, 4, 6), centre_m=(0, 0, 1.45), velocity_m_s=(0.1, -0.8, 3.5),
        phenotype={
            "gender": 0, "age": 0.45, "muscle": 0.5, "weight": 0.5, "proportions": 0.5, "caucasian": 0.5,
            "african": 0.5, "asian": 0, "cupsize": 0.5,
        },
        outfit=Outfit(sleeve=0.5, loose_m=0.012, shorts=1.9, loose_shorts_m=0.004, socks=0, hair_m=0.02),
        colours=Colours(
            skin=(170, 120, 90), hair=(40, 26, 20), top=(210, 90, 120), shorts=(34, 34, 40), socks=(170, 120, 90),
        ),
        angles_deg={
            "arm_l": ((0, 150), (0.25, 60), (0.5, 20)), "arm_r": ((0, 150), (0.25, 90), (0.5, 150)),
            "abd_l": ((0, 10), (0.25, 40), (0.5, 15)), "abd_r": ((0, 10), (0.25, 30), (0.5, 60)),
            "elbow_l": ((0, 10), (0.25, 100), (0.6, 40)), "elbow_r": ((0, 10), (0.3, 60), (0.6, 10)),
            "hip_l": ((0, 0), (0.3, 40), (0.6, 0)), "hip_r": ((0, 0), (0.3, 90), (0.6, 0)),
            "knee_l": ((0, 5), (0.3, 30)), "knee_r": ((0, 5), (0.3, 100), (0.6, 10)), "plantar": ((0, 35),),
            "trunk": ((0, 0), (0.3, 10)), "trunk_twist": ((0, 0), (0.15, -25), (0.4, 10)), "head": ((0, 0),),
        },
    ),
}
# fmt: on
