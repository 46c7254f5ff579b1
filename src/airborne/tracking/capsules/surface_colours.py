"""Colours of a player's shirt, shorts, skin, socks and shoes, learned from a posed jumper and its background."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.foreground import BINS_PER_CHANNEL, count_colours
from airborne.appearance.surface_classes import log_ratio_table
from airborne.cameras import Camera
from airborne.tracking.capsules.equations import N_CAPSULES, N_LENGTHS, N_POINTS, classes_with, pose_state
from airborne.tracking.capsules.jumper import N_DOF, SHOE, SKIN, SOCK, SURFACE_CLASSES
from airborne.tracking.capsules.kernel_arguments import NOBODY, Capsules
from airborne.tracking.capsules.outlines import draw_labels, project_capsules
from airborne.tracking.capsules.views import EvidenceTable, PlayerRegion, pack_camera
from airborne.types import Array, Array32

_CORE, _AROUND = 0.6, 1.25  # of the thickness: inside _CORE is the player, outside _AROUND the background
_LEAST_OCCLUSION, _MOST_OCCLUSION = 0.05, 0.9  # bounds of a class's probability to be occluded
_AT_EVEN = 0.5  # occlusion of a class whose evidence is 0; 0 where the evidence is as expected
_LEAST_EXPECTED = 0.3  # [nat]
_MOST_IN_BEST = (0.1, 0.4)  # upper bounds of a class's occlusion in the view that shows it best, and in the next
_LEAST_PX = 20  # of a class in a view, to judge its occlusion
_ROUNDS = 6  # of separating the colours of the classes
# chosen by hand; without it the joints err by 22.1 mm, not 20.9: blocker_variants.csv, colours as lit at first
BRIGHTNESS_SD = 0.10  # of the logarithm of sRGB values: about a fifth more or less light, as a surface rotates
_LIGHTNESS = np.linspace(-1.5, 1.5, 15)  # in units of the sd; dense enough to reach every bin
_LIGHTS, _LIGHT_WEIGHTS = np.exp(BRIGHTNESS_SD * _LIGHTNESS), np.exp(-(_LIGHTNESS**2) / 2)
_THICKNESSES = slice(N_DOF + N_LENGTHS, N_DOF + N_LENGTHS + 6)  # the radii among a state
# not sensitive: without it the joints err by 21.1 mm, not 20.9: blocker_variants.csv, socks and shoes as at first
COLOUR_UPDATE_S = 0.2  # period of relearning socks and shoes: in the air they show other sides than on the floor
_UPDATE_RATE, _FIRST_WEIGHT = 0.35, 0.5  # of each update; in it, of the first frame's colours
_MOST_OCCLUDED = 0.3  # in a view to learn from


class ClassImages(NamedTuple):
    """The class of each pixel of a region, -1 where none: (h, w), of thin, true and thick capsules."""

    core: NDArray[np.int8]
    whole: NDArray[np.int8]
    around: NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceColours:
    """Colour distributions, 32 bins a channel, and the probability of occlusion of each class in each camera."""

    distributions: Array32  # (5, 32, 32, 32)
    first: Array32  # (5, 32, 32, 32) as the first frame shows them
    background: Array32  # (cameras, 32, 32, 32)
    occlusion: Array  # (cameras, 5)

    def table(self, view: int, occlusion: Array | None = None) -> EvidenceTable:
        """Return a camera's table of evidence, for its own or another occlusion (5,)."""
        n = len(SURFACE_CLASSES)
        assumed: Array = self.occlusion[view] if occlusion is None else occlusion
        evidence = log_ratio_table(self.distributions, self.background[view], assumed)
        expected = np.einsum("kc,ck->k", self.distributions.reshape(n, -1), evidence[:, :n])
        return EvidenceTable(assumed, evidence, expected, expected - self.background[view].ravel() @ evidence[:, :n])


def class_image(state: Array, camera: Camera, thickness: float, others: Capsules = NOBODY) -> NDArray[np.int8]:
    """Draw the class of each pixel of a camera's image: (h, w), -1 where none, 5 where one of the others is."""
    state = state.copy()
    state[_THICKNESSES] *= thickness
    n = N_CAPSULES + len(others.ends)
    ends, end_radii, share = np.empty((n, 2, 3)), np.empty((n, 2)), np.ones(n)
    ends[N_CAPSULES:], end_radii[N_CAPSULES:] = others
    discs, depth = np.empty((n, 2, 3)), np.empty(n)
    pose_state(state, np.empty((N_POINTS, 3)), ends, end_radii, share)
    project_capsules(ends, end_radii, pack_camera(camera), discs, depth)
    out = np.empty(camera.size[::-1], np.int8)
    draw_labels(discs, depth, classes_with(others), share, out)
    return out


