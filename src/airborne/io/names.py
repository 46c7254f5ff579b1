"""What may be the name of a camera, player or part, what may be a path in a file, and files named after names."""

from __future__ import annotations

import hashlib
from os import PathLike, fspath
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator

from airborne.errors import AirborneError

_LONGEST_NAME = 80  # characters
_LONGEST_PART, _LONGEST_PATH = 255, 1000  # bytes of a file name, and of a path below a folder: of file systems
_LONGEST_STEM = 160  # bytes of a name in a file's name, which also has a word before it and an ending


def check_name(name: str) -> str:
    """Return a name; raises ValueError where it could be more than one, or is none."""
    if not 1 <= len(name) <= _LONGEST_NAME:
        raise ValueError(f"a name has 1 to {_LONGEST_NAME} characters; rename {_quote(name)}")
    if set(name) & set("/\\") or name.startswith(".") or not name.isprintable() or name.isspace():
        raise ValueError(
            f"a name must not hold a slash or a control character, nor begin with a dot; rename {_quote(name)}"
        )
    return name


def check_column(name: str) -> str:
    """Return a name that can stand in a table; raises ValueError as `check_name` does, and for a comma or quote."""
    if set(check_name(name)) & set(',"'):
        raise ValueError(f"must not contain a comma or a quote; rename {_quote(name)}")
    return name


def check_path(path: str) -> str:
    """Return a path as a file gives it; raises ValueError where no file can have it."""
    if not path.strip():
        raise ValueError("a file's name is empty; give the file's path")
    if "\0" in path or not path.isprintable():
        raise ValueError(f"a path holds no control character; rename {_quote(path)}")
    parts = path.encode(errors="replace").split(b"/")
    if max(map(len, parts)) > _LONGEST_PART or len(b"/".join(parts)) > _LONGEST_PATH:
        raise ValueError(
            f"a file's name has at most {_LONGEST_PART} bytes and a path {_LONGEST_PATH}; shorten {_quote(path)}"
        )
    return path


def to_path(value: Any) -> Path:
    """Return text or a path object as a Path; raises AirborneError for anything else."""
    if not isinstance(value, str | PathLike):
        raise AirborneError(f"expected a path, as text or a Path (found {type(value).__name__} {str(value)[:60]})")
    return Path(value)


def _path_text(path: Any) -> Any:
    """Return a path object as text, anything else as it is."""
    return fspath(path) if isinstance(path, PathLike) else path


def file_stem(name: str) -> str:
    """Return a name as part of a file's name: as it is, but a long one of many bytes cut, with a digest to tell it."""
    data = check_name(name).encode()
    if len(data) <= _LONGEST_STEM:
        return name
    return f"{data[: _LONGEST_STEM - 9].decode(errors='ignore')}-{hashlib.sha256(data).hexdigest()[:8]}"


def _quote(text: str) -> str:
    return repr(text if len(text) <= 40 else f"{text[:30]}...")


Name = Annotated[str, AfterValidator(check_name)]
ColumnName = Annotated[str, AfterValidator(check_column)]
CheckedPath = Annotated[str, BeforeValidator(_path_text), AfterValidator(check_path)]  # given as text, or as a Path
