"""Score one pose of a white ball before a black image: what `yardstick.py` times from the start of Python."""

import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.body import BodyModel, Ellipsoid, Part, Segment, surface_arrays
from airborne.cameras import Camera
from airborne.rendering import FLAT, pack_targets, score
from airborne.video import View

part = Part("part", Ellipsoid(np.ones(3)), RigidTransform.identity(), np.full(3, 128.0))
shapes = surface_arrays(BodyModel("body", (Segment("root", None, np.zeros(3), (part,)),)))
K = np.array([[700.0, 0, 384], [0, 700, 288], [0, 0, 1]])
camera = Camera(name="camera", K=K, size=(768, 576), camera_from_world=RigidTransform.from_translation([0, 0, 5.0]))
target = pack_targets([View(camera, np.zeros((576, 768, 3), np.uint8))], FLAT)
score(shapes, target, np.eye(3)[None, None], np.zeros((1, 1, 3)))