class ColourCounts(NamedTuple):
    """How often regions show each colour."""

    classes: Array  # (regions, 5, 32768) on each class, brighter and darker too
    background: Array32  # (regions, 32, 32, 32) around the player


def count_surfaces(regions: Sequence[PlayerRegion], images: Sequence[ClassImages]) -> ColourCounts:
    """Count the colours of one player and around, drawn in each region.

    A colour also counts, with less weight, brighter and darker: a surface rotates in the light, and one frame shows few
    of its pixels.
    """
    n, k, bins = len(regions), len(SURFACE_CLASSES), (BINS_PER_CHANNEL,) * 3
    counts, background = np.zeros((n, k, *bins), np.float32), np.zeros((n, *bins), np.float32)
    for region, (core, _, around), of_class, of_background in zip(regions, images, counts, background, strict=True):
        count_colours(region.rgb, around < 0, 1, of_background)
        for i, count in enumerate(of_class):
            count_colours(region.rgb, core == i, 1, count)
    return ColourCounts(_augment_brightness(counts.reshape(n * k, *bins)).reshape(n, k, -1), background)


def learn_colours(
    counts: ColourCounts, views: Sequence[int], n_cameras: int, used: NDArray[np.bool_]
) -> SurfaceColours:
    """Learn from the counts of regions in some views: used (cameras, 5) masks which camera counts for which class.

    A colour that a class shares with the background, or with the class above or below it on the body, goes to the one
    that has more of it.
    """
    background = np.zeros((n_cameras, *counts.background.shape[1:]), np.float32)
    background[views] = counts.background / np.maximum(counts.background.sum(axis=(1, 2, 3), keepdims=True), 1)
    raw = _normalise(np.einsum("vk,vkc->kc", used[views].astype(float), counts.classes))
    cells = np.flatnonzero(raw.any(axis=0))
    around = background.sum(axis=0).ravel()[cells] / max(len(views), 1)
    distributions = np.zeros(raw.shape, np.float32)
    distributions[:, cells] = _separate_classes(raw[:, cells], around)
    distributions = distributions.reshape(len(raw), *background.shape[1:])
    return SurfaceColours(distributions, distributions, background, np.zeros((n_cameras, len(SURFACE_CLASSES))))


def update_colours(
    colours: SurfaceColours, state: Array, regions: Sequence[PlayerRegion], others: Capsules
) -> SurfaceColours:
    """Update the colours of socks and shoes from the views in which they are visible.

    state (35,) is the player's estimate, others as in `fit_jumper`.
    """
    counts = np.zeros((1 + SHOE - SKIN, BINS_PER_CHANNEL, BINS_PER_CHANNEL, BINS_PER_CHANNEL), np.float32)
    for region in regions:
        core = class_image(state, region.region_camera, _CORE, others)
        for i, count in enumerate(counts, SKIN):
            if colours.occlusion[region.view, i] < _MOST_OCCLUDED:
                count_colours(region.rgb, core == i, 1, count)
    raw = _normalise(_augment_brightness(counts).reshape(len(counts), -1))
    cells = np.flatnonzero(raw.any(axis=0))
    new = _separate_classes(raw[:, cells], colours.background.reshape(-1, raw.shape[1])[:, cells].mean(axis=0))
    distributions = colours.distributions.copy()
    for i in (SOCK, SHOE):
        if counts[i - SKIN].sum() > _LEAST_PX:
            target = _FIRST_WEIGHT * colours.first[i].ravel()
            target[cells] += (1 - _FIRST_WEIGHT) * new[i - SKIN]
            distributions[i] += _UPDATE_RATE * (target.reshape(distributions[i].shape) - distributions[i])
    return replace(colours, distributions=distributions)


def _separate_classes(raw: Array, around: Array) -> Array:
    """Assign colours that classes (k, n) share with the background (n,), or with adjacent classes, to one of them."""
    distributions = raw
    for _ in range(_ROUNDS):
        competing = distributions + around + 1e-9
        competing[1:] += distributions[:-1]
        competing[:-1] += distributions[1:]
        distributions = _normalise(raw * distributions / competing)
    return distributions


