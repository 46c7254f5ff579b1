"""Initial cameras from views of a board: each lens by itself, then the poses, chained along shared views.

Initial values only; the bundle adjustment refines them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.bundle import Source
from airborne.calibration.sources.boards import Board, DetectedCorners
from airborne.cameras.camera import Camera, Lens, Rig
from airborne.errors import CalibrationError
from airborne.types import Array, Ints

_FOCALS = np.geomspace(0.4, 4.0, 14)  # of an image's longer side: initial focal lengths
FEWEST_LENS_VIEWS = 3  # that determine a focal length
_IDENTITY = RigidTransform.from_components(np.zeros(3), Rotation.identity())


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """What every camera sees of a board at every moment; a moment is the same instant for all of them."""

    board: Board
    cameras: tuple[str, ...]
    detections: tuple[tuple[DetectedCorners, ...], ...]  # by camera, by moment

    @property
    def n_moments(self) -> int:
        """How many moments there are."""
        return len(self.detections[0])

    @property
    def n_corners(self) -> Ints:
        """How many corners each camera sees at each moment: (cameras, moments)."""
        return np.array([[len(sighting.corner) for sighting in row] for row in self.detections])

    def select_moments(self, moments: Sequence[int] | Ints) -> Views:
        """Return the views of some moments."""
        return replace(self, detections=tuple(tuple(row[m] for m in moments) for row in self.detections))

    def select_cameras(self, cameras: Sequence[int]) -> Views:
        """Return the views of some cameras."""
        return Views(self.board, tuple(self.cameras[c] for c in cameras), tuple(self.detections[c] for c in cameras))

    def groups(self) -> list[list[int]]:
        """Return the cameras that are linked by shared moments, group by group, the largest first."""
        n, label = connected_components(n_shared_moments(self), directed=False)
        return sorted((np.flatnonzero(label == i).tolist() for i in range(n)), key=len, reverse=True)

    def of_camera(self, camera: int) -> Views:
        """Return the views of one camera, without the moments that it does not see."""
        row = tuple(sighting for sighting in self.detections[camera] if len(sighting.corner))
        return Views(self.board, (self.cameras[camera],), (row,))


def board_source(
    views: Views, world_from_board: RigidTransform, *, lens_of: str = "", rows: Sequence[int] | None = None
) -> Source:
    """Return the views as a source, the targets' initial poses `world_from_board` (moments,).

    lens_of: the camera whose lens alone they are for. rows: the rig's row of each camera of the views; None: they are
    the rig's cameras.
    """
    columns = [
        (np.full(len(s.corner), c), s.corner, np.full(len(s.corner), m), s.px)
        for c, row in zip(rows or range(len(views.cameras)), views.detections, strict=True)
        for m, s in enumerate(row)
    ]
    camera, point, moment = (np.concatenate([row[i] for row in columns]).astype(int) for i in range(3))
    return Source(
        name=f"lens of {lens_of}" if lens_of else "board",
        camera=camera,
        point=point,
        moment=moment,
        px=np.concatenate([row[3] for row in columns]),
        points=views.board.corners,
        world_from_target=world_from_board,
        cluster=moment,
        is_object=True,
        is_of_lens=bool(lens_of),
    )


def initial_lens(views: Views, size: tuple[int, int], *, lens: Lens) -> tuple[Camera, RigidTransform]:
    """Return the views' only camera with the focal length that fits them best, and the board's poses.

    The camera is at the world's origin. Raises CalibrationError where too few views show the board.
    """
    name = views.cameras[0]
    row = views.detections[0]
    if len(row) < FEWEST_LENS_VIEWS:
        raise CalibrationError(
            f"camera '{name}' shows the board in {len(row)} images, at least {FEWEST_LENS_VIEWS} are needed: show it "
            "more often, nearer, and check the board's columns, rows and dictionary"
        )
    sample = np.unique(np.linspace(0, len(row) - 1, min(len(row), 12)).astype(int))
    best, best_error = None, np.inf
    for ratio in _FOCALS:
        camera = _pinhole(name, size, ratio * max(size), lens)
        errors = [board_pose(camera, views.board, row[i])[1] for i in sample]
        if np.median(errors) < best_error:
            best, best_error = camera, float(np.median(errors))
    if best is None:
        raise CalibrationError(
            f"camera '{name}': no focal length fits its views of the board; is the board's file right?"
        )
    return best, stack_transforms([board_pose(best, views.board, sighting)[0] for sighting in row])


def chain_cameras(cameras: Sequence[Camera], views: Views) -> tuple[Rig, RigidTransform]:
    """Chain the poses of cameras with known lenses along the spanning tree with the most shared moments.

    The camera with the most shared moments is the world's origin. Return the rig, and the board's pose at every moment.
    Raises CalibrationError naming the cameras that share no view with the others.
    """
    n = len(cameras)
    camera_from_board = [
        [board_pose(camera, views.board, s)[0] if len(s.corner) else None for s in row]
        for camera, row in zip(cameras, views.detections, strict=True)
    ]
    n_shared = n_shared_moments(views)
    root = int(np.argmax(n_shared.sum(axis=1)))
    tree = minimum_spanning_tree(np.where(n_shared > 0, 1 / np.maximum(n_shared, 1), 0.0))
    order, parent = breadth_first_order(tree, root, directed=False)
    if len(order) < n:
        _refuse_unlinked(views, n_shared, order)
    from_world: dict[int, RigidTransform] = {root: _IDENTITY}
    for i in order[1:]:
        j = int(parent[i])
        from_world[int(i)] = (
            pose_by_link(
                cameras[i],
                cameras[j],
                views,
                poses=camera_from_board[i],
                other_poses=camera_from_board[j],
                pair=(int(i), j),
            )[0]
            * from_world[j]
        )
    rig = Rig(tuple(replace(camera, camera_from_world=from_world[i]) for i, camera in enumerate(cameras)))
    return rig, stack_transforms(
        [_consensus_board_pose(rig, views, camera_from_board, m) for m in range(views.n_moments)]
    )


def board_poses(rig: Rig, views: Views) -> RigidTransform:
    """Return the board's pose at every moment from a known rig: (moments,); the identity where no camera sees it."""
    camera_from_board = [
        [board_pose(camera, views.board, s)[0] if len(s.corner) else None for s in row]
        for camera, row in zip(rig, views.detections, strict=True)
    ]
    return stack_transforms([_consensus_board_pose(rig, views, camera_from_board, m) for m in range(views.n_moments)])


