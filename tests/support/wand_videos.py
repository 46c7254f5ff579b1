"""Videos of a wand that is waved in a hall where other things move too."""

from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np

from airborne.cameras import Rig, camera_looking_at
from airborne.video import VideoWriter
from tests.support.wand_waving import wave_wand

SIZE, LENGTH_M, RADIUS_M = (480, 360), 0.6, 0.05
RED, GREEN, WHITE, SKIN = (200, 40, 40), (50, 190, 60), (235, 235, 235), (205, 160, 135)
_FINER = 8  # fractions of a pixel in which circles are drawn


def hall() -> Rig:
    """Three cameras around the middle, with different lenses."""
    places, focals = [(-3.0, -4.0, 2.2), (3.2, -3.6, 1.4), (0.3, 4.2, 2.6)], (465, 525, 420)
    return Rig(
        tuple(
            camera_looking_at(f"cam{i}", place, (0, 0, 1.2), focal_px=focal, size=SIZE)
            for i, (place, focal) in enumerate(zip(places, focals, strict=True))
        )
    )


def film_wand(folder: Path, rig: Rig, *, colours=(RED, RED), n=60, seed=0, with_wand=True, hidden=0.1, stray=0.15):
    """Write `<camera>.mp4`; return the markers (n, 2, cameras, 2) [px], NaN where one is hidden.

    A walker without round parts but the head, a lamp that flickers, a red post, and now and then a red ball beside the
    wand; `hidden` and `stray` are shares of the images.
    """
    rng = np.random.default_rng(seed)
    places = wave_wand(rng, n, (LENGTH_M,), middle=(0, 0, 1.3)) * np.array([0.4, 0.4, 1.0])
    along = places[:, 1] - places[:, 0]
    places[:, 1] = places[:, 0] + LENGTH_M * along / np.linalg.norm(along, axis=1)[:, None]
    walker = np.column_stack([np.linspace(-1, 1, n), np.full(n, 0.6), np.full(n, 1.6)])
    px = np.full((n, 2, len(rig), 2), np.nan)
    for i, camera in enumerate(rig):
        wall = cv2.GaussianBlur(rng.integers(40, 150, (*SIZE[::-1], 3), dtype=np.uint8), (0, 0), 6)
        cv2.rectangle(wall, (20, 150), (34, 350), RED, -1)
        with VideoWriter(
            folder / f"{camera.name}.mp4", size=SIZE, rate=Fraction(30), crf=14, preset="ultrafast"
        ) as writer:
            for k in range(n):
                image = wall.copy()
                u, v = np.rint(camera.px_from_world(walker[k])).astype(int)
                cv2.rectangle(image, (u - 16, v + 16), (u + 16, v + 90), (40, 60, 120), -1)
                cv2.ellipse(image, (int(u), int(v)), (10, 13), 0, 0, 360, SKIN, -1)
                cv2.circle(image, (450, 30), 10, (230, 230, 200) if k % 2 else (120, 120, 100), -1)
                is_hidden = rng.random(2) < hidden
                ends = camera.px_from_world(places[k])
                if with_wand:
                    cv2.line(image, *np.rint(ends).astype(int).tolist(), (25, 25, 25), 2, cv2.LINE_AA)
                    for m in (0, 1):
                        depth = camera.camera_from_world.apply(places[k, m])[2]
                        radius = camera.K[0, 0] * RADIUS_M / depth
                        at = np.rint(ends[m] * _FINER).astype(int).tolist()
                        if not is_hidden[m]:
                            cv2.circle(image, at, round(radius * _FINER), colours[m], -1, cv2.LINE_AA, 3)
                            px[k, m, i] = ends[m]
                if rng.random() < stray:
                    cv2.circle(image, rng.integers((20, 20), (460, 340)).tolist(), 6, colours[0], -1, cv2.LINE_AA)
                noise = (4 * rng.standard_normal(image.shape, np.float32)).astype(np.int8)
                writer.write(cv2.add(image, noise, dtype=cv2.CV_8U))
    return px
