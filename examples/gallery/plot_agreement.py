"""
Agreement of two measurements
=============================

The bundled example has the true poses of the cross and points that were clicked in its videos. How well do poses from
clicks agree with the truth? A Bland–Altman plot shows the differences against the means, with the bias, the limits
between which 95 % of differences are expected, and the confidence intervals of all three.
"""

import matplotlib.pyplot as plt
import numpy as np

from airborne.body.files import read_body
from airborne.cameras import read_rig
from airborne.evaluation import Series, analyse_agreement, fit_digitised_poses, read_digitised, read_truth
from airborne.trial.examples import example_trial

folder = example_trial("thrown_cross").parent
rig = read_rig(folder / "calib_true.toml")
clicked = fit_digitised_poses(read_digitised(folder / "digitised.csv", rig), rig, read_body(folder / "cross.toml"))
truth = read_truth(folder / "truth.csv")

figure, panels = plt.subplots(1, 3, figsize=(12, 3.8), sharey=True, layout="constrained")
for axis, (axes, name) in enumerate(zip(panels, "xyz", strict=True)):
    values = 1e3 * np.stack([clicked.position[:, axis], truth.position[:, axis]], axis=1)
    found = analyse_agreement(Series(name, "mm", values, np.full(len(values), "cross")))
    limits = f"{found.lower_limit.value:.1f} to {found.upper_limit.value:.1f} mm"
    print(f"{name}: bias {found.bias.value:+.2f} mm, limits of agreement {limits}")
    axes.plot(values.mean(axis=1), values[:, 0] - values[:, 1], ".", color="#0072b2")
    for line, style in ((found.bias, "-"), (found.lower_limit, "--"), (found.upper_limit, "--")):
        axes.axhline(line.value, color="black", linestyle=style, linewidth=1)
        axes.axhspan(line.low, line.high, color="black", alpha=0.12, linewidth=0)
    axes.set_title(name, fontsize=10)
    axes.set_xlabel("mean of both [mm]")
panels[0].set_ylabel("clicked minus true [mm]")
plt.show()
