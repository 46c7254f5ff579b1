"""A study written from a folder of videos: one session file with what trials share, and a short file for each trial."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import tomlkit

from airborne.batch.trials import OWN_COLUMNS
from airborne.errors import AirborneError, VideoError
from airborne.io.names import check_column
from airborne.io.writing import write_text
from airborne.video import VideoSource, inspect

SESSION, TRIALS = "session.toml", "trials"  # the file and the folder that are written
_CAMERA = "camera"  # the word of a pattern that tells the videos of a trial apart
_ALONE = "trial"  # the name of the only trial
_LEGS = "legs"  # the preset of several players
_PERSON = "human18"  # that of a person, of whom stature and mass are to be added
_PRESETS = (_LEGS, _PERSON)
_WORD = re.compile(r"\{(\w+)\}")
_ByTrial = dict[tuple[str, ...], dict[str, Path]]  # the videos of each camera, by the values of the labels


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
    one trial apart; alone, it stands for the videos of one trial. `{trial}`, which in a session is the name of the
    trial's file, may be the only other word. Paths of calibration and body are as seen from
    `folder`, and may hold the words; a calibration that ends in .csv is a table of control points, the body "legs" that
    of players, who are looked for. A camera whose first video is flagged as interlaced gets its `fields`. Files that
    exist are left alone. Raises AirborneError for a pattern that is none, or that fits no video.
    """
    if not videos.is_dir():
        raise AirborneError(f"{videos} is no folder; check the path")
    words = _WORD.findall(pattern)
    if _CAMERA not in words or len(set(words)) < len(words):
        raise AirborneError(
            f"pattern {pattern}: expected {{camera}}, and of several trials other words in braces, each once, such as "
            "{athlete}_{condition}_{number}_{camera}.mp4"
        )
    labels = [word for word in words if word not in (_CAMERA, _ALONE)]
    own = [word for word in words if word in OWN_COLUMNS]
    if own and (labels or own != [_ALONE]):
        raise AirborneError(
            f"pattern {pattern}: {{{own[0]}}} cannot be a label, as a batch's table has a column of that name; call it "
            "otherwise, such as {number}"
        )
    notes: list[str] = []
    found = _match(videos, pattern, notes)
    if not found:
        names = sorted(path.relative_to(videos).as_posix() for path in videos.rglob("*") if path.is_file())
        there = f"it holds {', '.join(names[:3])}{', ...' if len(names) > 3 else ''}" if names else "it is empty"
        raise AirborneError(f"{videos}: no file's path fits {pattern}: {there}; write it as seen from that folder")
    cameras = sorted({camera for by_camera in found.values() for camera in by_camera})
    folder.mkdir(parents=True, exist_ok=True)
    from_session = Path(os.path.relpath(videos.absolute(), folder.absolute())).as_posix()
    session = folder / SESSION
    files: list[Path] = []
    unread: list[str] = []
    tables = [
        {"name": name, "video": f"{from_session}/{pattern}".replace(f"{{{_CAMERA}}}", name)}
        | _fields(found, name, unread)
        for name in cameras
    ]
    if not session.exists():
        interlaced = [table for table in tables if "fields" in table]
        notes += unread
        notes += [
            f"{t['name']}: {SESSION} gives its fields as {t['fields']}, as the file's flags say" for t in interlaced
        ]
    _write_new(session, _session_text(tables, calibration=calibration, body=body))
    for values, by_camera in sorted(found.items()):
        files.append(folder / TRIALS / f"{'_'.join(values) or _ALONE}.toml")
        _write_new(files[-1], _trial_text(dict(zip(labels, values, strict=bool(labels)))))
        missing = [camera for camera in cameras if camera not in by_camera]
        if missing:
            notes.append(f"{files[-1].name}: no video of {', '.join(missing)}; give it its own [[camera]] tables")
    notes += [
        f"{folder / name} is not there yet, but {SESSION} names it: put it there, or give another as --{option}"
        for option, name in (("calibration", calibration), ("body", body))
        if not (_WORD.search(name) or name in _PRESETS or (folder / name).is_file())
    ]
    if body == _PERSON:
        notes.append(f"{SESSION}: add stature_m and mass_kg under [body], or in each trial")
    return NewStudy(session, tuple(files), tuple(notes))


