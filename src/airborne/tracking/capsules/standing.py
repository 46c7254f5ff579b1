"""A standing player in a few numbers, and how much such players tell of the colours of all views' pixels."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2
from scipy.spatial import ConvexHull, KDTree

from airborne.appearance.pixel_features import colour_features
from airborne.kernels import kernel
from airborne.tracking.capsules.equations import N_CAPSULES, N_POINTS, classes_with, pose_state
from airborne.tracking.capsules.first_frame import average_shape
from airborne.tracking.capsules.jumper import FOOT_HEIGHT_M, N_DOF, SHORTS_END, SOCK_END, SURFACE_CLASSES
from airborne.tracking.capsules.kernel_arguments import NOBODY
from airborne.tracking.capsules.outlines import draw_labels, project_capsules
from airborne.tracking.capsules.surface_colours import class_image
from airborne.tracking.capsules.views import pack_camera
from airborne.types import Array
from airborne.video import View

# columns of a stance: x, y, heading; the pelvis' side and forward lean, the trunk's bend; of both legs in turn the
# hip's flexion and abduction, knee and ankle; stature; where shorts and socks end (shares); height of the lower foot
X, Y, HEADING, SIDE, LEAN, BEND = range(6)  # columns
HIPS, ASIDE, KNEES, ANKLES = (slice(i, i + 2) for i in (6, 8, 10, 12))
STATURE, SHORTS, SOCKS, HEIGHT = range(14, 18)  # columns
# first spread of a search [m, rad, shares]
STANCE_SD = np.array(
    [0.15, 0.15, 0.4, 0.08, 0.15, 0.12] + [0.2] * 2 + [0.1] * 2 + [0.25] * 2 + [0.15] * 2 + [0.05] * 3 + [0.1]
)
# of what standing people do, least and greatest
_LIMITS = np.array(
    [(-np.inf, np.inf)] * 3
    + [(-0.3, 0.3), (-0.4, 1.1), (-0.2, 0.7)]
    + [(-2.0, 0.4)] * 2
    + [(-0.6, 0.2), (-0.2, 0.6)]
    + [(0.0, 2.2)] * 2
    + [(-0.6, 0.85)] * 2
    + [(1.5, 2.15), (0.2, 0.9), (0.05, 0.7), (0.0, 1.0)]
).T
_STATURE_M, _STATURE_SD_M = 1.86, 0.07  # of volleyball players
_POSTURE_SD = np.array([0.25, 0.3, 0.2, 0.12])  # legs alike (hips, knees), feet level, side lean [rad]
_POSTURE_WEIGHT = 0.01  # [nat m2] of one squared sd, half a nat where 1 % of what a player tells, 2 nat m2, is one

_N_COLOURS = 24  # that the pixels are sorted into
_MOST_PIXELS = 30000  # that the colours are chosen by
_HALF_BOX_M = (0.7, 1.1)  # half width and height of what is looked at around a player, and
_BOX_MIDDLE_M = 0.8  # the height of its middle
_PLAY_HEIGHT_M = 1.7  # over the floor: colours are those of what lies below
_PRIOR_M2 = 1.5e-4  # of colours that a class may have beside those seen
_THICKER = 1.15  # what a player covers: a little more than the model


def stance(x: float, y: float, heading: float, knee: float) -> Array:
    """Return a stance (18,) in a crouch with the knees flexed by `knee` [rad]."""
    lean, hip = 0.15 + 0.35 * knee, -0.62 * knee - 0.1
    ankle = max(-(lean + hip + knee), -0.6)
    legs = [hip, hip, -0.1, 0.1, knee, knee, ankle, ankle]
    return np.array([x, y, heading, 0.0, lean, 0.1, *legs, _STATURE_M, 0.5, 0.25, 0.0])


def clip_stances(stances: Array) -> Array:
    """Return stances (n, 18) within what people do."""
    return np.clip(stances, *_LIMITS)


def implausibility(stances: Array) -> Array:
    """Return what is held against stances (n, 18): (n,) [nat m2]."""
    hips, knees = stances[:, HIPS], stances[:, KNEES]
    tilt = stances[:, LEAN] + hips.mean(axis=1) + knees.mean(axis=1) + stances[:, ANKLES].mean(axis=1)
    of = [hips[:, 0] - hips[:, 1], knees[:, 0] - knees[:, 1], tilt, stances[:, SIDE]]
    squares = (np.stack(of, axis=1) / _POSTURE_SD) ** 2
    return _POSTURE_WEIGHT * (squares.sum(axis=1) + ((stances[:, STATURE] - _STATURE_M) / _STATURE_SD_M) ** 2)


def states_of(stances: Array) -> Array:
    """Return the states (n, 35) of stances (n, 18): the lower foot stands on the floor, or its height over it."""
    shape = average_shape(1.0)
    states = np.zeros((len(stances), N_DOF + len(shape)))
    states[:, N_DOF:] = stances[:, STATURE, None] * shape
    states[:, N_DOF + SHORTS_END], states[:, N_DOF + SOCK_END] = stances[:, SHORTS], stances[:, SOCKS]
    states[:, [0, 1, 3, 4, 5, 6]] = stances[:, [X, Y, HEADING, SIDE, LEAN, BEND]]
    for side in range(2):
        columns = [part.start + side for part in (HIPS, ASIDE, KNEES, ANKLES)]
        states[:, [8 + 5 * side, 9 + 5 * side, 11 + 5 * side, 12 + 5 * side]] = stances[:, columns]
    _put_over_floor(states, stances[:, HEIGHT])
    return states


@kernel
def _put_over_floor(states, heights):
    points, ends = np.empty((N_POINTS, 3)), np.empty((N_CAPSULES, 2, 3))
    radii, share = np.empty((N_CAPSULES, 2)), np.ones(N_CAPSULES)
    for i in range(len(states)):
        pose_state(states[i], points, ends, radii, share)
        states[i, 2] += FOOT_HEIGHT_M + heights[i] - min(points[6, 2], points[7, 2])


@dataclass(frozen=True, eq=False)
class ColourViews:
    """What some cameras see at one time, every pixel's colour one of 24."""

    views: Sequence[View]  # small ones
    cameras: Array  # (v, 4, 4)
    colours: Sequence[NDArray[np.int16]]  # (h, w) by view; -1 where a player was found already

    @classmethod
    def of(cls, views: Sequence[View], zone: Array) -> ColourViews:
        """Sort the colours of what players in a zone of the floor (2, 2), from and to x, y [m], may cover."""
        features = [colour_features(view.rgb) for view in views]
        here = np.concatenate([each[_shows(view, zone)] for view, each in zip(views, features, strict=True)])
        if not len(here):  # no view shows the zone: any colour will do
            here = features[0].reshape(-1, features[0].shape[-1])[:1]
        rng = np.random.default_rng(0)
        here = here[rng.choice(len(here), min(len(here), _MOST_PIXELS), replace=False)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a colour that no pixel has does no harm
            centres, _ = kmeans2(here, min(_N_COLOURS, len(here)), minit="++", rng=rng)
        tree = KDTree(centres)
        colours = [np.asarray(tree.query(each)[1], np.int16) for each in features]
        return cls(views, np.stack([pack_camera(view.camera) for view in views]), colours)

    def without(self, state: Array) -> ColourViews:
        """Return the views without the pixels of a player (35,)."""
        left = []
        for view, colours in zip(self.views, self.colours, strict=True):
            is_covered = class_image(state, view.camera, _THICKER) >= 0
            left.append(np.where(is_covered, np.int16(-1), colours))
        return ColourViews(self.views, self.cameras, left)

    def support(self, states: Array) -> Array:
        """Return how much players (n, 35) tell of the colours around them: (n,) [nat m2].

        Log-likelihood ratio of the colours given the surface classes, whose colours are the same in all views, to the
        colours of the surroundings alone, those of each view its own. The view that tells least may be left out.
        """
        areas = np.zeros((len(states), len(self.views), len(SURFACE_CLASSES) + 1, _N_COLOURS))
        classes = classes_with(NOBODY)
        for view, (camera, colours) in enumerate(zip(self.cameras, self.colours, strict=True)):
            _add_areas(states, camera, colours, classes, areas[:, view])
        ratios = [_log_ratio(areas)]
        if len(self.views) > 2:
            for view in range(len(self.views)):
                ratios.append(_log_ratio(np.delete(areas, view, axis=1)))
        return np.max(ratios, axis=0)


def _shows(view: View, zone: Array) -> NDArray[np.bool_]:
    """Return which pixels (h, w) may show a player in a zone of the floor."""
    corners = np.array([(x, y, z) for x in zone[:, 0] for y in zone[:, 1] for z in (0, _PLAY_HEIGHT_M)])
    px = view.camera.px_from_world(corners)
    px = px[np.isfinite(px).all(axis=1)]
    rows, columns = np.indices(view.rgb.shape[:2])
    inside = np.ones(rows.shape, bool)
    if len(px) > 2:
        for a, b, c in ConvexHull(px).equations:
            inside &= a * columns + b * rows + c <= 0
    return inside


def _log_ratio(areas: Array) -> Array:
    """Return the ratio (n,) [nat m2] of areas (n, views, classes + 1, colours) [m2]; the last class is none."""
    own, around, whole = areas[:, :, :-1].sum(axis=1), areas[:, :, -1], areas.sum(axis=2)
    by_class = (own * _log_share(own)).sum(axis=(1, 2)) + (around * _log_share(around)).sum(axis=(1, 2))
    return by_class - (whole * _log_share(whole)).sum(axis=(1, 2))


def _log_share(areas: Array) -> Array:
    return np.log((areas + _PRIOR_M2) / (areas.sum(axis=-1, keepdims=True) + _PRIOR_M2 * areas.shape[-1]))


@kernel
def _add_areas(states, camera, colours, classes, areas):
    """Add to areas (n, 6, colours) the area [m2] that each class, or none, has of each colour around players (n, 35).

    Nothing is added where the surroundings lie beyond the image's border.
    """
    points, ends = np.empty((N_POINTS, 3)), np.empty((N_CAPSULES, 2, 3))
    radii, share = np.empty((N_CAPSULES, 2)), np.ones(N_CAPSULES)
    discs, depth = np.empty((N_CAPSULES, 2, 3)), np.empty(N_CAPSULES)
    h, w = colours.shape
    none = areas.shape[1] - 1
    for i in range(len(states)):
        middle = np.array([states[i, 0], states[i, 1], _BOX_MIDDLE_M, 1.0])
        x, y, d = camera[0] @ middle, camera[1] @ middle, camera[2] @ middle
        if d < 0.5:
            continue
        m_per_px = d / camera[3, 0]
        half_w, half_h = _HALF_BOX_M[0] / m_per_px, _HALF_BOX_M[1] / m_per_px
        x0, x1 = int(np.floor(x / d - half_w)), int(np.ceil(x / d + half_w))
        y0, y1 = int(np.floor(y / d - half_h)), int(np.ceil(y / d + half_h))
        if x0 < 0 or y0 < 0 or x1 > w or y1 > h:
            continue
        pose_state(states[i], points, ends, radii, share)
        project_capsules(ends, radii, camera, discs, depth)
        for k in range(N_CAPSULES):
            for end in range(2):
                discs[k, end, 0] -= x0
                discs[k, end, 1] -= y0
        labels = np.empty((y1 - y0, x1 - x0), np.int8)
        draw_labels(discs, depth, classes, share, labels)
        for row in range(y1 - y0):
            for column in range(x1 - x0):
                colour = colours[y0 + row, x0 + column]
                if colour >= 0:
                    label = labels[row, column]
                    areas[i, none if label < 0 else label, colour] += m_per_px * m_per_px
