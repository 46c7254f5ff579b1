"""
Four heights of one jump
========================

A blocker of a synthetic scene, whose true joints are known. Noise of 10 mm stands in for tracking errors; the jump is
then measured as in a real run.
"""

import matplotlib.pyplot as plt
import numpy as np

from airborne.motion import PlayersMotion, measure_jumps
from airborne.synthetic import block_scene, jump_truth, true_joints

JOINTS = tuple(f"{joint}_{side}" for joint in ("hip", "knee", "ankle", "foot") for side in ("left", "right"))
NOISE_M = 0.010

scene = block_scene(4)
player = scene.blockers[0]
true = true_joints(player, scene.times_s)
true_points = np.stack([true[name] for name in JOINTS], axis=1)
rng = np.random.default_rng(0)
n = len(scene.times_s)

# %%
# Joints from any tracker can be measured: positions, their covariances and a status at every time.

motion = PlayersMotion(
    index=np.arange(n),
    time_s=scene.times_s,
    rate=float(scene.rate),
    players=(player.name,),
    joints=JOINTS,
    points=(true_points + rng.normal(0, NOISE_M, true_points.shape))[:, None],
    covariance=np.tile(NOISE_M**2 * np.eye(3), (n, 1, len(JOINTS), 1, 1)),
    joint_status=np.full((n, 1, len(JOINTS)), "tracked"),
    score=np.zeros((n, 1)),
    n_views=np.full((n, 1), 3),
)
[jump] = measure_jumps(motion)
print(f"take-off at {jump.takeoff_s.value:.3f} s, landing at {jump.landing_s.value:.3f} s")

# %%
# The four heights answer different questions: the first two count the heels' rise before take-off, the last two do not.
# Bars are 95 % intervals, crosses the truth where a definition has one.

figure, (path, bars) = plt.subplots(1, 2, figsize=(11, 4), width_ratios=(3, 2), layout="constrained")
for joint, colour in (("hip", "#0072b2"), ("ankle", "#d55e00")):
    columns = [JOINTS.index(f"{joint}_left"), JOINTS.index(f"{joint}_right")]
    height = motion.points[:, 0, columns, 2].mean(axis=1)
    path.plot(motion.time_s, height, ".-", color=colour, label=f"{joint} midpoint")
for event, name in ((jump.takeoff_s, "take-off"), (jump.landing_s, "landing")):
    path.axvspan(event.low, event.high, color="#999999", alpha=0.4)
    path.axvline(event.value, color="black", linewidth=0.8)
    path.text(event.value, 0.02, f" {name}", fontsize=9)
path.set(xlabel="time [s]", ylabel="height [m]", ylim=(0, 1.6))
path.legend(loc="upper left", frameon=False)

facts = jump_truth(player, float(scene.rate))
heights = {
    "foot height": (jump.foot_height_m, None),
    "hip height": (jump.hip_height_m, facts["hip_rise_over_standing_m"]),
    "flight time": (jump.flight_time_height_m, 9.81 * facts["flight_s"] ** 2 / 8),
    "take-off speed": (jump.takeoff_speed_height_m, facts["com_rise_from_takeoff_m"]),
}
for row, (name, (found, truth)) in enumerate(heights.items()):
    print(f"{name}: {found.value:.3f} m [{found.low:.3f}, {found.high:.3f}]")
    interval = [[found.value - found.low], [found.high - found.value]]
    bars.errorbar(found.value, row, xerr=interval, fmt="o", color="#0072b2")
    if truth is not None:
        bars.plot(truth, row, "x", color="black")
bars.set_yticks(range(len(heights)), heights)
bars.invert_yaxis()
bars.set_xlabel("height [m]")
plt.show()
