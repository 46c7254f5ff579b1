"""A study written from a folder of videos: one session file with what trials share, and a short file for each trial."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import tomlkit

from airborne.errors import AirborneError
from airborne.io.names import check_column
from airborne.io.writing import write_text

SESSION, TRIALS = "session.toml", "trials"  # the file and the folder that are written
_CAMERA = "camera"  # the word of a pattern that tells the videos of a trial apart
_WORD = re.compile(r"\{(\w+)\}")


@dataclass(frozen=True, slots=True)
class NewStudy:
    """What was written: the session's file, the trials' files, and what is incomplete, a line each."""

    session: Path
    trials: tuple[Path, ...]
    notes: tuple[str, ...]


def write_study(
    videos: Path, pattern: str, folder: Path, *, calibration: str = "calib.toml", body: str = "body.toml"
) -> NewStudy:
    """Write session.toml and trials/<name>.toml into a folder, for the videos whose paths below `videos` fit a pattern.

    Words in braces, as in "{athlete}_{condition}_{number}_{camera}.mp4", become labels; `{camera}` tells the videos of
    one trial apart. Paths of calibration and body are as seen from `folder`, and may hold the words. Files that exist
    are left alone. Raises AirborneError for a pattern that is none, or that fits no video.
    """
    words = _WORD.findall(pattern)
    if _CAMERA not in words or len(words) < 2 or len(set(words)) < len(words):
        raise AirborneError(
            f"pattern {pattern}: expected {{camera}} and other words in braces, each once, such as "
            "{athlete}_{condition}_{number}_{camera}.mp4"
        )
    found = _match(videos, pattern)
    if not found:
        raise AirborneError(f"{videos}: no video's path fits {pattern}; write it as seen from that folder")
    cameras = sorted({camera for by_camera in found.values() for camera in by_camera})
    labels = [word for word in words if word != _CAMERA]
    folder.mkdir(parents=True, exist_ok=True)
    from_session = Path(os.path.relpath(videos.absolute(), folder.absolute())).as_posix()
    session = folder / SESSION
    _write_new(session, _session_text(cameras, f"{from_session}/{pattern}", calibration=calibration, body=body))
    files, notes = [], []
    for values, by_camera in sorted(found.items()):
        files.append(folder / TRIALS / f"{'_'.join(values)}.toml")
        _write_new(files[-1], _trial_text(dict(zip(labels, values, strict=True))))
        missing = [camera for camera in cameras if camera not in by_camera]
        if missing:
            notes.append(f"{files[-1].name}: no video of {', '.join(missing)}; give it its own [[camera]] tables")
    return NewStudy(session, tuple(files), tuple(notes))


def _match(videos: Path, pattern: str) -> dict[tuple[str, ...], dict[str, Path]]:
    """Return the videos of each trial, by the values of its labels and by camera."""
    parts = _WORD.split(pattern)
    form = "".join(f"(?P<{part}>[^/]+?)" if k % 2 else re.escape(part) for k, part in enumerate(parts))
    found: dict[tuple[str, ...], dict[str, Path]] = {}
    for path in sorted(each for each in videos.rglob("*") if each.is_file()):
        fits = re.fullmatch(form, path.relative_to(videos).as_posix())
        if fits is None:
            continue
        values = fits.groupdict()
        camera = values.pop(_CAMERA)
        try:
            for value in (camera, *values.values()):
                check_column(value)
        except ValueError as error:
            raise AirborneError(f"{path}: {error}") from None
        found.setdefault(tuple(values.values()), {})[camera] = path
    return found


def _session_text(cameras: Sequence[str], video: str, *, calibration: str, body: str) -> str:
    document = tomlkit.document()
    document.add(
        tomlkit.comment("What the trials share; paths are relative to this file, {words} are a trial's labels.")
    )
    tables = tomlkit.aot()
    for name in cameras:
        tables.append(tomlkit.item({"name": name, "video": video.replace(f"{{{_CAMERA}}}", name)}))
    document["camera"] = tables
    document["calibration"] = {"file": calibration}
    document["body"] = {"file": body}
    return tomlkit.dumps(document)


def _trial_text(labels: Mapping[str, str]) -> str:
    inline = tomlkit.inline_table()
    inline.update(labels)
    document = tomlkit.document()
    document["session"] = f"../{SESSION}"
    document["labels"] = inline
    return tomlkit.dumps(document)


def _write_new(path: Path, text: str) -> None:
    """Write a file unless there is one: what was edited since stays."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists():
        write_text(path, text)
