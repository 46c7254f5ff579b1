"""The fit of a whole run: the images of all its frames, read again, are joined by how bodies move; see `run_fit`."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain, takewhile
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.body import BodyModel, Pose
from airborne.body.chain import delta_between
from airborne.body_fitting.skin import N_FRAMES, fit_skin
from airborne.errors import ResultError
from airborne.motion import Motion
from airborne.motion.flight.momentum_table import falls_freely
from airborne.motion.flight.phases import body_events
from airborne.motion.joints import doubtful_segments
from airborne.motion.smoothing.frame_errors import ConstantOffsets, constant_offsets, frame_deviations
from airborne.motion.smoothing.lost_limbs import bridge_lost_limbs
from airborne.motion.smoothing.moved_joints import count_moves_as_errors, forget_moved_limbs
from airborne.motion.smoothing.run_fit import N_STEPS, Stretch, fit_run, invert_known, smooth_errors
from airborne.motion.smoothing.segments import segment_numbers, stretches
from airborne.tracking import Estimate, Status
from airborne.tracking.methods import Settings, tracker_of
from airborne.tracking.model_based.image_evidence import ImageEvidence
from airborne.tracking.model_based.render_model import RenderModel
from airborne.tracking.model_based.texture import cut_patches, with_texture
from airborne.tracking.predictors import PoseHistory
from airborne.tracking.time_offsets import CompensatedState, CompensatedTracker
from airborne.types import Array, Progress
from airborne.video import Frames
from airborne.video.rereading import Rereading

# frames whose poses are fitted at once, and those that are fitted with them on either side: memory stays flat
_WINDOW, _MARGIN = 256, 16
_N_THREADS = min(os.cpu_count() or 1, 8)  # the kernels let go of Python's lock; each holds the images of a time
# chosen, of a skin whose texture is learned from look to look: of 4, 6 and 8 the one after which two synthetic people
# whose joints lie elsewhere, and whose clothes end within segments, gain no more
_N_TEXTURE_STEPS = 6
_MOST_BYTES = 6e8  # of pictures held at once; others are decoded again for every step


class FittedRun(NamedTuple):
    """A run after the fit."""

    motion: Motion
    surface: str  # what was compared with the images: "skin" or "ellipsoids"


def fit_whole_run(
    reader: Rereading,
    settings: Settings,
    model: BodyModel,
    motion: Motion,
    estimates: Sequence[Estimate],
    *,
    keys: Collection[int] = (),
    is_joined: bool = False,
    progress: Progress | None = None,
) -> FittedRun | None:
    """Fit the poses of a run to its images and to how bodies move; None where nothing can be fitted.

    Motion is smooth between take-offs, landings and gaps, in stretches of five frames or more; other frames stay as
    they are. `estimates` are those of the tracker, one for each row of the motion. In frames that have a key it is the
    tracked pose that counts, as someone has said there what images do not. Statuses stay. Of poses that are joined from
    both directions a lost limb's are the likelier ones already; others begin on the way between frames that know it.
    """
    windows = [window for window in _windows(motion, model) if window.stretches]
    if not windows:
        return None
    found = [estimate for estimate in estimates if estimate.pose is not None]
    images = _RunImages.read(reader, settings, model, found, frozenset(keys), progress)
    shown = ~doubtful_segments(motion, model)
    position, R, angles, covariance = (
        each.copy() for each in (motion.position, motion.R, motion.joint_angles, motion.covariance)
    )
    offsets = list[ConstantOffsets]()
    for window in windows:
        rows, time_s = window.rows, motion.time_s[window.rows]
        poses = [motion.pose(row) for row in rows]
        if not is_joined:
            poses = bridge_lost_limbs(
                model, poses, time_s, covariances=motion.covariance[rows], stretches=window.stretches
            )
        look = _Look(images, window, shown[rows])
        fit = fit_run(model, poses, time_s, window.stretches, look, n_steps=images.n_steps)
        own = images.assess(fit.poses, window, motion)
        errors = smooth_errors(model, fit, time_s, window.stretches, own)
        offsets.append(constant_offsets(model, rows, fit.poses, errors, kept=window.kept))
        for row, pose, each in list(zip(rows, fit.poses, errors.covariances, strict=True))[window.kept]:
            matrix = pose.world_from_root.as_matrix()
            position[row], R[row], angles[row] = matrix[:3, 3], matrix[:3, :3], pose.joint_angles
            covariance[row] = each
    fitted = replace(motion, position=position, R=R, joint_angles=angles, covariance=covariance)
    fitted = count_moves_as_errors(model, motion, forget_moved_limbs(model, motion, fitted))
    fitted = replace(fitted, by_frame=frame_deviations(fitted, model, offsets))
    return FittedRun(fitted, "skin" if images.is_skin else "ellipsoids")


class _Window(NamedTuple):
    """Frames whose poses are fitted at once."""

    first: int  # which of the frames with a pose is its first
    rows: NDArray[np.intp]  # of the motion
    kept: slice  # of these: the others belong to the windows beside
    stretches: Sequence[Stretch]


def _windows(motion: Motion, model: BodyModel) -> Iterator[_Window]:
    """Yield the windows of a run, with what is smooth in them."""
    posed = np.flatnonzero(motion.has_pose)
    try:
        boundaries_s = [event.time_s for event in body_events(motion, model)]
    except ResultError:  # they cannot be found
        boundaries_s = []
    segment = segment_numbers(motion.time_s, boundaries_s)
    for start in range(0, len(posed), _WINDOW):
        first = max(start - _MARGIN, 0)
        rows = posed[first : start + _WINDOW + _MARGIN]
        smooth = [
            Stretch(each, falls_freely(motion, model, rows[each]))
            for each in stretches(motion.time_s[rows], np.ones(len(rows), bool), segment[rows], 0.0)
        ]
        yield _Window(first, rows, slice(start - first, start - first + _WINDOW), smooth)


@dataclass(slots=True, eq=False)
class _RunImages:
    """The images of the frames in which a run has poses, and what they all taught of body and background."""

    reader: Rereading
    model: BodyModel
    tracker: CompensatedTracker
    estimates: Sequence[Estimate]
    keys: Collection[int]
    progress: Progress | None
    learned: CompensatedState
    surfaces: list[RenderModel] = field(default_factory=list)  # alike, each for one thread at a time
    is_skin: bool = False  # whether they are a smooth skin instead of the body's ellipsoids
    has_texture: bool = False  # and the colours of its patches are learned, in a light that is fitted
    _held: dict[int, Frames] = field(default_factory=dict)
    _n_read: int = field(default=0)

    @classmethod
    def read(
        cls,
        reader: Rereading,
        settings: Settings,
        model: BodyModel,
        estimates: Sequence[Estimate],
        keys: Collection[int],
        progress: Progress | None,
    ) -> _RunImages:
        """Learn from all frames of a run."""
        start = estimates[0].pose
        assert start is not None
        tracker = tracker_of(settings, model, start)
        images = cls(reader, model, tracker, estimates, keys, progress, tracker.init())
        tracked = [each.index for each in estimates if each.status is Status.TRACKED]
        fitted = {tracked[k] for k in np.linspace(0, len(tracked) - 1, N_FRAMES).astype(int)} if tracked else set()
        found = list[tuple[Frames, Pose]]()
        for frames, estimate in zip(images.frames(estimates), estimates, strict=True):
            images.learned = tracker.learn(images.learned, frames, estimate)
            if estimate.index in fitted and estimate.pose is not None:
                found.append((frames, estimate.pose))
        skin = fit_skin(model, found)
        images.is_skin, surface = skin is not None, RenderModel.of(skin or model, settings.exact_lights)
        images.has_texture = images.is_skin and settings.exact_lights is None
        images.draw_with(cut_patches(surface) if images.has_texture else surface)
        return images

    @property
    def n_steps(self) -> int:
        """How many steps fit the run."""
        return _N_TEXTURE_STEPS if self.has_texture else N_STEPS

    def draw_with(self, surface: RenderModel) -> None:
        """Compare another surface with the images."""
        self.surfaces = [surface.copy() for _ in range(_N_THREADS)]

    def learn_texture(self, evidence: Sequence[ImageEvidence]) -> None:
        """Give the skin the colours that the images showed at the last look."""
        if self.has_texture:
            colours = chain.from_iterable(each.colours for each in evidence)
            self.draw_with(with_texture(self.surfaces[0], list(colours)))

    def linearise(
        self,
        frames: Frames,
        path: PoseHistory,
        misfit: float | None,
        tracked: Estimate,
        shown: NDArray[np.bool_],
    ) -> ImageEvidence:
        """Return what the images of a time say about the last pose of a path; called by `_N_THREADS` at once."""
        surface = self.surfaces.pop()  # its workspace serves one thread
        taught = shown if self.has_texture else None
        try:
            found = self.tracker.linearise(self.learned, frames, path, misfit, surface=surface, shown=taught)
        finally:
            self.surfaces.append(surface)
        return _evidence_of_tracker(tracked, path[-1][1], found) if frames.index in self.keys else found

    def assess(self, poses: Sequence[Pose], window: _Window, motion: Motion) -> Array:
        """Return the covariances of a window's frames by themselves (n, d, d), where limbs were unknown at its poses.

        What neither was sure of, two directions or a key, stays as it is.
        """
        covariances, rows = motion.covariance[window.rows], window.rows
        is_open = ~np.isfinite(np.diagonal(covariances, axis1=1, axis2=2)).all(axis=1)
        is_open &= ~motion.uncertain_joints[rows].any(axis=1) & ~np.isin(motion.index[rows], list(self.keys))
        chosen: list[int] = np.flatnonzero(is_open).tolist()
        path = [(Fraction(time_s), pose) for time_s, pose in zip(motion.time_s[rows], poses, strict=True)]
        estimates = [self.estimates[window.first + i] for i in chosen]
        for i, frames in zip(chosen, self.frames(estimates) if estimates else (), strict=True):
            past = (*path[:i], (frames.time_s, poses[i]))
            found = self.tracker.assess(self.learned, frames, past).covariance
            if found is not None:
                covariances[i] = _with_known(covariances[i], found)
        return covariances

    def frames(self, estimates: Sequence[Estimate]) -> Iterator[Frames]:
        """Yield the frames of estimates; as many as may be held are decoded once, until later ones are asked for."""
        wanted = [estimate.index for estimate in estimates]
        self._held = {index: frames for index, frames in self._held.items() if index >= wanted[0]}
        held = [self._held[index] for index in takewhile(self._held.__contains__, wanted)]
        for frames in chain(held, self._read(wanted[len(held) :])):
            yield frames
            self._n_read += 1
            if self.progress is not None:
                self.progress(self._n_read, max(self._n_read, (1 + self.n_steps) * len(self.estimates)))

    def _read(self, wanted: Sequence[int]) -> Iterator[Frames]:
        """Yield frames, reduced as they are looked at, which come after those that are held."""
        if not wanted:
            return
        n_bytes, all_wanted = sum(frames.n_held_bytes for frames in self._held.values()), set(wanted)
        for read in self.reader.forward(wanted[0], wanted[-1] + 1):
            if read.index in all_wanted:
                frames = self.tracker.reduce_frames(read)
                n_bytes += frames.n_held_bytes
                if n_bytes <= _MOST_BYTES:
                    self._held[frames.index] = frames
                yield frames


@dataclass(slots=True, eq=False)
class _Look:
    """One pass after the other over the images of a window."""

    images: _RunImages
    window: _Window
    shown: NDArray[np.bool_]  # (n, segments) that surely lie where the poses first had them
    misfits: Sequence[float] = ()  # of the frames, as first seen

    def __call__(self, poses: Sequence[Pose]) -> list[ImageEvidence]:
        """Return what the images say about poses, weighed as at the first look.

        The next look draws the colours that this one saw.
        """
        images, path, evidence = self.images, list[tuple[Fraction, Pose]](), list[ImageEvidence]()
        estimates, waiting = images.estimates[self.window.first :][: len(poses)], deque[Future[ImageEvidence]]()
        with ThreadPoolExecutor(_N_THREADS) as pool:
            for i, (frames, pose) in enumerate(zip(images.frames(estimates), poses, strict=True)):
                path.append((frames.time_s, pose))
                misfit = self.misfits[i] if self.misfits else None
                waiting.append(pool.submit(images.linearise, frames, tuple(path), misfit, estimates[i], self.shown[i]))
                if len(waiting) > _N_THREADS:
                    evidence.append(waiting.popleft().result())
            evidence += [each.result() for each in waiting]
        self.misfits = [each.misfit for each in evidence]
        images.learn_texture(evidence)
        return evidence


def _with_known(covariance: Array, found: Array) -> Array:
    """Return a covariance (d, d) with what another one knows where its own variances are infinite."""
    is_new = ~np.isfinite(np.diagonal(covariance)) & np.isfinite(np.diagonal(found))
    joined = np.where(is_new | is_new[:, None], 0.0, covariance)
    joined[np.ix_(is_new, is_new)] = found[np.ix_(is_new, is_new)]
    return joined


def _evidence_of_tracker(estimate: Estimate, pose: Pose, images: ImageEvidence) -> ImageEvidence:
    """Return what a tracker's estimate says about a pose, by its covariance, in the place of images."""
    assert estimate.pose is not None and estimate.covariance is not None
    information, away = invert_known(estimate.covariance), delta_between(pose, estimate.pose)
    cost, gradient = 0.5 * float(away @ information @ away), information @ away
    return replace(images, information=information, gradient=gradient, cost=cost, of_shape=0 * images.of_shape)
