"""What libraries read from the environment when they are loaded; a user's own values stay."""

from __future__ import annotations

import os

# threads of NumPy's and SciPy's linear algebra: our matrices are small, and on them threads only wait for one another
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
MOST_PIXELS = 150_000_000  # of a picture; a file may declare any number


def set_up_libraries() -> None:
    """Set what NumPy, SciPy and OpenCV read, before they are loaded."""
    for name, value in {**ONE_THREAD, "OPENCV_IO_MAX_IMAGE_PIXELS": str(MOST_PIXELS)}.items():
        os.environ.setdefault(name, value)
