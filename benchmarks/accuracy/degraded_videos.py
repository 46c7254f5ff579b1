"""How right the stated deviations of a thrown thing are where its videos are bad: errors within two of them.

`python benchmarks/accuracy/degraded_videos.py [--quick] [--seeds 7201 ...]`: throws, calibrated from control points,
interlaced and not, whose pictures, or each field of them, are compressed to a twentieth, out of focus, noisy, shaken,
half hidden, or change in brightness. The tracker is told nothing of that. Of each kind the mean over the throws.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from sys import path

path.insert(0, str(Path(__file__).resolve().parents[1]))

from airborne.io.environment import set_up_libraries

set_up_libraries()  # as the command line does: with other threads, last digits differ

import cv2
import numpy as np
from rows import append

from airborne.body.symmetry import symmetries
from airborne.evaluation.compare import compare_motion
from airborne.evaluation.truth import read_truth
from airborne.motion.files import read_motion
from airborne.run.opening import video_source
from airborne.run.track import track_trial
from airborne.synthetic.throw.scene import cross_scene
from airborne.synthetic.throw.writing import write_trial
from airborne.trial.file import read_trial
from airborne.types import Array
from airborne.video import inspect
from airborne.video.decoding import VideoSource, decode, rgb_from_decoded
from airborne.video.writing import VideoWriter

_SEEDS = (7201, 7202, 7203, 7204)
_FINE_CRF, _COARSE_CRF = 12, 38
_FLOOR = "88..99"  # of errors within two sds
_RNG = np.random.default_rng(0)


def _defocused(image: Array, number: int) -> Array:
    height, width = image.shape[:2]
    rows = 2.5 * (0.5 if width > 2 * height else 1.0)  # a field has half of the rows
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 2.5, sigmaY=rows), float)


def _hidden(image: Array, number: int) -> Array:
    image, middle = image.copy(), image.shape[1] // 2
    image[:, middle - 12 : middle + 12] = 60
    return image


def _crossed(image: Array, number: int) -> Array:
    image, (height, width) = image.copy(), image.shape[:2]
    left = int(width * (0.2 + 0.03 * number))
    image[height // 2 :, left : left + 40] = 150, 90, 60
    return image


_KINDS: dict[str, tuple[Callable[[Array, int], Array], int]] = {  # of a picture and its number, and how it is coded
    "as they were": (lambda image, number: image, _FINE_CRF),
    "compressed": (lambda image, number: image, _COARSE_CRF),
    "out of focus": (_defocused, _FINE_CRF),
    "noisy": (lambda image, number: image + _RNG.normal(0, 15, image.shape), _FINE_CRF),
    "shaken": (lambda image, number: np.roll(image, (int(3 * np.sin(number)), number % 3), (0, 1)), _FINE_CRF),
    "half hidden": (_hidden, _FINE_CRF),
    "crossed by somebody": (_crossed, _FINE_CRF),
    "getting brighter": (lambda image, number: image * (0.75 + 0.03 * number), _FINE_CRF),
    "flickering": (lambda image, number: image * (1 + 0.25 * (-1) ** number), _FINE_CRF),
}


def main() -> None:
    """Track the throws, and append the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one throw, compressed, and no rows")
    parser.add_argument("--seeds", type=int, nargs="+", default=_SEEDS)
    args = parser.parse_args()
    kinds, seeds = (["compressed"], args.seeds[:1]) if args.quick else (list(_KINDS), args.seeds)
    found: dict[str, list[tuple[float, ...]]] = {kind: [] for kind in kinds}
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            preset = "side-somersault" if seed % 2 else "half-twist"
            scene = replace(cross_scene(preset, seed=seed), is_interlaced=seed % 4 < 2)
            write_trial(scene, Path(folder) / str(seed))
            for kind in kinds:
                found[kind].append(_measure(Path(folder) / str(seed), kind))
                print(seed, kind, *(f"{value:.2f}" for value in found[kind][-1]))
    rows = []
    for kind, values in found.items():
        tracked, position, rotation, rms_mm = np.nanmean(values, axis=0)
        within = {"position": position, "rotation": rotation}
        common = {"data": f"throws, {kind}", "method": "refined", "n": len(values)}
        shares = [("tracked", tracked, ""), *((f"{of} within 2 sd", share, _FLOOR) for of, share in within.items())]
        rows += [
            {**common, "metric": m, "unit": "%", "value": 100 * float(share), "floor": f} for m, share, f in shares
        ]
        rows.append({**common, "metric": "position RMS", "unit": "mm", "value": float(rms_mm)})
    if not args.quick:
        append("degraded_videos", rows)


def _measure(right: Path, kind: str) -> tuple[float, ...]:
    """Return the shares of tracked frames, of their positions and rotations within two sds, and the RMS error [mm]."""
    folder = right.with_name(f"{right.name} {kind}")
    shutil.copytree(right, folder)
    whole, trial = (read_trial(each / "trial.toml") for each in (right, folder))
    for camera in whole.camera:
        _degrade(video_source(whole, camera), folder / camera.video, kind)
    track_trial(trial, folder / "run", pictures=False)
    motion = read_motion(folder / "run" / "motion.csv")
    is_tracked = motion.status == "tracked"
    if not is_tracked.any():
        return 0.0, np.nan, np.nan, np.nan
    only = replace(motion, position=np.where(is_tracked[:, None], motion.position, np.nan))
    compared = compare_motion(only, read_truth(folder / "truth.csv"), symmetries(trial.model()))
    shares = compared.position_calibration.within_2sd, compared.rotation_calibration.within_2sd
    return float(is_tracked.mean()), *shares, compared.position.rms_3d_mm


def _degrade(video: VideoSource, target: Path, kind: str) -> None:
    (change, crf), woven = _KINDS[kind], replace(video, fields="progressive")
    facts, fields = inspect(woven), "progressive" if video.fields == "auto" else video.fields
    with VideoWriter(target, size=facts.size, rate=facts.image_rate, fields=fields, crf=crf) as writer:
        for number, picture in enumerate(decode(woven, facts)):
            image = rgb_from_decoded(picture, facts).astype(np.float32)
            if fields == "progressive":
                image = change(image, number)
            else:  # what a lens or a lamp does, it does to each field
                image[::2], image[1::2] = (change(image[parity::2], number) for parity in (0, 1))
            writer.write(np.clip(image, 0, 255).astype(np.uint8))


if __name__ == "__main__":
    main()
