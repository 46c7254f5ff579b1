"""Text files read with care: none larger than it may be, none nested too deep. Knows no noun."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

LARGEST_TOML_BYTES = 5_000_000
LARGEST_JSON_BYTES = 50_000_000

_DEEP_KEY = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){64}""")  # a.a.a...: takes time in squares


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file. Raises OSError, UnicodeDecodeError, or TOMLDecodeError, also where it is large or nested."""
    if path.stat().st_size > LARGEST_TOML_BYTES:
        raise tomllib.TOMLDecodeError(f"larger than {LARGEST_TOML_BYTES // 1_000_000} MB")
    return parsed_toml(path.read_text(encoding="utf-8-sig"))


def read_json(path: Path) -> Any:
    """Read a JSON file. Raises OSError, or ValueError for anything else, also where it is large or nested too deep."""
    if path.stat().st_size > LARGEST_JSON_BYTES:
        raise ValueError(f"larger than {LARGEST_JSON_BYTES // 1_000_000} MB")
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except RecursionError:
        raise ValueError("nested too deep") from None


def parsed_toml(text: str) -> dict[str, Any]:
    """Parse TOML. Raises TOMLDecodeError, in place of whatever else the parser meets in odd files."""
    if _DEEP_KEY.search(text):
        raise tomllib.TOMLDecodeError("nested too deep")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except (RecursionError, ValueError, OverflowError) as error:
        reason = "nested too deep" if isinstance(error, RecursionError) else str(error)[:120]
        raise tomllib.TOMLDecodeError(reason) from None
