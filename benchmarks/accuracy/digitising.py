"""Digitise every field of the thrown cross in the studio's page, in a real browser, and compare with its truth there.

    python benchmarks/accuracy/digitising.py [--rows]

The ends of both bars are clicked in all three cameras at the truth's places, 1.2 px off (one sd, right and down), and
compared by the page's own button with a run that holds the truth: the floors are what the paper's own digitising has.
`--rows` appends to benchmarks/results/digitising.csv.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rows import append

from tests.support.browser import open_page
from tests.support.digitised_cross import CLICK_SD_PX, MOST_DEG, MOST_MM, TRUTH, compare, digitise, prepare_cross
from tests.support.studio import open_studio


def main() -> None:
    """Digitise, compare and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", action="store_true", help="append to benchmarks/results/digitising.csv")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "cross"
        rig = prepare_cross(folder)
        with open_studio(folder) as address, open_page(address.replace("/?", "/digitise?")) as page:
            digitise(page, rig, TRUTH.index.tolist())
            found_mm, found_deg = compare(page, folder)
    print(f"position {found_mm:.2f} mm, orientation {found_deg:.2f}°")
    if given.rows:
        common = {"data": f"thrown_cross, every field, {CLICK_SD_PX} px", "method": "studio", "n": len(TRUTH.index)}
        position = {"metric": "digitised minus truth, position RMS", "unit": "mm", "value": found_mm, "floor": MOST_MM}
        turn = {
            "metric": "digitised minus truth, orientation RMS",
            "unit": "deg",
            "value": found_deg,
            "floor": MOST_DEG,
        }
        append("digitising", [{**common, **position}, {**common, **turn}])


if __name__ == "__main__":
    main()
