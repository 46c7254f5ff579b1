"""Offsets of the third camera, found from motion and from tracking: `python benchmarks/accuracy/sync.py [--blocks]`.

`generated`: crosses thrown by our generator, the third camera 0 to 20 ms late. `thrown_cross`: the example as it is;
the third camera's fields resampled to a later time, by mixing the two fields beside each moment; and two cameras
started whole fields late. `--throws` alone: 20 throws of other seeds, each with a hall, blur and delay (-20 to 20 ms)
of its own, calibrated from clicked control points; about 20 minutes. `--blocks` alone: players of 5 synthetic blocks,
both other cameras' offsets, from up to 30 ms off, and which cameras runs name where one is 20 ms late or none is; about
6 minutes.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import ROOT, append

from airborne.run.opening import open_cameras, open_trial, video_source
from airborne.run.players import PlayersRun
from airborne.sync import offsets_by_motion
from airborne.sync.from_players import offsets_by_players
from airborne.sync.from_trial import synchronise
from airborne.synthetic import block_scene, write_block
from airborne.synthetic.throw.scene import cross_scene
from airborne.synthetic.throw.writing import write_trial
from airborne.trial.file import Trial, read_trial
from airborne.video import VideoWriter, fill_rows, weave
from airborne.video.decoding import decode, inspect, rgb_from_decoded

LATE_MS = ((0, 3), (1, 10), (2, 17))  # seed, third camera's delay
RESAMPLED_MS = (2, 5, 8, 10, 13, 16, 19)
WHOLE_FIELDS = ((0, 2, 4), (0, 6, 2), (0, 4, 8))
FIELD_S = Fraction(1, 50)
THROW_SEEDS = range(6300, 6320)
BLOCK_SEEDS = range(9101, 9106)
EXAMPLE = ROOT / "examples" / "thrown_cross"


def errors_ms(folder: Path, late_s: float) -> dict[str, float]:
    """Return the errors of the third camera's offset, and the sd that tracking states."""
    trial = read_trial(folder / "trial.toml")
    rig = open_cameras(trial).rig
    motion = offsets_by_motion([video_source(trial, camera) for camera in trial.camera], rig, within_s=0.3)
    tracking = synchronise(trial, within_s=0.3)
    print(folder.name, late_s, motion.describe(), tracking.describe(), sep="\n", flush=True)
    return {
        "motion": 1e3 * abs(float(motion.offset_s[2]) - late_s),
        "tracking": 1e3 * abs(float(tracking.offset_s[2]) - late_s),
        "tracking, other camera": 1e3 * abs(float(tracking.offset_s[1])),
        "sd": 1e3 * float(tracking.offset_sd_s[2]),
    }


def copied(folder: Path) -> Path:
    """Copy the example."""
    shutil.copytree(EXAMPLE, folder)
    return folder


def fields_of(folder: Path, name: str) -> list[np.ndarray]:
    """Read a camera's fields as whole pictures, missing rows filled in."""
    trial = read_trial(folder / "trial.toml")
    source = video_source(trial, next(camera for camera in trial.camera if camera.name == name))
    facts = inspect(source)
    return [fill_rows(rgb_from_decoded(p, facts), p.parity or 0, facts.size[1]) for p in decode(source, facts)]


def write_fields(path: Path, fields: list[np.ndarray]) -> None:
    """Write whole pictures as the fields of an interlaced video, top field first."""
    height, width = fields[0].shape[:2]
    with VideoWriter(path, size=(width, height), rate=Fraction(25), fields="top-first", crf=10) as video:
        for top, bottom in zip(fields[::2], fields[1::2], strict=False):
            video.write(weave(top[0::2], bottom[1::2]))


def resampled(folder: Path, late_s: float) -> Path:
    """Give the third camera the pictures that it would have taken later, mixed from those beside."""
    fields = fields_of(copied(folder), "cam3")
    whole, share = divmod(late_s / float(FIELD_S), 1)
    first = int(whole)
    pairs = zip(fields[first:], fields[first + 1 :], strict=False)
    mixed = [np.rint((1 - share) * a + share * b).astype(np.uint8) for a, b in pairs]
    (folder / "cam3.mp4").unlink()
    write_fields(folder / "cam3.mp4", mixed)
    return folder


