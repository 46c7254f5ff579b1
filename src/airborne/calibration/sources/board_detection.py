"""Detection of the board in videos and images, and which frames belong to the same moment."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from airborne.calibration.diagnosis.clocks import check_image_counts
from airborne.calibration.diagnosis.inputs import check_board, check_time_stamps
from airborne.calibration.initial.chaining import Views
from airborne.calibration.sources.board_print import match_print, match_sides
from airborne.calibration.sources.boards import NO_CORNERS, Board, DetectedCorners, Memory, board_detector
from airborne.calibration.sources.files import CameraSource, Sources
from airborne.cameras.finding import Finding
from airborne.errors import CalibrationError
from airborne.io.text import read_bytes, read_text
from airborne.types import Array, Image, Progress
from airborne.video import VideoSource, inspect
from airborne.video.decoding import decode, rgb_from_decoded

_MOST_MOMENTS = 240  # at which the board is searched for, evenly spaced over a recording
_IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
_LARGEST_PICTURE_BYTES = 200_000_000  # larger files are no pictures
_LARGEST_TABLE_BYTES = 50_000_000  # of time stamps; larger files are refused
_N_SAMPLES = 12  # images of a camera that test how the board was printed
_OTHER_RECORDING = 0.25  # share of the images by which a table of another recording differs: so many are never lost
_ODD_PICTURES = 2  # a larger difference to the other cameras is reported


@dataclass(frozen=True, slots=True, eq=False)
class BoardDetections:
    """The board in the cameras' common recordings."""

    views: Views
    time_s: Array | None  # (moments,) [s]; None for images, which have no times
    sizes: dict[str, tuple[int, int]]
    examples: dict[str, Image]  # by camera, the image with most corners
    notes: tuple[str, ...]
    findings: tuple[Finding, ...]


def detect_boards(sources: Sources, board: Board, progress: Progress) -> BoardDetections:
    """Detect the board in all cameras' recordings; raises VideoError or CalibrationError for what cannot be read."""
    cameras = [camera for camera in sources.camera if camera.video or camera.pictures]
    if not cameras:
        raise CalibrationError("[board] needs a video or images of the cameras; add video = ... to each [[camera]]")
    if all(camera.video for camera in cameras):
        moments, time_s, findings = match_moments(sources, cameras)
    elif all(camera.pictures for camera in cameras):
        counts = [len(_image_paths(sources, camera.pictures or "")) for camera in cameras]
        if len(cameras) > 1 and len(set(counts)) > 1:
            counts_text = ", ".join(f"{camera.name} {n}" for camera, n in zip(cameras, counts, strict=True))
            raise CalibrationError(
                f"images that belong together stand at the same place of every folder, but there are: {counts_text}; "
                "use lens_pictures for pictures of one camera alone"
            )
        moments, time_s, findings = [{i: i for i in range(n)} for n in counts], None, ()
    else:
        raise CalibrationError("some cameras have a video and some images; give the same kind for all")
    samples = {camera.name: _sample_images(sources, camera) for camera in cameras}
    memory: Memory = {}  # samples are searched several times, most of them among the moments once more
    board, notes = match_print(board, [grey for own in samples.values() for grey in own], memory)
    board, side_notes = match_sides(board, samples, memory)
    total = sum(len(own) for own in moments)
    n_moments = max(max(own.values(), default=-1) for own in moments) + 1
    rows, sizes, examples, done = [], {}, {}, 0
    for camera, own in zip(cameras, moments, strict=True):
        row, best = [NO_CORNERS] * n_moments, -1
        detect = board_detector(board, memory)
        for index, grey in _read_grey_images(sources, camera, own):
            sizes.setdefault(camera.name, (grey.shape[1], grey.shape[0]))
            row[own[index]] = sighting = detect(grey)
            if len(sighting.corner) > best:
                examples[camera.name], best = grey, len(sighting.corner)
            done += 1
            progress(done, total)
        rows.append(tuple(row))
    views = Views(board, tuple(camera.name for camera in cameras), tuple(rows))
    return BoardDetections(
        views, time_s, sizes, examples, (*notes, *side_notes), (*findings, *check_board(views, samples, memory))
    )


