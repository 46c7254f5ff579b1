"""What libraries read from the environment when they are loaded; a user's own values stay."""

from __future__ import annotations

import gc
import os

# threads of NumPy's and SciPy's linear algebra: our matrices are small, and on them threads only wait for one another
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
MOST_PIXELS = 150_000_000  # of a picture; a file may declare any number
# objects made between two of Python's collections: what is imported alone makes 300,000 that stay, and to go through
# them at every 700 takes a twentieth of `airborne track` on the example
_BETWEEN_COLLECTIONS = 20_000


def set_up_libraries() -> None:
    """Set what NumPy, SciPy and OpenCV read, before they are loaded, and how often Python collects garbage."""
    gc.set_threshold(_BETWEEN_COLLECTIONS, *gc.get_threshold()[1:])
    for name, value in {**ONE_THREAD, "OPENCV_IO_MAX_IMAGE_PIXELS": str(MOST_PIXELS)}.items():
        os.environ.setdefault(name, value)
