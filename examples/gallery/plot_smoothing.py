"""
Smoothing, and what the cut-off does
====================================

The height of a point that oscillates at 2 Hz, measured at 60 frames a second with 5 mm of noise. A low-pass filter
removes noise, and below some cut-off it removes motion as well; acceleration shows both sooner than position.
"""

import matplotlib.pyplot as plt
import numpy as np

from airborne.motion.smoothing import butterworth_smoother, residual_analysis, smooth_stretches

RATE_HZ, MOTION_HZ, AMPLITUDE_M, NOISE_M = 60.0, 2.0, 0.15, 0.005

rng = np.random.default_rng(3)
time_s = np.arange(0, 2, 1 / RATE_HZ)
omega = 2 * np.pi * MOTION_HZ
true = AMPLITUDE_M * np.sin(omega * time_s)
measured = true + rng.normal(0, NOISE_M, len(time_s))
covariance = np.full((len(time_s), 1, 1), NOISE_M**2)


def smoothed(cutoff_hz):
    """Return position, velocity and acceleration after a zero-lag Butterworth filter."""

    def smooth(times, values, covariances):
        return butterworth_smoother(times, values, covariances, cutoff_hz=cutoff_hz)

    return smooth_stretches(smooth, time_s, measured[:, None], covariance)


# %%
# Winter's residual analysis chooses the cut-off at which as much signal is removed as noise is let through.

analysis = residual_analysis(time_s, measured[:, None, None])
print(f"chosen cut-off: {analysis.chosen_hz:.1f} Hz; noise: {1e3 * analysis.noise:.1f} mm")

figure, rows = plt.subplots(2, 3, figsize=(11, 5.5), sharex=True, layout="constrained")
for column, cutoff_hz in zip(rows.T, (2.0, analysis.chosen_hz, 20.0), strict=True):
    found = smoothed(cutoff_hz).paths
    column[0].plot(time_s, 1e3 * measured, ".", color="#bbbbbb", label="measured")
    column[0].plot(time_s, 1e3 * true, color="black", linewidth=0.8, label="true")
    column[0].plot(time_s, 1e3 * found.value[:, 0], color="#d55e00", label="smoothed")
    column[1].plot(time_s, -(omega**2) * true, color="black", linewidth=0.8)
    column[1].plot(time_s, found.acceleration[:, 0], color="#d55e00")
    column[1].set_ylim(-60, 60)
    column[0].set_title(f"cut-off {cutoff_hz:.1f} Hz", fontsize=10)
    column[1].set_xlabel("time [s]")
rows[0, 0].set_ylabel("height [mm]")
rows[1, 0].set_ylabel("acceleration [m/s²]")
rows[0, 0].legend(fontsize=8, loc="lower left")
plt.show()

# %%
# The residual over the cut-off: noise alone falls on the dashed line. Where that line, carried on to 0 Hz, gives the
# size of the noise, the residual curve gives the cut-off.

figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
start, slope = analysis.line
axes.plot(analysis.cutoff_hz, 1e3 * analysis.residual, label="residual")
axes.plot(analysis.cutoff_hz, 1e3 * np.maximum(start + slope * analysis.cutoff_hz, 0), "k--", label="noise alone")
axes.axhline(1e3 * start, color="black", linewidth=0.6)
axes.axvline(analysis.chosen_hz, color="#d55e00", label=f"chosen: {analysis.chosen_hz:.1f} Hz")
axes.set(xlabel="cut-off [Hz]", ylabel="RMS residual [mm]", xlim=(0, 27), ylim=(0, 15))
axes.legend()
plt.show()