def detect_lens_board(sources: Sources, camera: CameraSource, board: Board, progress: Progress) -> Views | None:
    """Detect the board in the recording for one camera's lens, if there is one."""
    name = camera.lens_video or camera.lens_pictures
    if name is None:
        return None
    lens_camera = camera.model_copy(update={"video": camera.lens_video, "pictures": camera.lens_pictures})
    detect = board_detector(board)
    detections: list[DetectedCorners] = []
    n = _n_images(sources, lens_camera) or _MOST_MOMENTS
    indices = range(0, n, math.ceil(n / _MOST_MOMENTS))
    for _, grey in _read_grey_images(sources, lens_camera, indices):
        detections.append(detect(grey))
        progress(len(detections), len(indices))
    views = Views(board, (camera.name,), (tuple(detections),))
    if not any(len(sighting.corner) for sighting in detections):
        check_board(views, {camera.name: _sample_images(sources, lens_camera)})
    return views.of_camera(0)


def first_image(sources: Sources, camera: CameraSource) -> Image | None:
    """Return the first image of a camera's recording, if it has one."""
    if not (camera.video or camera.pictures):
        return None
    return next((grey for _, grey in _read_grey_images(sources, camera, range(1))), None)


def image_size(sources: Sources, camera: CameraSource) -> tuple[int, int] | None:
    """Return a camera's image size (width, height) [px]; None where nothing determines it."""
    if camera.size is not None:
        return camera.size[0], camera.size[1]
    if camera.video is not None:
        return inspect(VideoSource(camera.name, sources.path(camera.video))).size
    if camera.pictures is not None or camera.lens_pictures is not None:
        path = _image_paths(sources, camera.pictures or camera.lens_pictures or "")[0]
        grey = _read_grey_image(path)
        return grey.shape[1], grey.shape[0]
    if camera.lens_video is not None:
        return inspect(VideoSource(camera.name, sources.path(camera.lens_video))).size
    return None


def match_moments(
    sources: Sources, cameras: Sequence[CameraSource]
) -> tuple[list[dict[int, int]], Array, tuple[Finding, ...]]:
    """Return by camera the moment of each of its frames, the moments' times, and what is wrong with them."""
    if sources.board is not None and sources.board.timestamps is not None:
        path = sources.path(sources.board.timestamps)
        stamped = _moments_by_time_stamps(path, cameras)
        _refuse_other_recording(path, sources, cameras, [len(frames) for frames in stamped[0]])
        return stamped
    facts = [inspect(VideoSource(c.name, sources.path(c.video or ""))) for c in cameras]
    rate = float(facts[0].frame_rate)
    ends = [float(f.duration_s) + c.offset_s for f, c in zip(facts, cameras, strict=True) if f.duration_s]
    n = max(1, round((max(ends, default=_MOST_MOMENTS / rate) - cameras[0].offset_s) * rate))
    stride = max(1, math.ceil(n / _MOST_MOMENTS))
    index = np.arange(0, n, stride)
    time_s = index / rate + cameras[0].offset_s
    moments = []
    for camera, fact in zip(cameras, facts, strict=True):
        frames = np.rint((time_s - camera.offset_s) * float(fact.frame_rate)).astype(int)
        error_s = np.abs(frames / float(fact.frame_rate) + camera.offset_s - time_s)
        is_present = (frames >= 0) & (error_s <= 0.5 / rate + 1e-9)
        moments.append({int(f): m for m, f in enumerate(frames) if is_present[m]})
    if len({fact.frame_rate for fact in facts}) > 1 or any(camera.offset_s for camera in cameras):
        return moments, time_s, ()
    counts = {c.name: _n_images(sources, c) or 0 for c in cameras}
    return moments, time_s, tuple(check_image_counts(counts, _ODD_PICTURES))


