"""Export: in come `Motion`, `Frames` with posed bodies, and a summary; out come files for people.

Overlay videos of a body or of players, a contact sheet of crops through the mask, figures, 3D model files,
summary.json and a self-contained report.
What draws is imported from its own file, and only where something is drawn: a run without pictures loads no Matplotlib.
Knows no search and decides nothing.
"""

from airborne.export.summary import body_warnings, describe_doubts, headline, write_json

__all__ = ["body_warnings", "describe_doubts", "headline", "write_json"]
