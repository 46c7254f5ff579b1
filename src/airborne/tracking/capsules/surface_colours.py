"""What a player's shirt, shorts, skin, socks and shoes look like, learned from a posed jumper and its background."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from airborne.appearance.foreground import BINS, count_colours
from airborne.appearance.surface_classes import ratio_table
from airborne.cameras import Camera
from airborne.tracking.capsules.equations import N_CAPSULES, N_LENGTHS, N_POINTS, NOBODY, kinds_with, placed
from airborne.tracking.capsules.jumper import KINDS, N_DOF, SHOE, SKIN, SOCK
from airborne.tracking.capsules.outlines import labels, project
from airborne.tracking.capsules.views import Region, Table, packed

Array = NDArray[np.floating]

CORE, AROUND = 0.6, 1.25  # pixels under thinner capsules are the player's; outside thicker ones they are not
LEAST_HIDDEN, MOST_HIDDEN = 0.05, 0.9
_AT_EVEN = 0.5  # hidden where a kind's evidence is nothing; not at all where it is as usual
_LEAST_USUAL = 0.3  # [nat]
_IN_SIGHT = (0.1, 0.4)  # the most that a kind is hidden in the view that sees it best, and in the next
_LEAST_PX = 20  # of a kind in a view to judge it by
_ROUNDS = 6
BRIGHTNESS_SD = 0.10  # of the logarithm of sRGB values: about a fifth more or less light, as a surface turns
_LIGHTNESS = np.linspace(-1.5, 1.5, 15)  # in these; so many that no bin between is left out
_LIGHTS, _LIGHT_WEIGHTS = np.exp(BRIGHTNESS_SD * _LIGHTNESS), np.exp(-(_LIGHTNESS**2) / 2)
_THICKNESSES = slice(N_DOF + N_LENGTHS, N_DOF + N_LENGTHS + 6)  # the radii among a state
RENEWED_S = 0.2  # how often socks and shoes are looked at anew: in the air they show other sides than on the floor
_RENEWING, _AS_FIRST = 0.35, 0.5  # share that is new each time; of it, what they looked like at first
_FREE = 0.3  # views in which they are hidden less teach


class Drawings(NamedTuple):
    """Which kind each pixel of a region shows, -1 where none: (h, w), of thin, true and thick capsules."""

    core: NDArray[np.int8]
    whole: NDArray[np.int8]
    around: NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class Colours:
    """Colour probabilities, 32 bins a channel, and how likely each camera's view of each kind is covered."""

    kinds: NDArray[np.float32]  # (5, 32, 32, 32)
    first: NDArray[np.float32]  # (5, 32, 32, 32) as the first frame shows them
    background: NDArray[np.float32]  # (cameras, 32, 32, 32)
    hidden: Array  # (cameras, 5)

    def table(self, view: int, hidden: Array | None = None) -> Table:
        """Return a camera's table of evidence, as it is or for another hidden (5,)."""
        n = len(KINDS)
        chosen: Array = self.hidden[view] if hidden is None else hidden
        evidence = ratio_table(self.kinds, self.background[view], chosen)
        usual = np.einsum("kc,ck->k", self.kinds.reshape(n, -1), evidence[:, :n])
        return Table(chosen, evidence, usual, usual - self.background[view].ravel() @ evidence[:, :n])


def drawn(state: Array, camera: Camera, thickness: float, others: tuple[Array, Array] = NOBODY) -> NDArray[np.int8]:
    """Draw which kind each pixel of a camera's picture shows: (h, w), -1 where none, 5 where one of the others is."""
    state = state.copy()
    state[_THICKNESSES] *= thickness
    other_ends, other_balls = others
    n = N_CAPSULES + len(other_ends)
    ends, balls, share = np.empty((n, 2, 3)), np.empty((n, 2)), np.ones(n)
    ends[N_CAPSULES:], balls[N_CAPSULES:] = other_ends, other_balls
    discs, depth = np.empty((n, 2, 3)), np.empty(n)
    placed(state, np.empty((N_POINTS, 3)), ends, balls, share)
    project(ends, balls, packed(camera), discs, depth)
    out = np.empty(camera.size[::-1], np.int8)
    labels(discs, depth, kinds_with(others), share, out)
    return out


def learned(
    regions: Sequence[Region], drawings: Sequence[Drawings], n_cameras: int, used: NDArray[np.bool_]
) -> Colours:
    """Learn from one player, drawn in each region: used (cameras, 5) says which camera's view of which kind counts.

    A colour counts as it was seen and, less, brighter and darker: a surface turns in the light, and one frame shows
    few of its pixels. What a kind's pixels share with the background, or with the kind above or below it on the body,
    goes to the one that has more of it.
    """
    counts = np.zeros((len(KINDS), BINS, BINS, BINS), np.float32)
    background = np.zeros((n_cameras, BINS, BINS, BINS), np.float32)
    for region, (core, _, around) in zip(regions, drawings, strict=True):
        count_colours(region.rgb, around < 0, 1, background[region.view])
        for kind in range(len(KINDS)):
            if used[region.view, kind]:
                count_colours(region.rgb, core == kind, 1, counts[kind])
    background /= np.maximum(background.sum(axis=(1, 2, 3), keepdims=True), 1)
    raw = _normalised(_in_all_lights(counts).reshape(len(KINDS), -1))
    around_all = background.sum(axis=0).ravel() / max(len(regions), 1)
    kinds = _shared_out(raw, around_all).reshape(counts.shape).astype(np.float32)
    return Colours(kinds, kinds, background, np.zeros((n_cameras, len(KINDS))))