def started_late(folder: Path, whole_fields: tuple[int, int, int]) -> Path:
    """Cut whole frames off the cameras' beginnings."""
    copied(folder)
    for name, n in zip(("cam1", "cam2", "cam3"), whole_fields, strict=True):
        if n:
            fields = fields_of(folder, name)
            (folder / f"{name}.mp4").unlink()
            write_fields(folder / f"{name}.mp4", fields[n:])
    return folder


def throw_errors_ms(folder: Path, seed: int) -> tuple[float, float]:
    """Return the signed error of the third camera's offset from tracking in a throw of a seed, and the stated sd."""
    rng = np.random.default_rng([seed, 5])
    scene = cross_scene(("half-twist", "side-somersault")[seed % 2], seed=seed, clutter=int(rng.integers(4, 24)))
    late_s = float(rng.uniform(-0.02, 0.02))
    scene = replace(
        scene,
        time_offsets_s=(0.0, 0.0, late_s),
        blur_px=float(rng.uniform(0.3, 1.2)),
        exposure_s=float(rng.uniform(0.0005, 0.004)),
    )
    write_trial(scene, folder)
    found = synchronise(read_trial(folder / "trial.toml"), within_s=0.3)
    error, sd = 1e3 * (float(found.offset_s[2]) - late_s), 1e3 * float(found.offset_sd_s[2])
    print(f"{seed}: {1e3 * late_s:+.2f} ms, error {error:+.3f} ms, sd {sd:.3f} ms", flush=True)
    shutil.rmtree(folder)
    return error, sd


def measure_throws(scratch: Path) -> None:
    """Measure the throws, and append their rows."""
    error, sd = np.array([throw_errors_ms(scratch / f"t{seed}", seed) for seed in THROW_SEEDS]).T
    held = {"metric": "within 2 sd", "unit": "%", "value": 100 * np.mean(np.abs(error) < 2 * sd), "floor": ">= 88"}
    rms = {"metric": "offset error, RMS", "unit": "ms", "value": np.sqrt(np.mean(error**2)), "floor": "<= 0.7"}
    data = {"data": f"throws {THROW_SEEDS[0]}-{THROW_SEEDS[-1]}", "method": "tracking", "n": len(THROW_SEEDS)}
    append("sync", [{**data, **rms}, {**data, **held}])


def accused(trial: Trial, late_s: Sequence[float]) -> list[str]:
    """Return the cameras whose times a run of players names as wrong, if its cameras' times are late (c,) [s]."""
    cameras = [camera.model_copy(update={"offset_s": s}) for camera, s in zip(trial.camera, late_s, strict=True)]
    trial = trial.model_copy(update={"camera": cameras})
    run = PlayersRun.open(trial, open_trial(trial))
    for _ in run.track(iter(run.recording), lambda step: None, {}, lambda n: None):
        pass
    return [said.split()[1] for said in run.cameras.describe(run.recording.rig.names)]


