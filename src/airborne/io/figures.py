"""Figures written, whatever letters are in them."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from airborne.io.writing import explain_full_disk


def save_png(figure: Any, path: Path, **options: Any) -> None:
    """Write a Matplotlib figure as PNG. It is laid out once: `savefig` would do so before and while it draws."""
    with explain_full_disk(path), any_letters():
        if (layout := figure.get_layout_engine()) is not None:
            layout.execute(figure)
            figure.set_layout_engine(None)
        figure.savefig(path, **options)


@contextmanager
def any_letters() -> Iterator[None]:
    """Draw letters that the font lacks as boxes, without a warning for each: `names_not_drawn` says it once."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph \d+ .*missing from", UserWarning)
        warnings.filterwarnings("ignore", r"Matplotlib currently does not support .* natively", UserWarning)
        yield


def names_not_drawn(names: Sequence[str]) -> list[str]:
    """Return one warning for the names with letters that the figures' font lacks; none where it has them all."""
    from matplotlib.font_manager import FontProperties, findfont, get_font

    known = get_font(findfont(FontProperties(family="DejaVu Sans"))).get_charmap()
    lacking = [name for name in dict.fromkeys(names) if any(ord(letter) not in known for letter in name)]
    if not lacking:
        return []
    listed = ", ".join(lacking[:3]) + (", ..." if len(lacking) > 3 else "")
    return [f"figures and videos show boxes for letters that their font lacks: {listed}; tables have the names whole"]
