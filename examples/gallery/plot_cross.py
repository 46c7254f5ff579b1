"""
A pose in three cameras
=======================

One field of the bundled example, enlarged, with the outline of the cross in its true pose.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import Pose, surface_arrays
from airborne.body.files import read_body
from airborne.cameras import read_rig
from airborne.evaluation import read_truth
from airborne.rendering import FLAT, render
from airborne.trial.examples import example_trial
from airborne.video import VideoSource, open_recording

FIELD = 16

folder = example_trial("thrown_cross").parent
rig = read_rig(folder / "calib_true.toml")
body = read_body(folder / "cross.toml")
truth = read_truth(folder / "truth.csv")

# %%
# A pose is where the root is and how it is turned: world from root. A body with a pose can be seen.

turn = Rotation.from_matrix(truth.R[FIELD])
posed = body.with_pose(Pose(world_from_root=RigidTransform.from_components(truth.position[FIELD], turn)))

# %%
# The videos are interlaced: a field has every second row of the picture, and its own camera with half the height.

sources = [VideoSource(name, folder / f"{name}.mp4", fields="top-first") for name in rig.names]
frames = next(iter(open_recording(sources, rig, start=FIELD, stop=FIELD + 1)))

figure, panels = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
for axes, view, name in zip(panels, frames.views, rig.names, strict=True):
    mask = render(surface_arrays(body), posed, view.camera, FLAT).mask
    axes.imshow(view.rgb, aspect=2)
    axes.contour(mask, [0.5], colors="#00e676", linewidths=1.5)
    rows, columns = np.nonzero(mask)
    axes.set_xlim(columns.mean() - 150, columns.mean() + 150)
    axes.set_ylim(rows.mean() + 65, rows.mean() - 65)
    axes.set_title(f"{name}, {float(frames.time_s):.2f} s", fontsize=10)
    axes.set_axis_off()
plt.show()
