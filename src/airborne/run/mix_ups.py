"""Mix-ups of a trial's videos, before anything is tracked: one twice, in a wrong order, mirrored, upside down.

At the start, each video's foreground, what is not in its median image, is compared with the body's silhouette in every
camera: files in a wrong order agree with each other's cameras, a mirrored image, or one that stands upside down, with
its own camera's silhouette once it is mirrored or turned by 180 degrees.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.surface import surface_arrays
from airborne.cameras import Camera, Rig
from airborne.cameras.finding import Finding, join_names
from airborne.errors import MistakesError
from airborne.io.files import find_copies
from airborne.rendering import FLAT, render
from airborne.trial.file import Trial
from airborne.types import Mask
from airborne.video import Frames, Recording, VideoFacts, VideoSource
from airborne.video.decoding import decode, rgb_from_decoded

_SHORT_SIDE_PX = 180  # of the images compared
_N_IMAGES, _N_BACKGROUND = 90, 24  # images on each side of the start that are read, and of which the median is made
_LEAST_GREY = 15.0  # by which the foreground differs from the median image
_RING_SHARE = 0.5  # of the silhouette's size: how far around it no foreground is expected
_LEAST_AGREEMENT = 0.4  # of a silhouette in the right camera, from which on something can be said
# mean agreement of all cameras without the mix-ups, at least. Chosen on synthetic throws and somersaults: of 48 mix-ups
# 0.65 to 0.83; of the 16 that 2700 starts at wrong places, by 0.05 to 2 m, had looked like, 0.12 to 0.47
_LEAST_EXPLAINED = 0.55
_MOST_CAMERAS = 4  # chosen: whose videos are tried three by three in a wrong order; of eight there were 112 such orders
_MOST_OF_IT = 0.5  # share of that agreement which a camera given the wrong images has left, at most


def refuse_same_files(trial: Trial) -> None:
    """Raise MistakesError where cameras' videos have the same content."""
    copies = find_copies([trial.path(camera.video) for camera in trial.camera if trial.path(camera.video).is_file()])
    mistakes = [
        f"cameras {join_names([camera.name for camera in trial.camera if trial.path(camera.video) in group])} have the "
        f"same video ({join_names([path.name for path in group])}); give each camera its own"
        for group in copies
    ]
    if mistakes:
        raise MistakesError(trial.name, mistakes)


@contextmanager
def start_foregrounds(recording: Recording) -> Iterator[Iterator[Mask | None]]:
    """Yield what stands out in each camera at the start, (h, w), None past its video's end; found by other threads.

    Most of the time is the decoders', outside Python's lock.
    """
    with ThreadPoolExecutor(len(recording.rig)) as threads:
        yield threads.map(partial(_foreground, recording), recording.sources, recording.facts, recording.rig)


def refuse_mix_ups(rig: Rig, foregrounds: Iterable[Mask | None], model: BodyModel, start: Pose) -> None:
    """Raise MistakesError, naming the cameras, where the start's silhouettes fit the videos of other cameras.

    foregrounds: of `start_foregrounds`.
    """
    silhouettes = [_silhouette(model, start, camera) for camera in rig]
    findings = mix_ups_in(rig.names, list(foregrounds), silhouettes)
    if findings:
        raise MistakesError("the videos", [finding.sentence for finding in findings])


def mix_ups_in(names: tuple[str, ...], images: list[Mask | None], silhouettes: list[Mask]) -> list[Finding]:
    """Return the mix-ups that foregrounds (h, w), None where there is none, and silhouettes (h, w) by camera show.

    Without them all cameras must agree with the silhouettes: a start in a wrong place agrees with a wrong image here
    and there, and with nothing else.
    """
    own = _agreements(images, silhouettes)
    clear = [max(_LEAST_AGREEMENT, each / _MOST_OF_IT) for each in own]
    findings, right = [], list(images)
    for mix_up, crossed in sorted(_agreements_without(images, silhouettes), key=lambda each: -min(each[1])):
        concerned = mix_up.cameras
        is_new = all(right[i] is images[i] for i in concerned)
        if is_new and all(other >= clear[i] for i, other in zip(concerned, crossed, strict=True)):
            what = _compare(names[concerned[0]], own[concerned[0]], crossed[0], mix_up.how(names))
            findings.append(mix_up.finding(names, what))
            right = mix_up.undo_in(right)
    agreements = zip(right, _agreements(right, silhouettes), strict=True)
    explained = [agreement for image, agreement in agreements if image is not None]
    return findings if findings and np.mean(explained) >= _LEAST_EXPLAINED else []


