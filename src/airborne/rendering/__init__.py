"""Rendering: in come a body's geometry, its poses and cameras, out come scores, maps and images; knows no search."""

from airborne.rendering.drawing import Rendering, render
from airborne.rendering.evidence import EvidenceMaps, evidence_maps, mask_evidence, mask_out_surface
from airborne.rendering.lights import FLAT, Lamp, Lights
from airborne.rendering.pictures import mask_picture, match_picture, model_picture, through_mask
from airborne.rendering.scores import RULES, ScoreRule, colour_sums, count_missed_pixels, score, scores_from_sums
from airborne.rendering.targets import Targets, pack_targets

__all__ = [
    "FLAT",
    "RULES",
    "EvidenceMaps",
    "Lamp",
    "Lights",
    "Rendering",
    "ScoreRule",
    "Targets",
    "colour_sums",
    "count_missed_pixels",
    "evidence_maps",
    "mask_evidence",
    "mask_out_surface",
    "mask_picture",
    "match_picture",
    "model_picture",
    "pack_targets",
    "render",
    "score",
    "scores_from_sums",
    "through_mask",
]