def _match(videos: Path, pattern: str, notes: list[str]) -> _ByTrial:
    """Return the videos of each trial, by the values of its labels and by camera.

    Where a word holds what divides words, names can be read in two ways: each word as short as can be, or as long. The
    one with fewer cameras is taken, and noted.
    """
    paths = {path.relative_to(videos).as_posix(): path for path in sorted(videos.rglob("*")) if path.is_file()}
    short, long = (_read_names(paths, pattern, repeat) for repeat in ("+?", "+"))
    readings = (
        [short] if short == long else sorted((short, long), key=lambda read: len({v[_CAMERA] for v in read.values()}))
    )
    if len(readings) > 1:
        name = next(name for name, values in short.items() if values != long[name])
        first, other = (", ".join(f"{word} {value}" for word, value in read[name].items()) for read in readings)
        notes.append(f"{name} is read as {first}; if it is {other}, let something else stand between the words")
    found: _ByTrial = {}
    for name, values in readings[0].items():
        try:
            for value in values.values():
                check_column(value)
        except ValueError as error:
            raise AirborneError(f"{paths[name]}: {error}") from None
        labels = tuple(value for word, value in values.items() if word != _CAMERA)
        found.setdefault(labels, {})[values[_CAMERA]] = paths[name]
    return found


def _read_names(names: Iterable[str], pattern: str, repeat: str) -> dict[str, dict[str, str]]:
    """Return the words of each name that fits a pattern, of characters repeated as `repeat` says."""
    parts = _WORD.split(pattern)
    form = "".join(f"(?P<{part}>[^/]{repeat})" if k % 2 else re.escape(part) for k, part in enumerate(parts))
    fits = {name: re.fullmatch(form, name) for name in names}
    return {name: fit.groupdict() for name, fit in fits.items() if fit is not None}


def _fields(found: Mapping[tuple[str, ...], Mapping[str, Path]], camera: str, notes: list[str]) -> dict[str, str]:
    """Return the order of a camera's fields that its first video is flagged with; none of a progressive one.

    Of a video that cannot be read, what is wrong with it is noted.
    """
    path = next(by_camera[camera] for by_camera in found.values() if camera in by_camera)
    try:
        order = inspect(VideoSource(camera, path)).flagged_order
    except VideoError as error:
        notes.append(f"{error}; if its pictures hold two fields, add `fields` to its [[camera]] in {SESSION}")
        return {}
    return {} if order == "progressive" else {"fields": order}


def _session_text(cameras: Sequence[Mapping[str, str]], *, calibration: str, body: str) -> str:
    document = tomlkit.document()
    document.add(
        tomlkit.comment("What the trials share; paths are relative to this file, {words} are a trial's labels.")
    )
    tables = tomlkit.aot()
    for camera in cameras:
        tables.append(tomlkit.item(dict(camera)))
    document["camera"] = tables
    document["calibration"] = {"control_points" if calibration.lower().endswith(".csv") else "file": calibration}
    document["body"] = {"preset": body} if body in _PRESETS else {"file": body}
    if body == _LEGS:
        document["start"] = {"find": True}
    return tomlkit.dumps(document)


def _trial_text(labels: Mapping[str, str]) -> str:
    document = tomlkit.document()
    document["session"] = f"../{SESSION}"
    if labels:
        document["labels"] = tomlkit.inline_table()
        document["labels"].update(labels)
    return tomlkit.dumps(document)


def _write_new(path: Path, text: str) -> None:
    """Write a file unless there is one: what was edited since stays."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists():
        write_text(path, text)
