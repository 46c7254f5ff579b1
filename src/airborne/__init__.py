"""Airborne measures bodies in flight from ordinary multi-camera colour video."""

import os
from pathlib import Path

__version__ = "0.1.0"

if "NUMBA_CACHE_DIR" not in os.environ and not os.access(Path(__file__).parent, os.W_OK):
    import tempfile

    # installed where the user may not write: compiled kernels are kept in a folder of their own
    os.environ["NUMBA_CACHE_DIR"] = str(
        Path(tempfile.gettempdir()) / f"airborne-kernels-{os.environ.get('USER', 'user')}"
    )
