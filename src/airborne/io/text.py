"""Text files, read with limits on size and nesting; knows no noun of the field."""

from __future__ import annotations

import csv
import json
import re
import tomllib
from pathlib import Path
from typing import Any

_LARGEST_TOML_BYTES = 5_000_000  # larger files are refused
_LARGEST_JSON_BYTES = 50_000_000  # likewise
_LARGEST_CSV_BYTES = 50_000_000  # likewise

_DEEP_KEY = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){64}""")  # a.a.a...: takes quadratic time


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file. Raises OSError, or TOMLDecodeError for anything else, also if too large or nested too deep."""
    if path.stat().st_size > _LARGEST_TOML_BYTES:
        raise tomllib.TOMLDecodeError(f"larger than {_LARGEST_TOML_BYTES // 1_000_000} MB")
    try:
        return parse_toml(path.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError:
        raise tomllib.TOMLDecodeError("it is not a text file") from None


def list_keys(document: dict[str, Any]) -> str:
    """Return the top-level keys of a document, for an error message."""
    return ", ".join(key[:60] for key in [*document][:6]) or "nothing"


def read_json(path: Path) -> Any:
    """Read a JSON file. Raises OSError, or ValueError for anything else, also if too large or nested too deep."""
    if path.stat().st_size > _LARGEST_JSON_BYTES:
        raise ValueError(f"larger than {_LARGEST_JSON_BYTES // 1_000_000} MB")
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except RecursionError:
        raise ValueError("nested too deep") from None


def read_csv(path: Path, expected: str, error: type[Exception]) -> list[tuple[int, list[str]]]:
    """Read the non-empty rows of a comma-separated table: the line number, from 1, and the stripped cells.

    Raises `error`, saying in one line what was found and what is `expected`.
    """
    try:
        if path.stat().st_size > _LARGEST_CSV_BYTES:
            raise error(f"{path} is larger than {_LARGEST_CSV_BYTES // 1_000_000} MB; {expected}")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as failure:
        raise error(f"{path} cannot be read ({failure.strerror}); {expected}") from None
    except UnicodeDecodeError:
        raise error(f"{path} is not a text file; {expected}") from None
    if "\0" in text:
        raise error(f"{path} is not a text file; {expected}")
    reader = csv.reader(text.splitlines())
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as failure:
        raise error(f"{path}, row {reader.line_num}: not a table with commas ({failure}); {expected}") from None
    return [(line, row) for line, row in rows if any(row)]


def parse_toml(text: str) -> dict[str, Any]:
    """Parse TOML. Raises TOMLDecodeError for whatever the parser stumbles over."""
    if _DEEP_KEY.search(text):
        raise tomllib.TOMLDecodeError("nested too deep")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except (RecursionError, ValueError, OverflowError) as error:
        reason = "nested too deep" if isinstance(error, RecursionError) else str(error)[:120]
        raise tomllib.TOMLDecodeError(reason) from None
