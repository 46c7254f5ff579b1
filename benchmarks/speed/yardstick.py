"""How fast a pose is scored, against the same algorithm in C++: `python benchmarks/speed/yardstick.py [FOLDER]`.

FOLDER holds the yardstick (run.py, scene18.py, score18.cpp; needs g++); by default `../shared/yardstick` beside the
project. Its scene of 18 ellipsoids, 3 views and 2 lamps is rebuilt as an Airborne body; both engines then score the
same hypotheses, from 57 numbers each, in turns, on one thread. Printed: medians of CPU time, their ratio, how far the
scores differ, the time from starting Python to the first score, with Numba's cache empty and full, and the CPU time of
each method on the thrown cross.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.body import BodyModel, Ellipsoid, Part, Segment, surface_arrays
from airborne.cameras import Camera
from airborne.rendering import RULES, Lamp, Lights, pack_targets, score
from airborne.run.bench import measure_speed
from airborne.video import View

HERE = Path(__file__).resolve()
DEFAULT = HERE.parents[3] / "shared" / "yardstick"
N_HYPOTHESES, ROUNDS, START_RUNS = 100, 25, 3


def rebuilt_body(scene) -> BodyModel:
    """Rebuild the scene's person, one ellipsoid a segment."""
    names = [row[0] for row in scene._S]
    segments = []
    for e, name in enumerate(names):
        place = RigidTransform.from_translation(scene.COFF[e])
        part = Part(name, Ellipsoid(scene.AX[e]), place, scene.COL[e])
        parent = None if scene.PARENT[e] < 0 else names[scene.PARENT[e]]
        segments.append(Segment(name, parent, scene.JOFF[e], (part,)))
    return BodyModel("yardstick", tuple(segments))


def rebuilt_targets(scene, yardstick, case: str):
    """Rebuild the scene's views, from the very images that the other engine compares with."""
    cams = scene.cams(case)
    views = []
    for v in range(3):
        place = RigidTransform.from_components(cams.t[v], Rotation.from_matrix(cams.R[v]))
        camera = Camera(name=f"cam{v}", K=cams.K[v], size=(cams.W, cams.H), camera_from_world=place)
        planes = yardstick.images[v, :, :, : cams.H]  # (channel, column, row)
        views.append(View(camera, np.ascontiguousarray(planes.transpose(2, 1, 0)).astype(np.uint8)))
    lamps = tuple(Lamp(p, float(k)) for p, k in zip(scene.LIGHTS, scene.LINT, strict=True))
    return pack_targets(views, Lights(scene.AMB, lamps))


def airborne_numbers(poses: np.ndarray) -> np.ndarray:
    """Turn the yardstick's 57 numbers into ours: the joints' rotation vectors become successive x, y, z angles."""
    joints = Rotation.from_rotvec(poses[:, 6:].reshape(-1, 3)).as_euler("XYZ").reshape(len(poses), -1)
    return np.hstack([poses[:, :6], joints])


def compare(case: str) -> list[dict]:
    """Time both engines in turns and print the ratio."""
    import run  # pyright: ignore[reportMissingImports]
    import scene18 as scene  # pyright: ignore[reportMissingImports]

    yardstick = run.Yardstick(case)
    yardstick.images[:] = np.rint(yardstick.images)  # whole grey levels, as a camera gives them
    model, target = rebuilt_body(scene), rebuilt_targets(scene, yardstick, case)
    shapes = surface_arrays(model)
    poses = run.hypotheses(N_HYPOTHESES)
    numbers = airborne_numbers(poses)

    def ours() -> np.ndarray:
        root = Rotation.from_rotvec(numbers[:, 3:6]).as_matrix()
        R, t = model.pose_segments(root, numbers[:, :3], numbers[:, 6:].reshape(len(numbers), -1, 3))
        return score(shapes, target, R, t, rule=RULES["raw"])

    difference = np.abs(ours() - yardstick(poses)).max()
    times = np.empty((ROUNDS, 2))
    for k in range(ROUNDS):
        for engine, call in enumerate((ours, lambda: yardstick(poses))):
            start = time.thread_time()
            call()
            times[k, engine] = time.thread_time() - start
    mine, bound = np.median(times, axis=0) / N_HYPOTHESES * 1e6
    base = {"data": f"18 ellipsoids, 3 views, {case.upper()}", "method": "score", "n": ROUNDS}
    return [
        {**base, "metric": "CPU per hypothesis", "unit": "us", "value": float(mine)},
        {**base, "metric": "CPU over the C++ bound's", "unit": "", "value": float(mine / bound), "floor": 1.15},
        {**base, "metric": "largest difference of scores", "unit": "grey", "value": float(difference)},
    ]


def first_score_s(cache: str) -> float:
    """Return the time [s] from starting Python to the first score, imports included."""
    start = time.perf_counter()
    subprocess.run(
        [sys.executable, HERE.with_name("first_score.py")], check=True, env={**os.environ, "NUMBA_CACHE_DIR": cache}
    )
    return time.perf_counter() - start


def main() -> int:
    """Run the comparison; 2 where the yardstick is missing."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT
    if not (folder / "score18.cpp").is_file():
        print(f"no yardstick in {folder}: expected run.py, scene18.py and score18.cpp; give their folder as argument")
        return 2
    sys.path.insert(0, str(folder))
    sys.dont_write_bytecode = True
    rows = compare("sd") + compare("hd")
    with tempfile.TemporaryDirectory() as cache:
        cold = first_score_s(cache)
        warm = np.median([first_score_s(cache) for _ in range(START_RUNS)])
    base = {"data": "import to first score", "method": "score", "unit": "s"}
    rows += [
        {**base, "metric": "wall time, empty cache", "value": cold, "n": 1},
        {**base, "metric": "wall time, full cache", "value": float(warm), "n": START_RUNS, "floor": 1.5},
    ]
    speeds = measure_speed()
    rows += [
        {"data": "thrown_cross, 3 views", "method": "speed", "metric": name, "unit": "", "value": value}
        for name, value in speeds.items()
    ]
    append("speed", rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
