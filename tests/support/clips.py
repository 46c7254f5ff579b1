"""Small videos and rigs for the tests of `airborne.video`."""

from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.cameras import Camera, Rig

SIZE = (64, 48)


def plain_camera(name="cam1", size=SIZE, distortion=(0, 0, 0, 0, 0)) -> Camera:
    width, height = size
    K = np.array([[width, 0, (width - 1) / 2], [0, width, (height - 1) / 2], [0, 0, 1.0]])
    return Camera(
        name=name,
        K=K,
        size=size,
        camera_from_world=RigidTransform.identity(),
        distortion=np.array(distortion, float),
    )


def plain_rig(*names: str, size=SIZE) -> Rig:
    return Rig(tuple(plain_camera(name, size) for name in names))


def numbered(n: int, size=SIZE, start: int = 0) -> list[np.ndarray]:
    """Return n grey pictures whose level is their number, doubled."""
    width, height = size
    return [np.full((height, width, 3), 2 * (start + k), np.uint8) for k in range(n)]


def textured(n: int, size=SIZE) -> list[np.ndarray]:
    """Return n pictures of moving noise, which no codec can shorten."""
    width, height = size
    noise = np.random.default_rng(1).integers(0, 256, (height, width, 3), dtype=np.uint8)
    return [np.roll(noise, k, axis=1) for k in range(n)]


def numbers_of(views) -> list[int | None]:
    """Read the numbers of `numbered` pictures back."""
    return [None if view is None else round(int(view.rgb[5, 5, 0]) / 2) for view in views]


def write_clip(
    path: Path,
    images: Iterable[np.ndarray | av.VideoFrame],
    *,
    rate: Fraction = Fraction(50),
    codec: str = "ffv1",
    pix_fmt: str = "bgr0",
    stamps: Sequence[int] | None = None,
    time_base: Fraction | None = None,
    rotation_deg: int = 0,
    options: dict[str, str] | None = None,
    index_first: bool = True,
) -> Path:
    """Write pictures (arrays or frames); without loss unless another codec is asked for."""
    layout = {"movflags": "faststart"} if path.suffix == ".mp4" and index_first else {}
    with av.open(path, "w", options=layout) as container:
        stream = container.add_stream(codec, rate=rate, options=options or {})
        if time_base is not None:
            stream.codec_context.time_base = time_base
        stream.codec_context.pix_fmt = pix_fmt
        if rotation_deg:
            stream.set_display_rotation(rotation_deg)
        for k, image in enumerate(images):
            frame = av.VideoFrame.from_ndarray(image) if isinstance(image, np.ndarray) else image
            if k == 0:
                stream.width, stream.height = frame.width, frame.height
            frame.pts = k if stamps is None else stamps[k]
            frame.time_base = time_base or 1 / Fraction(rate)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def packets_of(path: Path) -> list[tuple[int, int, int, bool]]:
    """Return (place in the file, bytes, stamp, whether a key frame) of every packet."""
    with av.open(path) as container:
        return [(p.pos, p.size, p.pts, p.is_keyframe) for p in container.demux(video=0) if p.size]


def with_noise(path: Path, target: Path, *packets: tuple[int, int, int, bool]) -> Path:
    """Copy a file with the given packets' bytes replaced by noise."""
    data = bytearray(path.read_bytes())
    for place, n_bytes, *_ in packets:
        data[place : place + n_bytes] = np.random.default_rng(0).bytes(n_bytes)
    target.write_bytes(data)
    return target
