"""Text files of a trial's folder, written whole or not at all; earlier versions are kept, and edits undone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from airborne.errors import TrialError
from airborne.io.folder_lock import refuse_links
from airborne.io.text import read_text
from airborne.io.writing import replace_text
from airborne.studio.folder import is_inside

KEPT = 10  # earlier versions of a file
_LARGEST_BYTES = 50_000_000  # of a file that is edited
FOLDER = ".airborne"  # inside the trial's folder: earlier versions, and what the studio remembers


@dataclass(frozen=True, slots=True)
class Edit:
    """One change of one file."""

    what: str  # it was for, in the user's words
    path: Path
    before: str | None  # None: there was no file
    after: str | None

    @property
    def says(self) -> str:
        """What it was for, and in which file: an undo may reach what another page did."""
        return f"{self.what} ({self.path.name})"


@dataclass(slots=True)
class _Writer:
    """A command of ours that will write a file."""

    what: str  # it is for, in the user's words
    path: Path
    before: str | None  # what the file holds until then
    has_ended: Callable[[], bool]


class Editor:
    """Writes the files of one folder and remembers its edits, to undo and redo them."""

    def __init__(self, folder: Path) -> None:
        """Begin without edits."""
        self.folder = folder
        self._done: list[Edit] = []
        self._undone: list[Edit] = []
        self._writers: list[_Writer] = []

    def write(self, name: str, text: str, what: str) -> None:
        """Write a text file of the folder; raises TrialError for a name that leads out of it."""
        self.settle()
        path = self.folder / name
        self._refuse_link(path)
        edit = Edit(what, path, read_if_there(path), text)
        if edit.before == text:
            return
        self._replace(path, text)
        self._done.append(edit)
        self._undone.clear()

    def expect(self, name: str, what: str, has_ended: Callable[[], bool]) -> None:
        """Keep a file that a command is about to write; once it has ended, what it wrote is an edit like all others."""
        path = self.folder / name
        _keep(self.folder / FOLDER / "versions", path)
        self._writers.append(_Writer(what, path, read_if_there(path), has_ended))

    def settle(self) -> None:
        """Take in what commands that have ended wrote."""
        for writer in [each for each in self._writers if each.has_ended()]:
            self._writers.remove(writer)
            after = read_if_there(writer.path)
            if after != writer.before:
                self._done.append(Edit(writer.what, writer.path, writer.before, after))
                self._undone.clear()

    @property
    def last(self) -> str | None:
        """What `undo` would undo."""
        return self._done[-1].says if self._done else None

    @property
    def next(self) -> str | None:
        """What `redo` would do again."""
        return self._undone[-1].says if self._undone else None

    def undo(self) -> str:
        """Take the last edit back; return what it was."""
        return self._move(self._done, self._undone, "undo")

    def redo(self) -> str:
        """Do the edit again that was undone last; return what it was."""
        return self._move(self._undone, self._done, "redo")

    def _move(self, source: list[Edit], target: list[Edit], verb: str) -> str:
        self.settle()
        if not source:
            raise TrialError(f"there is nothing to {verb}")
        edit = source[-1]
        present, text = (edit.after, edit.before) if verb == "undo" else (edit.before, edit.after)
        if read_if_there(edit.path) != present:
            for edits in (source, target):
                edits[:] = [each for each in edits if each.path != edit.path]
            raise TrialError(
                f"{edit.path.name} was changed elsewhere since, so its edits here can no longer be undone; "
                f"its earlier versions are in {FOLDER}/versions"
            )
        self._replace(edit.path, text)
        target.append(source.pop())
        return edit.says

    def _replace(self, path: Path, text: str | None) -> None:
        self._refuse_link(path)
        _keep(self.folder / FOLDER / "versions", path)
        for writer in self._writers:
            if writer.path == path:
                writer.before = text
        if text is None:
            path.unlink(missing_ok=True)
            return
        replace_text(path, text)

    def _refuse_link(self, path: Path) -> None:
        if not is_inside(self.folder, path) or path.is_symlink():
            raise TrialError(f"{path} leads out of {self.folder}; nothing is written there: remove the link")


def refuse_outer_links(folder: Path) -> None:
    """Raise AirborneError where what the studio keeps in a folder would be written elsewhere through a link."""
    if (folder / FOLDER).is_symlink():
        raise TrialError(f"{folder / FOLDER} is a link, through which nothing is written; remove it")
    refuse_links(folder / FOLDER)


def read_if_there(path: Path) -> str | None:
    """Return a text file of the folder, None where it is not there. Raises TrialError for what is no text."""
    try:
        return read_text(path, _LARGEST_BYTES)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise TrialError(f"{path.name} cannot be read ({error}); correct it, or move it away") from None


def _keep(folder: Path, path: Path) -> None:
    """Keep a file's present version beside its last ones: <name>.1, <name>.2, ..., the newest with the highest."""
    if not path.is_file():
        return
    folder.mkdir(parents=True, exist_ok=True)
    endings = [file.name.removeprefix(f"{path.name}.") for file in folder.glob(f"{path.name}.*")]
    numbers = sorted(int(ending) for ending in endings if ending.isdecimal())
    (folder / f"{path.name}.{numbers[-1] + 1 if numbers else 1}").write_bytes(path.read_bytes())
    for number in numbers[: max(0, len(numbers) + 1 - KEPT)]:
        (folder / f"{path.name}.{number}").unlink()