def _pinhole(name: str, size: tuple[int, int], focal_px: float, lens: Lens) -> Camera:
    width, height = size
    return Camera(
        name=name,
        K=np.array([[focal_px, 0, (width - 1) / 2], [0, focal_px, (height - 1) / 2], [0, 0, 1]]),
        size=size,
        camera_from_world=_IDENTITY,
        distortion=np.zeros(4 if lens == "fisheye" else 5),
        lens=lens,
    )


def board_pose(camera: Camera, board: Board, sighting: DetectedCorners) -> tuple[RigidTransform, float]:
    """Return camera_from_board of one view and its RMS [px], by perspective-n-point; the camera's pose is ignored."""
    corners = board.corners[sighting.corner]
    ideal = camera.undistort_px(sighting.px)
    is_valid = np.isfinite(ideal).all(axis=1)
    if is_valid.sum() < 4:
        return _IDENTITY, np.inf
    is_solved, rotations, translations, errors = cv2.solvePnPGeneric(
        corners[is_valid], ideal[is_valid], camera.K, None, flags=cv2.SOLVEPNP_IPPE
    )
    if not is_solved:
        return _IDENTITY, np.inf
    best = int(np.argmin(np.ravel(errors)))
    camera_from_board = RigidTransform.from_components(
        translations[best].ravel(), Rotation.from_rotvec(rotations[best].ravel())
    )
    residual = (
        replace(camera, camera_from_world=_IDENTITY).px_from_world(camera_from_board.apply(corners)) - sighting.px
    )
    error = np.sqrt(np.mean(np.sum(residual**2, axis=1)))
    return (camera_from_board, float(error)) if np.isfinite(error) else (_IDENTITY, np.inf)