def measure_blocks(scratch: Path) -> None:
    """Measure the offsets of cameras of players, and append the rows."""
    misses: dict[str, list[tuple[float, float]]] = {"motion": [], "tracking": []}
    n_named, n_wrong = 0, 0
    for seed in BLOCK_SEEDS:
        folder = scratch / f"b{seed}"
        write_block(folder, block_scene(seed, n_blockers=1 + seed % 3))
        wrong_s = np.array([0.0, *np.random.default_rng(seed).uniform(-0.03, 0.03, 2)])
        trial = read_trial(folder / "trial.toml")
        found = {
            "motion": synchronise(trial, by="motion", within_s=0.3),
            "tracking": offsets_by_players(trial, wrong_s),
        }
        for method, offsets in found.items():
            print(seed, np.round(1e3 * wrong_s, 1), offsets.describe(), sep="\n", flush=True)
            misses[method] += zip(1e3 * offsets.offset_s[1:], 1e3 * offsets.offset_sd_s[1:], strict=True)
        for late_s in (np.zeros(3), *0.02 * np.eye(3)):
            named, late = accused(trial, late_s.tolist()), [f"cam{i + 1}" for i in np.flatnonzero(late_s)]
            print(seed, late, "named", named, flush=True)
            n_named, n_wrong = n_named + (named == late != []), n_wrong + len(set(named) - set(late))
        shutil.rmtree(folder)
    data = {"data": f"blocks {BLOCK_SEEDS[0]}-{BLOCK_SEEDS[-1]}", "method": "self-check"}
    n = 3 * len(BLOCK_SEEDS)
    rows = [
        {**data, "metric": "camera 20 ms late named, alone", "unit": f"of {n}", "value": n_named, "n": n},
        {**data, "metric": "right camera named", "unit": f"of {3 * n}", "value": n_wrong, "n": 3 * n},
    ]
    for method, pairs in misses.items():
        error, sd = np.array(pairs).T
        data = {"data": f"blocks {BLOCK_SEEDS[0]}-{BLOCK_SEEDS[-1]}", "method": method, "n": len(error)}
        rms = {"metric": "offset error, RMS", "unit": "ms", "value": np.sqrt(np.mean(error**2))}
        largest = {"metric": "offset error, largest", "unit": "ms", "value": np.abs(error).max()}
        held = {"metric": "within 2 sd", "unit": "%", "value": 100 * np.mean(np.abs(error) < 2 * sd)}
        rows += [{**data, **rms}, {**data, **largest}, {**data, **held}]
    append("sync", rows)


def row(data: str, method: str, errors: list[float], floor: str = "") -> dict:
    worst = {"metric": "offset error, largest", "unit": "ms", "value": max(errors), "n": len(errors), "floor": floor}
    return {"data": data, "method": method, **worst}


def main() -> None:
    """Measure, and append the rows."""
    with tempfile.TemporaryDirectory() as scratch:
        at = Path(scratch)
        if "--throws" in sys.argv[1:]:
            return measure_throws(at)
        if "--blocks" in sys.argv[1:]:
            return measure_blocks(at)
        generated = []
        for seed, late_ms in LATE_MS:
            scene = replace(cross_scene(seed=seed), time_offsets_s=(0.0, 0.0, late_ms / 1000))
            write_trial(scene, at / f"g{seed}")
            generated.append(errors_ms(at / f"g{seed}", late_ms / 1000))
        mixed = [errors_ms(resampled(at / f"r{ms}", ms / 1000), ms / 1000) for ms in RESAMPLED_MS]
        still = [errors_ms(EXAMPLE, 0.0)]
        rows = []
        for data, found in (("generated", generated), ("thrown_cross", still), ("thrown_cross, resampled", mixed)):
            rows.append(row(data, "motion", [each["motion"] for each in found]))
            rows.append(row(data, "tracking", [each["tracking"] for each in found], "<= 1"))
        mean = {"metric": "offset error, mean", "unit": "ms", "value": np.mean([each["tracking"] for each in mixed])}
        rows.append({"data": "thrown_cross, resampled", "method": "tracking", **mean, "n": len(mixed)})
        wrong = 0
        for fields in WHOLE_FIELDS:
            trial = read_trial(started_late(at / "-".join(map(str, fields)), fields) / "trial.toml")
            found = synchronise(trial, by="motion", within_s=0.3, whole_pictures=True)
            wrong += int(np.any(np.round(found.offset_s / float(FIELD_S)) != fields))
        counted = {"metric": "wrong by a field", "unit": "of 3", "value": wrong, "n": 3, "floor": "0"}
        append("sync", [*rows, {"data": "thrown_cross, whole fields", "method": "motion", **counted}])


if __name__ == "__main__":
    main()
