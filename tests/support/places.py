"""Where the project, its example and its pages lie."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
THROWN_CROSS = ROOT / "examples" / "thrown_cross"