def _agreements_without(
    images: Sequence[Mask | None], silhouettes: Sequence[Mask]
) -> Iterator[tuple[MixUp, list[float]]]:
    """Yield each possible mix-up with the agreement of its cameras' images without it."""
    for mix_up in possible_mix_ups(len(images)):
        yield mix_up, _agreements(mix_up.undo_images(images), [silhouettes[i] for i in mix_up.cameras])


@dataclass(frozen=True, slots=True)
class MixUp:
    """Cameras' videos in a wrong order, or one's images mirrored, or upside down: by their places in the rig."""

    cameras: tuple[int, ...]  # of several, each one's images are in the video of the next, the last one's in the first
    is_turned: bool = False  # one camera's images, by 180 degrees

    @property
    def is_exchange(self) -> bool:
        """Whether videos are exchanged, of two cameras or of more."""
        return len(self.cameras) > 1

    @property
    def is_in_turn(self) -> bool:
        """Whether the videos of three cameras or more are passed on from each to the next."""
        return len(self.cameras) > 2

    def describe(self, names: Sequence[str]) -> str:
        """Return how its images would be right, by the rig's names."""
        if self.is_in_turn:
            return f"the images of {self._describe_order(names)}"
        of = join_names([names[i] for i in self.cameras])
        return f"the images of {of} {'exchanged' if self.is_exchange else self._remedy}"

    def how(self, names: Sequence[str]) -> str:
        """Return how the first of its cameras agrees, by the rig's names."""
        if self.is_exchange:
            others = "and so on" if self.is_in_turn else "whose video fits in turn"
            return f"in that of {names[self.cameras[1]]}, {others}"
        return f"once it is {self._remedy}"

    @property
    def order(self) -> list[tuple[int, int]]:
        """Each of its cameras with the one whose video shows what it saw."""
        return list(zip(self.cameras, (*self.cameras[1:], self.cameras[0]), strict=True))

    def _describe_order(self, names: Sequence[str]) -> str:
        return join_names([f"{names[source]} as {names[camera]}" for camera, source in self.order])

    @property
    def _remedy(self) -> str:
        return "turned by 180°" if self.is_turned else "mirrored"

    def _flip(self, image: NDArray[Any]) -> NDArray[Any]:
        """Return one camera's image (h, w, ...) as it would be without it."""
        return np.ascontiguousarray(image[::-1, ::-1] if self.is_turned else image[:, ::-1])

    def undo_images(self, images: Sequence[Mask | None]) -> list[Mask | None]:
        """Return the images of its cameras as they would be without it, of those of all cameras."""
        if self.is_exchange:
            return [images[source] for _, source in self.order]
        return [None if (image := images[i]) is None else self._flip(image) for i in self.cameras]

    def undo_in(self, images: Sequence[Mask | None]) -> list[Mask | None]:
        """Return the images of all cameras as they would be without it."""
        right = list(images)
        for i, image in zip(self.cameras, self.undo_images(images), strict=True):
            right[i] = image
        return right

    def undo(self, frames: Frames) -> Frames | None:
        """Return frames with the images as they would be without it; None where one is missing or does not fit."""
        views, sources = list(frames.views), [frames.views[source] for _, source in self.order]
        for i, source in zip(self.cameras, sources, strict=True):
            view = frames.views[i]
            if view is None or source is None or view.camera.size != source.camera.size:
                return None
            views[i] = replace(view, image=source.rgb if self.is_exchange else self._flip(view.rgb))
        return replace(frames, views=tuple(views))

    def finding(self, names: Sequence[str], what: str) -> Finding:
        """Return it as a finding, by the rig's names; `what` shows it."""
        cameras = tuple(names[i] for i in self.cameras)
        if self.is_exchange:
            of = f"the videos of {join_names(cameras)}, or their calibrations, are"
            advice = f"{of} exchanged; exchange them back"
            if self.is_in_turn:
                advice = f"{of} in a wrong order; use that of {self._describe_order(names)}"
            return Finding(kind="swapped", what=what, advice=advice, cameras=cameras)
        if self.is_turned:
            advice = f"the images of {cameras[0]} stand upside down; write its video anew, turned by 180°"
            return Finding(kind="turned", what=what, advice=advice, cameras=cameras)
        advice = (
            f"the images of {cameras[0]} are mirrored; switch that off in the camera, and record or convert anew, or "
            "calibrate it anew if it was moved"
        )
        return Finding(kind="mirrored", what=what, advice=advice, cameras=cameras)


