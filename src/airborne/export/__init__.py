"""Export: in come `Motion`, `Frames` with posed bodies, and a summary; out come files for people.

Overlay videos of a body or of players, a contact sheet of crops through the mask, figures, 3D model files,
summary.json and a self-contained report.
Knows no search and decides nothing.
"""

from airborne.export.error_figures import write_digitised, write_errors
from airborne.export.figures import write_figures, write_pose, write_score
from airborne.export.matching import MatchingPicture
from airborne.export.models import write_model
from airborne.export.overlays import OverlayVideos
from airborne.export.players_overlay import PlayersOverlayVideos
from airborne.export.players_report import players_warnings, write_players_report
from airborne.export.report import write_report
from airborne.export.sheet import ContactSheet
from airborne.export.summary import body_warnings, headline, write_json

__all__ = [
    "ContactSheet",
    "MatchingPicture",
    "OverlayVideos",
    "PlayersOverlayVideos",
    "body_warnings",
    "headline",
    "players_warnings",
    "write_digitised",
    "write_errors",
    "write_figures",
    "write_json",
    "write_model",
    "write_players_report",
    "write_pose",
    "write_report",
    "write_score",
]
