"""
Where every landmark lies
=========================

The landmarks of ``human18``, a person of 18 segments, in the zero pose: front and left side. The right side of the body
has the same landmarks as the left.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import RigidTransform

from airborne.body import Pose, human18, surface_arrays
from airborne.cameras import camera_looking_at
from airborne.rendering import FLAT, render

person = human18(stature_m=1.75, mass_kg=68.0)
posed = person.with_pose(Pose(world_from_root=RigidTransform.identity()))
places = dict(zip((landmark.name for landmark in person.landmarks), posed.landmarks, strict=True))

# %%
# Two cameras far away, so that their pictures are nearly parallel projections. Body axes: x to the left, y to the back,
# z up.

SIZE, AIM = (460, 1000), (0.0, 0.0, -0.25)
CAMERAS = {
    "front": camera_looking_at("front", (0.0, -40.0, -0.25), AIM, focal_px=20000.0, size=SIZE),
    "left side": camera_looking_at("left side", (40.0, 0.0, -0.25), AIM, focal_px=20000.0, size=SIZE),
}


def label(axes, camera, name, *, x_px):
    """Mark a landmark and write its name at the picture's column x_px."""
    u, v = camera.px_from_world(places[name])
    axes.plot(u, v, "o", color="#d55e00", markersize=5)
    words = name.replace("_left", "_left, _right")
    axes.annotate(
        words,
        (u, v),
        (x_px, v),
        ha="left" if x_px > u else "right",
        va="center",
        fontsize=9,
        arrowprops={"arrowstyle": "-", "color": "#999999", "linewidth": 0.6},
    )


figure, panels = plt.subplots(1, 2, figsize=(8, 7.6), layout="constrained")
for axes, (view, camera) in zip(panels, CAMERAS.items(), strict=True):
    drawn = render(surface_arrays(person), posed, camera, FLAT)
    shade = np.where(drawn.mask, 235 - 14 * (drawn.segment % 4), 255).astype(np.uint8)
    axes.imshow(shade, cmap="gray", vmin=0, vmax=255)
    axes.set_title(view, fontsize=10)
    axes.set_xlim(-10, 560)
    axes.set_axis_off()
front, side = panels
for name in places:
    if name.endswith("_left"):
        label(front, CAMERAS["front"], name, x_px=385)
    elif not name.endswith("_right"):
        label(front, CAMERAS["front"], name, x_px=95)
for name in ("head", "neck", "shoulder_left", "torso", "pelvis", "knee_left", "ankle_left"):
    label(side, CAMERAS["left side"], name, x_px=385)
label(side, CAMERAS["left side"], "foot_left", x_px=120)
plt.show()
