"""The first pose: angles, positions, clicked points or detections, a rig, a body → a pose, and how it fits."""

from airborne.tracking.first_pose.fit import (
    LANDMARK_WEIGHTS,
    LEAST_VISIBILITY,
    FirstPose,
    check_landmark_names,
    fit_to_detections,
    fit_to_pixels,
    fit_to_points,
    pose_by_hand,
)

__all__ = [
    "LANDMARK_WEIGHTS",
    "LEAST_VISIBILITY",
    "FirstPose",
    "check_landmark_names",
    "fit_to_detections",
    "fit_to_pixels",
    "fit_to_points",
    "pose_by_hand",
]
