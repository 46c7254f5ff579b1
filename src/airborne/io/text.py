"""Text files, TOML, JSON, YAML and CSV, read with limits on size and nesting; knows no noun of the field."""

from __future__ import annotations

import codecs
import csv
import errno
import json
import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

import tomlkit
import yaml
from tomlkit.exceptions import TOMLKitError

_LARGEST_TOML_BYTES = 5_000_000  # larger files are refused
_LARGEST_EDITABLE = 100_000  # characters, likewise: they are parsed slowly
_LARGEST_JSON_BYTES = 50_000_000  # likewise
_LARGEST_CSV_BYTES = 50_000_000  # likewise
_MOST_BRACKETS = 200  # in a flat YAML file
_LARGEST_YAML_BYTES = 100_000  # likewise: it is parsed slowly

_CONTROLS = re.compile(rb"[\x00-\x08\x0e-\x1f]")  # which no text has, whatever its letters' encoding
_SEPARATORS = {";": "semicolons", "\t": "tabs"}
_DECIMAL_COMMA = re.compile(r"=\s*[-+]?\d+,\d|\d,0\d")
_DEEP_KEY = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){64}""")  # a.a.a...: takes quadratic time


def read_bytes(path: Path, most_bytes: int) -> bytes:
    """Read a file. Raises OSError, also for a pipe or a device, or ValueError where it is too large."""
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise OSError(errno.EISDIR, "it is a folder", str(path))
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "it is not a file", str(path))
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size  # of this very file: another may have taken its place since
        if size > most_bytes:
            raise ValueError(f"larger than {most_bytes / 1e6:g} MB")
        return file.read(size)  # of the system's own files, some of which never end, nothing: their size is 0


def read_text(path: Path, most_bytes: int) -> str:
    """Read a text file. Raises OSError, or ValueError where it is too large or no text."""
    data = read_bytes(path, most_bytes)
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError:
        is_other = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or not _CONTROLS.search(data)
        raise ValueError(f"it is not a text file{' in UTF-8; save it as UTF-8' if is_other else ''}") from None


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file. Raises OSError, or TOMLDecodeError for anything else, also if too large or nested too deep."""
    try:
        return parse_toml(read_text(path, _LARGEST_TOML_BYTES))
    except tomllib.TOMLDecodeError:
        raise
    except ValueError as error:
        raise tomllib.TOMLDecodeError(str(error)) from None


def read_flat_yaml(path: Path) -> list[tuple[str, str]]:
    """Read a YAML file of lines `key: value`: keys and values as text, in order; none where it has another form.

    Raises OSError, or ValueError for anything else: lists and tables in it, tags, anchors.
    """
    try:
        document = yaml.compose(_plain_yaml(read_text(path, _LARGEST_YAML_BYTES)), yaml.BaseLoader)
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())[:160]) from None
    except RecursionError:
        raise ValueError("nested too deep") from None
    if not isinstance(document, yaml.MappingNode):
        return []
    for node in (node for pair in document.value for node in pair):
        if not isinstance(node, yaml.ScalarNode):
            raise ValueError(f"line {node.start_mark.line + 1}: expected one value")
    return [(key.value, value.value) for key, value in document.value]


def _plain_yaml(text: str) -> str:
    """Return a text without anchors, aliases and tags, which could make a short text a large or a strange one."""
    n_open = 0
    for token in yaml.scan(text, yaml.BaseLoader):
        n_open += isinstance(token, yaml.FlowSequenceStartToken | yaml.FlowMappingStartToken)
        if n_open > _MOST_BRACKETS:
            raise ValueError("it holds lists and tables, expected lines such as 'key: 0.1'")
        if isinstance(token, yaml.AnchorToken | yaml.AliasToken | yaml.TagToken):
            kind = type(token).__name__.removesuffix("Token").lower()
            raise ValueError(f"line {token.start_mark.line + 1}: no {kind} is read; write the value itself")
    return text


def list_keys(document: dict[str, Any]) -> str:
    """Return the top-level keys of a document, for an error message."""
    return ", ".join(key[:60] for key in [*document][:6]) or "nothing"


def read_json(path: Path) -> Any:
    """Read a JSON file. Raises OSError, or ValueError for anything else, also if too large or nested too deep."""
    text = read_text(path, _LARGEST_JSON_BYTES)
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deep") from None


def read_csv(path: Path, expected: str, error: type[Exception]) -> list[tuple[int, list[str]]]:
    """Read the non-empty rows of a comma-separated table: the line number, from 1, and the stripped cells.

    Columns at the end that hold nothing in any row are left out, as a spreadsheet ends its lines in commas.
    Raises `error`, saying in one line what was found and what is `expected`.
    """
    try:
        text = read_text(path, _LARGEST_CSV_BYTES)
    except OSError as failure:
        raise error(f"{path} cannot be read ({failure.strerror}); {expected}") from None
    except ValueError as failure:
        raise error(f"{path}: {failure}; {expected}") from None
    if "\0" in text:
        raise error(f"{path}: it is not a text file; {expected}")
    reader = csv.reader(text.splitlines())
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as failure:
        raise error(f"{path}, row {reader.line_num}: not a table with commas ({failure}); {expected}") from None
    rows = [(line, row) for line, row in rows if any(row)]
    n_columns = max((i for _, row in rows for i, cell in enumerate(row, start=1) if cell), default=0)
    rows = [(line, row[:n_columns]) for line, row in rows]
    header = rows[0][1] if rows else []
    for separator, name in _SEPARATORS.items():
        if len(header) == 1 and separator in header[0]:
            raise error(f"{path}: columns are separated by {name}; save it with commas and decimal points; {expected}")
    return rows


def parse_editable_toml(text: str) -> tomlkit.TOMLDocument:
    """Parse TOML that keeps its comments and order. Raises ValueError for anything else, also if too large."""
    if len(text) > _LARGEST_EDITABLE:
        raise ValueError(f"larger than {_LARGEST_EDITABLE / 1e3:g} kB")
    try:
        return tomlkit.parse(text)
    except RecursionError:
        raise ValueError("nested too deep") from None
    except TOMLKitError as error:
        raise ValueError(" ".join(str(error).split())[:160]) from None


def parse_toml(text: str) -> dict[str, Any]:
    """Parse TOML. Raises TOMLDecodeError, with the line, for whatever the parser stumbles over."""
    if _DEEP_KEY.search(text):
        raise tomllib.TOMLDecodeError("nested too deep")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        lines = text.splitlines()
        reason = str(error).replace("at end of document", f"at line {len(lines)}, the end of the file")
        line = re.search(r"at line (\d+)", reason)
        if line is not None and 0 < int(line[1]) <= len(lines) and _DECIMAL_COMMA.search(lines[int(line[1]) - 1]):
            reason += ", where a comma stands for a decimal point"
        raise tomllib.TOMLDecodeError(reason) from None
    except (RecursionError, ValueError, OverflowError) as error:
        reason = "nested too deep" if isinstance(error, RecursionError) else str(error)[:120]
        raise tomllib.TOMLDecodeError(reason) from None