def n_shared_moments(views: Views) -> Array:
    """Return how many moments every two cameras share: (cameras, cameras), 0 on the diagonal."""
    is_seen = (views.n_corners > 0).astype(float)
    shared = is_seen @ is_seen.T
    np.fill_diagonal(shared, 0)
    return shared


def pose_by_link(
    one: Camera,
    other: Camera,
    views: Views,
    *,
    poses: Sequence[RigidTransform | None],
    other_poses: Sequence[RigidTransform | None],
    pair: tuple[int, int],
) -> tuple[RigidTransform, float]:
    """Return one_from_other, of the shared moments' candidates the one that fits most of them, and its misfit [px]."""
    shared = [
        (a, b, m) for m, (a, b) in enumerate(zip(poses, other_poses, strict=True)) if a is not None and b is not None
    ]
    candidates = [a * b.inv() for a, b, _ in shared]
    matrices = np.stack([candidate.as_matrix() for candidate in candidates])
    at_origin = replace(one, camera_from_world=_IDENTITY)

    def distances_px(other_from_board: RigidTransform, moment: int) -> Array:
        """Return the median distance of a moment's corners for each candidate: (n,)."""
        sighting = views.detections[pair[0]][moment]
        points = other_from_board.apply(views.board.corners[sighting.corner])
        in_one = points @ np.swapaxes(matrices[:, :3, :3], 1, 2) + matrices[:, None, :3, 3]
        off_px = np.linalg.norm(at_origin.px_from_world(in_one) - sighting.px, axis=-1)
        return np.median(np.nan_to_num(off_px, nan=1e6), axis=1)

    misfits = np.median([distances_px(b, moment) for _, b, moment in shared], axis=0)
    best = int(np.argmin(misfits))
    return candidates[best], float(misfits[best])


def _consensus_board_pose(
    rig: Rig, views: Views, poses: Sequence[Sequence[RigidTransform | None]], moment: int
) -> RigidTransform:
    """Return world_from_board at a moment: of the cameras' candidates the one that fits all of them."""
    candidates = [
        camera.camera_from_world.inv() * pose
        for camera, row in zip(rig, poses, strict=True)
        if (pose := row[moment]) is not None
    ]
    if len(candidates) < 2:
        return candidates[0] if candidates else _IDENTITY

    def misfit(candidate: RigidTransform) -> float:
        distances = []
        for camera, row in zip(rig, views.detections, strict=True):
            if len(row[moment].corner):
                projected = camera.px_from_world(candidate.apply(views.board.corners[row[moment].corner]))
                distances.append(np.mean(np.nan_to_num(np.linalg.norm(projected - row[moment].px, axis=1), nan=1e6)))
        return float(np.sum(distances))

    return min(candidates, key=misfit)


def _refuse_unlinked(views: Views, n_shared: Array, reached: Ints) -> None:
    apart = [views.cameras[i] for i in range(len(views.cameras)) if i not in set(reached.tolist())]
    linked = [views.cameras[i] for i in reached]
    raise CalibrationError(
        f"no view of the board is shared between {', '.join(apart)} and {', '.join(linked)}: show the board to "
        "two cameras at once, one of each group"
    )


def stack_transforms(transforms: Sequence[RigidTransform]) -> RigidTransform:
    """Stack single transforms into one value (n,)."""
    return RigidTransform.from_components(
        np.stack([transform.translation for transform in transforms]),
        Rotation.from_quat(np.stack([transform.rotation.as_quat() for transform in transforms])),
    )