def renewed(colours: Colours, state: Array, regions: Sequence[Region], others: tuple[Array, Array]) -> Colours:
    """Take in what socks and shoes look like now, in the views in which they are in sight.

    state (35,) is where the player was found, others as `fit` takes them.
    """
    counts = np.zeros((1 + SHOE - SKIN, BINS, BINS, BINS), np.float32)
    for region in regions:
        core = drawn(state, region.full, CORE, others)
        for kind, count in enumerate(counts, SKIN):
            if colours.hidden[region.view, kind] < _FREE:
                count_colours(region.rgb, core == kind, 1, count)
    raw = _normalised(_in_all_lights(counts).reshape(len(counts), -1))
    cells = np.flatnonzero(raw.any(axis=0))
    new = _shared_out(raw[:, cells], colours.background.reshape(-1, raw.shape[1])[:, cells].mean(axis=0))
    kinds = colours.kinds.copy()
    for kind in (SOCK, SHOE):
        if counts[kind - SKIN].sum() > _LEAST_PX:
            target = _AS_FIRST * colours.first[kind].ravel()
            target[cells] += (1 - _AS_FIRST) * new[kind - SKIN]
            kinds[kind] += _RENEWING * (target.reshape(kinds[kind].shape) - kinds[kind])
    return replace(colours, kinds=kinds)


def _shared_out(raw: Array, around: Array) -> Array:
    """Give what kinds (k, n) share with the background (n,), or with the kind beside them, to the one with more."""
    kinds = raw
    for _ in range(_ROUNDS):
        beside = kinds + around + 1e-9
        beside[1:] += kinds[:-1]
        beside[:-1] += kinds[1:]
        kinds = _normalised(raw * kinds / beside)
    return kinds


def seen_through(state: Array, regions: Sequence[Region], n_cameras: int, others: tuple[Array, Array]) -> Colours:
    """Learn as `learned` does, from the views in which nothing stands before the player; say which these are.

    A view's kind is judged by the colours that the other views give it. others as `fit` takes them.
    """
    used = np.zeros((n_cameras, len(KINDS)), bool)
    used[[region.view for region in regions]] = True
    hidden = np.full(used.shape, LEAST_HIDDEN)
    drawings = [
        Drawings(
            core=drawn(state, region.full, CORE, others),
            whole=drawn(state, region.full, 1.0, others),
            around=drawn(state, region.full, AROUND),
        )
        for region in regions
    ]
    if len(regions) > 2:
        for region, drawing in zip(regions, drawings, strict=True):
            elsewhere = used.copy()
            elsewhere[region.view] = False
            colours = learned(regions, drawings, n_cameras, elsewhere)
            hidden[region.view] = hidden_by(*_mean_evidence(drawing.whole, region, colours))
        agreeing = used & (hidden < _AT_EVEN)
        used = np.where(agreeing.any(axis=0), agreeing, used)
    return replace(learned(regions, drawings, n_cameras, used), hidden=hidden)


def hidden_by(evidence: Array, usual: Array) -> Array:
    """Return the chance to be covered, of kinds whose pixels have this mean evidence; NaN: as if it were 0 [nat].

    `usual` is what they have when nothing covers them.
    """
    share = np.nan_to_num(evidence) / np.maximum(usual, _LEAST_USUAL)
    return np.clip(_AT_EVEN * (1 - share), LEAST_HIDDEN, MOST_HIDDEN)


def not_everywhere(hidden: Array, views: Sequence[int]) -> Array:
    """Return hidden (cameras, 5) with each kind in sight of two views: where all disagree, the pose is wrong."""
    hidden = hidden.copy()
    for kind in range(hidden.shape[1]):
        best = np.argsort(hidden[views, kind], kind="stable")[: len(_IN_SIGHT)]
        for view, most in zip(np.array(views)[best], _IN_SIGHT, strict=False):
            hidden[view, kind] = min(hidden[view, kind], most)
    return hidden


def _mean_evidence(part: NDArray[np.int8], region: Region, colours: Colours) -> tuple[Array, Array]:
    """Return the mean evidence of each kind's pixels in a region (5,) [nat], NaN where too few are drawn; and usual."""
    table = colours.table(region.view, np.full(len(KINDS), LEAST_HIDDEN))
    cells = region.rgb.astype(np.int64) >> 3
    cells = (cells[..., 0] << 10) | (cells[..., 1] << 5) | cells[..., 2]
    found = np.full(len(KINDS), np.nan)
    for kind in range(len(KINDS)):
        chosen = part == kind
        if np.count_nonzero(chosen) > _LEAST_PX:
            found[kind] = table.evidence[cells[chosen], kind].mean()
    return found, table.usual


def _in_all_lights(counts: NDArray[np.float32]) -> Array:
    """Spread counts (k, 32, 32, 32) of colours over what they are in more and in less light."""
    kind, *cell = np.nonzero(counts)
    lit = np.minimum(_LIGHTS[:, None, None] * (np.array(cell) + 0.5), BINS - 1).astype(int)  # (lights, 3, n)
    to = np.ravel_multi_index((np.broadcast_to(kind, lit[:, 0].shape), *np.moveaxis(lit, 1, 0)), counts.shape)
    weights = _LIGHT_WEIGHTS[:, None] * counts[kind, *cell]
    return np.asarray(np.bincount(to.ravel(), weights.ravel(), counts.size), float).reshape(counts.shape)


def _normalised(counts: Array) -> Array:
    return counts / np.maximum(counts.sum(axis=1, keepdims=True), 1e-9)