def possible_mix_ups(n_cameras: int) -> list[MixUp]:
    """Return what can be mixed up: the videos of two cameras, three or all, each one's images, mirrored or upside down.

    Three and all are mixed up in turn, and come last: each camera has the video of the next, or of the one before.
    """
    alone, exchanged, of_three = (list(combinations(range(n_cameras), n)) for n in (1, 2, 3))
    in_turn = of_three * (n_cameras <= _MOST_CAMERAS) + [tuple(range(n_cameras))] * (n_cameras > 3)
    in_turn = [each for cameras in in_turn for each in (cameras, cameras[::-1])]
    turned = (MixUp(camera, is_turned=True) for camera in alone)
    return [*map(MixUp, exchanged), *map(MixUp, alone), *turned, *map(MixUp, in_turn)]


def find_undecided_mix_ups(rig: Rig, foregrounds: Sequence[Mask | None], model: BodyModel, start: Pose) -> list[MixUp]:
    """Return the mix-ups that what stands out in the cameras at the start does not speak against.

    It does where an image agrees with its own camera's silhouette better than as the mix-up would have it. Beside each
    other, cameras see the body in the same part of the image: there an exchanged one agrees with both silhouettes. For
    one upside down something must speak: wrongly turned, an image shows nothing of the body, as if it were left out.
    """
    silhouettes = [_silhouette(model, start, camera) for camera in rig]
    own = _agreements(foregrounds, silhouettes)

    return [
        mix_up
        for mix_up, crossed in _agreements_without(foregrounds, silhouettes)
        if all(
            own[i] < other or (own[i] == other and not mix_up.is_turned)
            for i, other in zip(mix_up.cameras, crossed, strict=True)
        )
    ]


def _compare(name: str, own: float, other: float, how: str) -> str:
    return f"the body at the start agrees with what moves in {name} to {max(own, 0):.0%}, to {other:.0%} {how}"


def _agreements(images: Sequence[Mask | None], silhouettes: Sequence[Mask]) -> list[float]:
    return [_agreement(image, silhouette) for image, silhouette in zip(images, silhouettes, strict=True)]


def _agreement(image: Mask | None, silhouette: Mask) -> float:
    """Return the share of foreground in a silhouette minus that in the ring around it; 0 where there is nothing."""
    if image is None or image.shape != silhouette.shape or not silhouette.any():
        return 0.0
    reach = max(int(_RING_SHARE * np.sqrt(np.count_nonzero(silhouette))), 2)
    around = cv2.dilate(silhouette.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) > 0
    ring = around & ~silhouette
    return float(image[silhouette].mean() - image[ring].mean()) if ring.any() else 0.0


def _silhouette(model: BodyModel, start: Pose, camera: Camera) -> Mask:
    small = _small(camera)
    return np.asarray(render(surface_arrays(model), model.with_pose(start), small.without_distortion(), FLAT).mask > 0)


def _small(camera: Camera) -> Camera:
    scale = max(min(camera.size) / _SHORT_SIDE_PX, 1.0)
    size = round(camera.size[0] / scale), round(camera.size[1] / scale)
    offset = ((scale - 1) / 2, (scale - 1) / 2)
    return camera.resample(scale=(scale, scale), offset=offset, size=size)


def _foreground(recording: Recording, source: VideoSource, facts: VideoFacts, camera: Camera) -> Mask | None:
    """Return what differs from the median image at the start, without distortion: (h, w); None past the video's end."""
    small = _small(camera)
    clock, rate = recording.sources[0], recording.facts[0].image_rate
    start_s = clock.trial_time(recording.start / rate)
    within_s = _N_IMAGES / facts.image_rate
    every = max(1, 2 * _N_IMAGES // _N_BACKGROUND)
    images, best, nearest_s = [], None, 1 / rate
    for n, picture in enumerate(decode(source, facts)):
        late_s = source.trial_time(picture.time_s) - start_s
        if late_s > within_s:
            break
        if abs(late_s) < nearest_s or (n % every == 0 and late_s > -within_s):
            grey = cv2.cvtColor(rgb_from_decoded(picture, facts), cv2.COLOR_RGB2GRAY)
            images.append(cv2.resize(grey, small.size, interpolation=cv2.INTER_AREA))
            if abs(late_s) < nearest_s:
                best, nearest_s = images[-1], abs(late_s)
    if best is None:
        return None
    differs = np.abs(best.astype(np.float32) - np.median(images, axis=0)) > _LEAST_GREY
    px = np.stack(np.meshgrid(np.arange(small.size[0]), np.arange(small.size[1])), axis=-1).astype(float)
    u, v = np.moveaxis(small.distort_px(px), -1, 0).astype(np.float32)
    return cv2.remap(differs.astype(np.uint8), u, v, cv2.INTER_NEAREST) > 0
