"""Gauss-Newton by synthesis: the pose moves until its picture agrees with every camera's at once.

Far out, the blurred mask is fitted to the blurred probability of each pixel to be body, on reduced pictures
(`silhouettes`). Close in, the composite of the lit body over the empty scene is fitted to the picture itself
(`photometric`), which is not pulled toward bright edges as any classification is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airborne.body import BodyModel, Geometry, Pose, geometry
from airborne.cameras import Camera
from airborne.rendering.maps import surface_maps
from airborne.rendering.shapes import new_shapes
from airborne.scoring.lighting import TO_LIGHT, light_from_srgb
from airborne.scoring.plate import fill
from airborne.tracking.appearance import Appearance, Region
from airborne.tracking.normal_equations import gaussian_taps, photometric_equations, silhouette_equations

Array = NDArray[np.floating]

# reduction of the picture, iterations
FAR, NEAR = ((8, 5), (4, 4), (2, 3)), ((4, 2), (2, 2))
_COARSE_SIGMA_PX = 1.2  # of the reduced picture
_FINE_SIGMA_PX = 1.2  # of a full frame
_CLIP = 0.1  # linear light, 0..1: a residual this large counts a quarter
_OVERSTEP = 1.6  # robust weights and refitted light make each step about this much too short
_MOST_STEPS = 12
_SETTLED = 0.5  # squared length of the last step, in sds of the pose
_PRIOR_SD = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])  # [m], [rad]: keeps what the pictures do not show where it is
UNSEEN_SD = np.array([0.25, 0.25, 0.25, 0.5, 0.5, 0.5])  # [m], [rad]: an sd above this is no knowledge
_LEVER_M = 0.3  # length that makes metres and radians comparable


@dataclass(slots=True)
class Workspace:
    """A body's arrays for the kernels; made once, reused by every call of one thread."""

    model: BodyModel
    geometry: Geometry
    shapes: NamedTuple  # type: ignore[valid-type]
    albedo: NDArray[np.float32]  # (parts, 3) linear light
