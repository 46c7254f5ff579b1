"""Physics, standards and limits that every room shares, with their sources; lengths of a court stand with the court."""

from __future__ import annotations

import numpy as np

# standard gravity, rounded as biomechanics does; from equator to pole it is 9.780 to 9.832 (WGS 84)
GRAVITY_M_S2 = 9.81
FREE_FALL_M_S2 = np.array([0.0, 0.0, -GRAVITY_M_S2])  # acceleration of a falling body; the world's z points up
STANDARD_GRAVITY_M_S2 = 9.80665  # third General Conference on Weights and Measures, 1901; where files state it
SPEED_OF_SOUND_M_S = 343.0  # in dry air of 20 degrees Celsius, from sqrt(1.4 x 287.05 J/(kg K) x 293.15 K)
ALARM_SDS = 3.0  # chosen: from zero, or from what should be: a false alarm in 370, were errors normal
NORMAL_QUANTILE_975 = 1.959963984540054  # of the standard normal distribution: the half width of a 95 % interval
