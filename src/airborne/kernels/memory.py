"""Memory that a frame's arrays leave stays with the process, for the next frame's.

The system clears every page that it hands out, at a fault of its own each: of a person's frame, 18 MB, that was a fifth
of the time. glibc gives the top of its heap back where twice as much lies free as the largest block that was ever
freed, and takes blocks larger than that from the system one by one: mallopt(3), M_MMAP_THRESHOLD and M_TRIM_THRESHOLD.
Other allocators do not mind.
"""

from __future__ import annotations

import numpy as np

_LARGEST_BYTES = (32 << 20) - (1 << 16)  # glibc raises its thresholds for blocks of up to 32 MB


def keep_freed_memory() -> None:
    """Free a block as large as counts, of which no page was touched: from then on up to 64 MB are kept."""
    np.empty(_LARGEST_BYTES, np.uint8)
