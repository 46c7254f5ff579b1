"""Colours as a witness of a person's pose: how much the parts that a pose gives to pixels tell of their colours."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2
from scipy.spatial import KDTree

from airborne.appearance.pixel_features import colour_features
from airborne.body import BodyModel, PosedBody
from airborne.body.sides import without_side
from airborne.cameras import Camera
from airborne.tracking.first_pose.person import SilhouetteEvidence
from airborne.tracking.model_based.render_model import RenderModel

_N_COLOURS = 12  # that the pixels of a body are sorted into
_SKIN = {"face", "hand"}  # parts of one colour: what tells a face from hair


@dataclass(frozen=True, eq=False)
class PixelColours:
    """The pixels of some views that stand out, sorted by their colours."""

    cameras: Sequence[Camera]
    colours: Sequence[NDArray[np.int64]]  # (h, w) index of a colour, -1 where nothing stands out
    n: int  # pixels that stand out

    @classmethod
    def of(cls, silhouettes: SilhouetteEvidence) -> PixelColours:
        """Sort what stands out by its colours."""
        stands_out = [plane > 0 for plane in silhouettes.planes]
        features = [colour_features(image) for image in silhouettes.images]
        pixels = np.concatenate([each[here] for each, here in zip(features, stands_out, strict=True)])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a colour that no pixel has does no harm
            centres, _ = kmeans2(pixels, min(_N_COLOURS, len(pixels)), minit="++", rng=np.random.default_rng(0))
        tree = KDTree(centres)
        colours = [np.where(here, tree.query(each)[1], -1) for each, here in zip(features, stands_out, strict=True)]
        return cls(silhouettes.cameras, colours, len(pixels))

    def information(self, render_model: RenderModel, posed: PosedBody, class_of_part: NDArray[np.int64]) -> float:
        """Return the mutual information of parts and colours [nats a pixel that stands out]."""
        n_classes = int(class_of_part.max()) + 1
        counts = np.zeros((n_classes, _N_COLOURS))
        for camera, colours in zip(self.cameras, self.colours, strict=True):
            part = render_model.draw(posed, camera).part
            here = (colours >= 0) & (part >= 0)
            both = class_of_part[part[here]] * _N_COLOURS + colours[here]
            counts += np.bincount(both, minlength=counts.size).reshape(counts.shape)
        p = counts / max(counts.sum(), 1)
        alone = p.sum(axis=1, keepdims=True) * p.sum(axis=0)
        return float(np.sum(p[p > 0] * np.log(p[p > 0] / alone[p > 0]))) * counts.sum() / max(self.n, 1)


def colour_classes(model: BodyModel) -> NDArray[np.int64]:
    """Return which parts have their colours in common: (parts,), left and right alike, a face like the hands."""
    names = []
    for segment in model.segments:
        for part in segment.parts:
            kind, name = without_side(segment.name), without_side(part.name)
            is_skin = kind in _SKIN or name.rpartition("_")[2] in _SKIN
            names.append("skin" if is_skin else f"{kind} {name}")
    return np.unique(names, return_inverse=True)[1].astype(np.int64)