def _moments_by_time_stamps(
    path: Path, cameras: Sequence[CameraSource]
) -> tuple[list[dict[int, int]], Array, tuple[Finding, ...]]:
    """Read a table sync_index,cam_id,frame_time: the n-th row of a camera, by time, is its video's n-th frame."""
    expected = "expected the columns sync_index,cam_id,frame_time"
    try:
        table = list(csv.DictReader(read_text(path, _LARGEST_TABLE_BYTES).splitlines()))
        rows = [(int(r["sync_index"]), r["cam_id"].strip(), float(r["frame_time"])) for r in table]
    except OSError as error:
        raise CalibrationError(f"{path} cannot be read ({error.strerror}); give a table of time stamps") from None
    except (KeyError, ValueError, TypeError, AttributeError, csv.Error):
        raise CalibrationError(f"{path} is no table of time stamps; {expected}") from None
    if not rows or not np.isfinite([row[2] for row in rows]).all():
        raise CalibrationError(f"{path} holds no time stamps, or one that is no number; {expected}")
    ids = {row[1] for row in rows}
    stamps_s: dict[int, list[float]] = {sync: [] for sync in sorted({row[0] for row in rows})}
    for sync, _, stamp_s in rows:
        stamps_s[sync].append(stamp_s)
    moment = {sync: m for m, sync in enumerate(stamps_s)}
    time_s = np.array([np.mean(each) for each in stamps_s.values()])
    moments, findings = [], []
    for camera in cameras:
        key = _stamp_id(camera.name, ids)
        if key is None:
            raise CalibrationError(f"{path} has no rows of camera '{camera.name}'; its cam_id are: {', '.join(ids)}")
        stamps = sorted((r for r in table if r["cam_id"].strip() == key), key=lambda r: int(r["sync_index"]))
        findings += check_time_stamps(camera.name, stamps)
        own = sorted((row for row in rows if row[1] == key), key=lambda row: row[2])
        moments.append({n: moment[row[0]] for n, row in enumerate(own)})
    return moments, time_s - time_s[0], tuple(findings)


def _refuse_other_recording(
    path: Path, sources: Sources, cameras: Sequence[CameraSource], n_stamps: Sequence[int]
) -> None:
    """Raise CalibrationError where a table has far more or fewer time stamps than a camera has images."""
    for camera, n in zip(cameras, n_stamps, strict=True):
        n_images = _n_images(sources, camera) or n
        if abs(n - n_images) > max(_ODD_PICTURES, _OTHER_RECORDING * n_images):
            raise CalibrationError(
                f"{path} has {n} rows of camera '{camera.name}', whose recording has {n_images} images; give the table "
                "that was written with this recording"
            )


def _stamp_id(name: str, ids: set[str]) -> str | None:
    number = re.search(r"(\d+)$", name)
    return name if name in ids else number[1] if number and number[1] in ids else None


def _sample_images(sources: Sources, camera: CameraSource) -> list[Image]:
    n = _n_images(sources, camera) or _N_SAMPLES
    indices = set(np.linspace(0, max(n - 1, 0), _N_SAMPLES).astype(int).tolist())
    return [grey for _, grey in _read_grey_images(sources, camera, indices)]


def _n_images(sources: Sources, camera: CameraSource) -> int | None:
    if camera.pictures is not None:
        return len(_image_paths(sources, camera.pictures))
    facts = inspect(VideoSource(camera.name, sources.path(camera.video or "")))
    return None if facts.duration_s is None else round(facts.duration_s * facts.frame_rate)


def _read_grey_images(sources: Sources, camera: CameraSource, indices: Container[int]) -> Iterator[tuple[int, Image]]:
    """Yield some images of a recording in grey, with their indices."""
    if camera.pictures is not None:
        for index, path in enumerate(_image_paths(sources, camera.pictures)):
            if index in indices:
                yield index, _read_grey_image(path)
        return
    for index, rgb in read_video_images(sources, camera, indices):
        yield index, np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), np.uint8)


def read_video_images(sources: Sources, camera: CameraSource, indices: Container[int]) -> Iterator[tuple[int, Image]]:
    """Yield some images (h, w, 3) sRGB of a camera's video, with their indices. Raises VideoError."""
    source = VideoSource(camera.name, sources.path(camera.video or ""))
    facts = inspect(source)
    for picture in decode(source, facts):
        index = round(picture.time_s * facts.frame_rate)
        if index in indices:
            yield index, rgb_from_decoded(picture, facts)


def _image_paths(sources: Sources, pattern: str) -> list[Path]:
    location = sources.path(pattern)
    candidates = location.iterdir() if location.is_dir() else location.parent.glob(location.name)
    paths = sorted(path for path in candidates if path.suffix.lower() in _IMAGE_SUFFIXES and path.is_file())
    if not paths:
        raise CalibrationError(f"no images at {location}; give a folder or a pattern such as left/*.png")
    return paths


def _read_grey_image(path: Path) -> Image:
    try:
        data = read_bytes(path, _LARGEST_PICTURE_BYTES)
        grey = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    except ValueError as error:
        raise CalibrationError(f"{path}: {error}; is it an image?") from None
    except cv2.error:
        grey = None
    if grey is None:
        raise CalibrationError(f"{path} cannot be read as an image, or is too large for one; convert it to PNG or JPEG")
    return np.asarray(grey, np.uint8)
