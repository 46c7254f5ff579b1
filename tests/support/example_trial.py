"""Changed copies of the bundled example's trial file."""

from pathlib import Path

SHORT = 3  # fields that are tracked where the length does not matter
LONG = 12
CALIBRATED = 'file = "calib_true.toml"'


def edit_trial(path: Path, name: str, *replacements: tuple[str, str]) -> Path:
    """Write a changed copy of a text file beside it."""
    text = path.read_text(encoding="utf-8")
    for old, new in replacements:
        assert old in text, f"{path.name} holds no {old!r}"
        text = text.replace(old, new, 1)
    path.with_name(name).write_text(text, encoding="utf-8")
    return path.with_name(name)
