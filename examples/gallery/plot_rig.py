"""
Cameras around a throw
======================

The three cameras of the bundled example, calibrated from its control points, and the path of the cross. A camera is
drawn as the pyramid of what it sees, two metres deep.
"""

import matplotlib.pyplot as plt
import numpy as np

from airborne.calibration import calibrate, read_control_points
from airborne.evaluation import read_truth
from airborne.trial.examples import example_trial

folder = example_trial("thrown_cross").parent
points = read_control_points(folder / "control_points.csv")
calibration = calibrate(points, {name: (768, 576) for name in points.cameras})
truth = read_truth(folder / "truth.csv")

# %%
# Each camera knows its place in the world, and what its calibration is worth: the error of points that were left out of
# the fit.

for camera, fit in zip(calibration.rig, calibration.fits, strict=True):
    print(f"{camera.name}: at {np.round(camera.centre, 2)} m, held-out error {fit.held_out_rms_px[fit.model]:.2f} px")


def pyramid(camera, depth_m):
    """Return the corners of the picture at a depth: (4, 3) [m], world."""
    width, height = camera.size
    corners = np.array([[0, 0, 1], [width, 0, 1], [width, height, 1], [0, height, 1]], float)
    return camera.camera_from_world.inv().apply(depth_m * corners @ np.linalg.inv(camera.K).T)


figure = plt.figure(figsize=(8, 6))
axes = figure.add_subplot(projection="3d")
for camera, colour in zip(calibration.rig, ("#0072b2", "#d55e00", "#009e73"), strict=True):
    corners = pyramid(camera, 2.0)
    for corner in corners:
        axes.plot(*np.stack([camera.centre, corner]).T, color=colour, linewidth=0.8)
    axes.plot(*np.vstack([corners, corners[:1]]).T, color=colour)
    axes.text(*camera.centre, f"  {camera.name}", color=colour)
axes.scatter(*points.world.T, s=8, color="#888888", label="control points")
axes.plot(*truth.position.T, color="black", linewidth=2, label="path of the cross")
axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
axes.set_aspect("equal")
axes.view_init(elev=22, azim=-50)
axes.legend(loc="upper left", frameon=False)
figure.tight_layout()
plt.show()
