"""Measure which mix-ups of videos are named where no start is known: `python benchmarks/accuracy/mix_ups.py`.

12 throws of `find_start.py` and 8 people of `find_person.py` (about 15 minutes, nearly all of it rendering): as they
are, with each mix-up of their videos, with a camera turned by 4 degrees, and with a video of the scene before.
`--quick` takes one of each, `--seeds 8100` others, from that number on; neither writes rows.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

from find_person import person
from find_start import throw
from rows import append

from airborne.run.mix_ups import MixUp, possible_mix_ups
from airborne.run.moving_mix_ups import compare_silhouettes
from airborne.synthetic.throw.pictures import scene_frames
from airborne.synthetic.throw.scene import Scene
from airborne.tracking.first_pose.moments import Moment, empty_scenes, look, spread_sample

N_THROWS, N_PEOPLE, SEED = 12, 8, 9500  # chosen: how many scenes, from which seed on
TURNED_DEG = 4.0  # chosen: that is seen in every scene


def moments_of(scene: Scene) -> list[Moment]:
    """Draw a scene and return what stands out in it."""
    frames = list(scene_frames(scene))
    sample = spread_sample(frames, len(frames))
    return look(sample, empty_scenes(sample))


def with_mix_up(moments: Sequence[Moment], mix_up: MixUp) -> list[Moment]:
    """Return the moments as they are with a mix-up, which is made as one the other way round is undone."""
    other = replace(mix_up, cameras=mix_up.cameras[::-1])
    return [replace(moment, evidence=tuple(other.undo_in(moment.evidence))) for moment in moments]


def with_turned(moments: Sequence[Moment], number: int, seed: int) -> list[Moment]:
    """Return the moments with one camera's calibration turned about a random axis."""
    axis = np.random.default_rng(seed).normal(size=3)
    turn = Rotation.from_rotvec(np.radians(TURNED_DEG) * axis / np.linalg.norm(axis))
    turned, made = RigidTransform.from_rotation(turn), []
    for moment in moments:
        views = list(moment.frames.views)
        if (view := views[number]) is not None:
            camera = replace(view.camera, camera_from_world=turned * view.camera.camera_from_world)
            views[number] = replace(view, camera=camera)
        made.append(replace(moment, frames=replace(moment.frames, views=tuple(views))))
    return made


def with_video_of(moments: Sequence[Moment], other: Sequence[Moment], number: int) -> list[Moment]:
    """Return the moments with what another scene's camera shows in place of one camera's images."""
    return [
        replace(mine, evidence=tuple(theirs.evidence[i] if i == number else own for i, own in enumerate(mine.evidence)))
        for mine, theirs in zip(moments, other, strict=False)
    ]


def verdict(moments: Sequence[Moment], names: Sequence[str], mix_up: MixUp | None = None, odd: str = "") -> str:
    """Return refused or asked, where what is wrong is named so, else wrong or silent."""
    right = mix_up.describe(names) if mix_up is not None else f"without {odd} "
    found = compare_silhouettes(moments)
    if found.mix_up is not None:
        return "refused" if mix_up is not None and right in found.mix_up else "wrong"
    if not (doubts := found.doubts):
        return "silent"
    return "asked" if right in " ".join(doubts) and (odd or mix_up is not None) else "wrong"


def _kind(mix_up: MixUp) -> str:
    return "videos passed on in turn" if mix_up.is_in_turn else "a mix-up"


def verdicts(scenes: Iterator[Scene]) -> Iterator[tuple[str, str]]:
    """Yield what each scene is with, and what is said of it."""
    before: list[Moment] = []
    for scene in scenes:
        moments, names, found = moments_of(scene), scene.rig.names, []
        found.append(("nothing", verdict(moments, names)))
        found += [
            (_kind(mix_up), verdict(with_mix_up(moments, mix_up), names, mix_up))
            for mix_up in possible_mix_ups(len(names))
        ]
        k = scene.seed % len(names)
        found.append(("a turned camera", verdict(with_turned(moments, k, scene.seed), names, odd=names[k])))
        if before and len(before[0].frames.views) > k:
            found.append(("another's video", verdict(with_video_of(moments, before, k), names, odd=names[k])))
        print(scene.name, len(names), "cameras:", dict(Counter(found)), flush=True)
        before = moments
        yield from found


def main() -> None:
    """Measure, print, and write the rows of a full run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one throw and one person")
    parser.add_argument("--seeds", type=int, default=SEED, help="the first of the scenes' seeds")
    options = parser.parse_args()
    n_throws, n_people = (1, 1) if options.quick else (N_THROWS, N_PEOPLE)
    throws = (throw(options.seeds + i) for i in range(n_throws))
    people = (person(options.seeds + i)[0] for i in range(n_people))
    rows = []
    for data, scenes in (("throws", throws), ("people", people)):
        counts = Counter(verdicts(scenes))
        for with_what in dict.fromkeys(what for what, _ in counts):
            n = sum(count for (what, _), count in counts.items() if what == with_what)
            base = {"data": f"{data} {options.seeds}, {with_what}", "method": "silhouettes", "unit": "%", "n": n}
            rows += [
                {**base, "metric": word, "value": 100 * counts[with_what, word] / n}
                for word in ("refused", "asked", "wrong", "silent")
            ]
    if options.quick or options.seeds != SEED:
        for row in rows:
            print(f"{row['data']}: {row['metric']} {row['value']:.0f} % of {row['n']}")
    else:
        append("mix_ups", rows)


if __name__ == "__main__":
    main()
