"""Figures that are drawn without being laid out."""

import pytest


def leave_figures_plain(patch: pytest.MonkeyPatch) -> None:
    """Draw figures without laying them out, which takes half of their time."""
    from matplotlib.figure import Figure

    patch.setattr(Figure, "get_layout_engine", lambda figure: None)
