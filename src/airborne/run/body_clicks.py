"""How well the cameras agree on the points that a body is fitted to, and which camera's clicks to check first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airborne.body_fitting.clothes import stem_of
from airborne.cameras.consensus import triangulate_consensus
from airborne.cameras.skeletons import LANDMARK_RECIPES
from airborne.run.detections import TrialDetections
from airborne.tracking.first_pose import LEAST_VISIBILITY
from airborne.types import Array
from airborne.video import Recording

_STANDS_OUT = 1.5  # times the other cameras' median distance


@dataclass(frozen=True, slots=True, eq=False)
class Clicks:
    """The points of some frames in every camera, and how far each lies from where the cameras agree."""

    cameras: tuple[str, ...]
    points: tuple[str, ...]
    distance_px: Array  # (frames, points, cameras); NaN where not seen or not agreed on
    notes: tuple[str, ...]

    @classmethod
    def of(cls, recording: Recording, detections: TrialDetections, images: Sequence[int]) -> Clicks:
        """Compare the detections of some images of the first camera."""
        rig, facts = recording.rig, recording.facts[0]
        rows = np.array(images) // round(facts.image_rate / facts.frame_rate)
        confident = detections.synchronous().above_visibility(LEAST_VISIBILITY)
        agreed = triangulate_consensus(rig, confident.px[rows], confident.visibility[rows])
        is_out = np.isfinite(agreed.distance_px) & ~agreed.is_used
        left_out = tuple(
            f"{camera} left out at {out.sum()} of {np.isfinite(distance_px).sum()} points, up to "
            f"{distance_px[out].max():.0f} px from where the other cameras see them"
            for camera, out, distance_px in zip(
                rig.names, np.moveaxis(is_out, -1, 0), np.moveaxis(agreed.distance_px, -1, 0), strict=True
            )
            if out.any()
        )
        notes = (*detections.frames.notes, *left_out)
        return cls(rig.names, confident.points, agreed.distance_px, notes)

    def camera_to_check(self, landmarks: Sequence[str]) -> str:
        """Name the camera whose clicks of some landmarks, without their sides, stand out; else say nothing."""
        recipes = [recipe for name, each in LANDMARK_RECIPES.items() if stem_of(name) in landmarks for recipe in each]
        wanted = {*landmarks, *(stem_of(point) for recipe in recipes for point in recipe)}
        columns = [i for i, point in enumerate(self.points) if stem_of(point) in wanted]
        distance_px = self.distance_px[:, columns].reshape(-1, len(self.cameras))
        if not np.isfinite(distance_px).any(axis=0).all():
            return ""
        median_px = np.nanmedian(distance_px, axis=0)
        worst = int(np.argmax(median_px))
        others_px = float(np.median(np.delete(median_px, worst)))
        if median_px[worst] < _STANDS_OUT * others_px:
            return ""
        return (
            f", first in {self.cameras[worst]}, where they lie {median_px[worst]:.0f} px from where the cameras agree "
            f"(in the others {others_px:.0f} px)"
        )
