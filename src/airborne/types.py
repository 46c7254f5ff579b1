"""Types that every room shares; shapes, units and frames stand beside each use."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]  # images, maps and tables
Floats = NDArray[np.floating]  # of either precision
Ints = NDArray[np.integer]
Mask = NDArray[np.bool_]
Image = NDArray[np.uint8]  # (h, w, 3) sRGB, or (h, w) grey
Size = tuple[int, int]  # (width, height) [px]
Triple = tuple[float, float, float]
Progress = Callable[[int, int | None], None]  # steps done, steps expected or None where nobody knows
StageProgress = Callable[[str, int, int | None], None]  # the stage, then as Progress
