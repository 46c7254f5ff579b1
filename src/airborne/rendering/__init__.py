"""Rendering: in come a body's geometry, its poses and cameras, out come scores, maps and pictures; knows no search."""

from airborne.rendering.drawing import Rendering, render
from airborne.rendering.evidence import EvidenceMaps, evidence_maps, mask_evidence
from airborne.rendering.kinematics import place_segments
from airborne.rendering.lights import FLAT, Lamp, Lights
from airborne.rendering.pictures import mask_picture, match_picture, model_picture, through_mask
from airborne.rendering.reference import render_reference
from airborne.rendering.scores import RULES, ScoreRule, measure, score, scores_from_sums
from airborne.rendering.targets import Targets, targets

__all__ = [
    "FLAT",
    "RULES",
    "EvidenceMaps",
    "Lamp",
    "Lights",
    "Rendering",
    "ScoreRule",
    "Targets",
    "evidence_maps",
    "mask_evidence",
    "mask_picture",
    "match_picture",
    "measure",
    "model_picture",
    "place_segments",
    "render",
    "render_reference",
    "score",
    "scores_from_sums",
    "targets",
    "through_mask",
]