def learn_unoccluded(state: Array, regions: Sequence[PlayerRegion], n_cameras: int, others: Capsules) -> SurfaceColours:
    """Learn as `learn_colours` does, from the views in which the player is not occluded, and estimate the occlusion.

    A class in one view is judged by its colours in the other views. others as in `fit_jumper`.
    """
    used = np.zeros((n_cameras, len(SURFACE_CLASSES)), bool)
    used[[region.view for region in regions]] = True
    occlusion = np.full(used.shape, _LEAST_OCCLUSION)
    images = [
        ClassImages(
            core=class_image(state, region.region_camera, _CORE, others),
            whole=class_image(state, region.region_camera, 1.0, others),
            around=class_image(state, region.region_camera, _AROUND),
        )
        for region in regions
    ]
    counts, views = count_surfaces(regions, images), [region.view for region in regions]
    if len(regions) > 2:
        for region, image in zip(regions, images, strict=True):
            elsewhere = used.copy()
            elsewhere[region.view] = False
            colours = learn_colours(counts, views, n_cameras, elsewhere)
            occlusion[region.view] = occlusion_chance(*_mean_evidence(image.whole, region, colours))
        agreeing = used & (occlusion < _AT_EVEN)
        used = np.where(agreeing.any(axis=0), agreeing, used)
    return replace(learn_colours(counts, views, n_cameras, used), occlusion=occlusion)


def occlusion_chance(evidence: Array, expected: Array) -> Array:
    """Return the probability of occlusion of classes whose pixels have this mean evidence [nat]; NaN counts as 0.

    `expected` is their evidence without occlusion.
    """
    share = np.nan_to_num(evidence) / np.maximum(expected, _LEAST_EXPECTED)
    return np.clip(_AT_EVEN * (1 - share), _LEAST_OCCLUSION, _MOST_OCCLUSION)


def limit_occlusion(occlusion: Array, views: Sequence[int]) -> Array:
    """Return occlusion (cameras, 5) with each class visible in two views: if all disagree, the pose is wrong."""
    occlusion = occlusion.copy()
    for i in range(occlusion.shape[1]):
        best = np.argsort(occlusion[views, i], kind="stable")[: len(_MOST_IN_BEST)]
        for view, most in zip(np.array(views)[best], _MOST_IN_BEST, strict=False):
            occlusion[view, i] = min(occlusion[view, i], most)
    return occlusion


def _mean_evidence(part: NDArray[np.int8], region: PlayerRegion, colours: SurfaceColours) -> tuple[Array, Array]:
    """Return the mean evidence of each class's pixels in a region (5,) [nat], NaN for too few; and the expected one."""
    table = colours.table(region.view, np.full(len(SURFACE_CLASSES), _LEAST_OCCLUSION))
    cells = region.rgb.astype(np.int64) >> 3
    cells = (cells[..., 0] << 10) | (cells[..., 1] << 5) | cells[..., 2]
    mean_evidence = np.full(len(SURFACE_CLASSES), np.nan)
    for i in range(len(SURFACE_CLASSES)):
        mask = part == i
        if np.count_nonzero(mask) > _LEAST_PX:
            mean_evidence[i] = table.evidence[cells[mask], i].mean()
    return mean_evidence, table.expected


def _augment_brightness(counts: Array32) -> Array:
    """Spread colour counts (k, 32, 32, 32) over the same colours in more and in less light."""
    i, *cell = np.unravel_index(np.flatnonzero(counts != 0), counts.shape)  # much sooner than np.nonzero finds them
    lit = np.minimum(_LIGHTS[:, None, None] * (np.array(cell) + 0.5), BINS_PER_CHANNEL - 1)  # (lights, 3, n)
    lit = lit.astype(int)
    to = np.ravel_multi_index((np.broadcast_to(i, lit[:, 0].shape), *np.moveaxis(lit, 1, 0)), counts.shape)
    weights = _LIGHT_WEIGHTS[:, None] * counts[i, *cell]
    return np.asarray(np.bincount(to.ravel(), weights.ravel(), counts.size), float).reshape(counts.shape)


def _normalise(counts: Array) -> Array:
    return counts / np.maximum(counts.sum(axis=1, keepdims=True), 1e-9)
