"""Files by their content: digests, and which of several are the same."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file; of a folder that of its JSON files."""
    if path.is_dir():
        digest = hashlib.sha256()
        for file in sorted(path.rglob("*.json")):
            digest.update(f"{file.relative_to(path).as_posix()} {file_digest(file)}\n".encode())
        return digest.hexdigest()
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def find_copies(paths: Sequence[Path]) -> list[list[Path]]:
    """Return the groups of files with the same content; only files of the same length are read."""
    by_length: dict[int, list[Path]] = {}
    for path in paths:
        by_length.setdefault(path.stat().st_size, []).append(path)
    by_content: dict[str, list[Path]] = {}
    for path in (path for group in by_length.values() if len(group) > 1 for path in group):
        by_content.setdefault(file_digest(path), []).append(path)
    return [group for group in by_content.values() if len(group) > 1]
