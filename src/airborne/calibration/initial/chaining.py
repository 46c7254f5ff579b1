"""Where cameras start from what they see of a board: each lens by itself, then the cameras, linked by shared views.

Starts only; the bundle adjustment makes them exact.
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

_FOCALS = np.geomspace(0.4, 4.0, 14)  # of a picture's longer side: where the search for a focal length begins
FEWEST_LENS_VIEWS = 3  # that tell a focal length
_IDENTITY = RigidTransform.from_components(np.zeros(3), Rotation.identity())


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """What every camera saw of a board at every moment; a moment is the same instant for all of them."""

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
        n, label = connected_components(_n_shared_moments(self), directed=False)
        return sorted((np.flatnonzero(label == i).tolist() for i in range(n)), key=len, reverse=True)

    def of_camera(self, camera: int) -> Views:
        """Return the views of one camera, without the moments that it does not see."""
        row = tuple(sighting for sighting in self.detections[camera] if len(sighting.corner))
        return Views(self.board, (self.cameras[camera],), (row,))


def board_source(
    views: Views, world_from_board: RigidTransform, *, name: str = "board", rows: Sequence[int] | None = None
) -> Source:
    """Return the views as a source, targets beginning at `world_from_board` (moments,).

    rows: the rig's row of each camera of the views; None: they are the rig's cameras.
    """
    seen = [
        (np.full(len(s.corner), c), s.corner, np.full(len(s.corner), m), s.px)
        for c, row in zip(rows or range(len(views.cameras)), views.detections, strict=True)
        for m, s in enumerate(row)
    ]
    camera, point, moment = (np.concatenate([row[i] for row in seen]).astype(int) for i in range(3))
    return Source(
        name=name,
        camera=camera,
        point=point,
        moment=moment,
        px=np.concatenate([row[3] for row in seen]),
        points=views.board.corners,
        world_from_target=world_from_board,
        cluster=moment,
    )


def initial_lens(views: Views, size: tuple[int, int], *, lens: Lens) -> tuple[Camera, RigidTransform]:
    """Begin one camera (the only one of the views): the focal length that fits the board's views best, and the boards.

    The camera stands in the world's origin. Raises CalibrationError where too few views show the board.
    """
    name = views.cameras[0]
    row = views.detections[0]
    if len(row) < FEWEST_LENS_VIEWS:
        raise CalibrationError(
            f"camera '{name}' shows the board in {len(row)} pictures, at least {FEWEST_LENS_VIEWS} are needed: show it more "
            "often, nearer, and check the board's columns, rows and dictionary"
        )
    spread = np.unique(np.linspace(0, len(row) - 1, min(len(row), 12)).astype(int))
    best, best_error = None, np.inf
    for share in _FOCALS:
        camera = _pinhole(name, size, share * max(size), lens)
        errors = [_board_pose(camera, views.board, row[i])[1] for i in spread]
        if np.median(errors) < best_error:
            best, best_error = camera, float(np.median(errors))
    if best is None:
        raise CalibrationError(
            f"camera '{name}': no focal length fits its views of the board; is the board's file right?"
        )
    return best, stack_transforms([_board_pose(best, views.board, sighting)[0] for sighting in row])


def chain_cameras(cameras: Sequence[Camera], views: Views) -> tuple[Rig, RigidTransform]:
    """Place cameras with known lenses by the moments at which two of them see the board, along the best tree.

    The camera with the most links is the world's origin. Return the rig, and the board at every moment. Raises
    CalibrationError naming the cameras that share no view with the others.
    """
    n = len(cameras)
    places = [
        [_board_pose(camera, views.board, s)[0] if len(s.corner) else None for s in row]
        for camera, row in zip(cameras, views.detections, strict=True)
    ]
    n_shared = _n_shared_moments(views)
    root = int(np.argmax(n_shared.sum(axis=1)))
    tree = minimum_spanning_tree(np.where(n_shared > 0, 1 / np.maximum(n_shared, 1), 0.0))
    order, before = breadth_first_order(tree, root, directed=False)
    if len(order) < n:
        _refuse_unlinked(views, n_shared, order)
    from_world: dict[int, RigidTransform] = {root: _IDENTITY}
    for i in order[1:]:
        j = int(before[i])
        from_world[int(i)] = (
            _relative_pose(cameras[i], cameras[j], views, places[i], places[j], (int(i), j)) * from_world[j]
        )
    rig = Rig(tuple(replace(camera, camera_from_world=from_world[i]) for i, camera in enumerate(cameras)))
    return rig, stack_transforms([_consensus_board_pose(rig, views, places, m) for m in range(views.n_moments)])


def board_poses(rig: Rig, views: Views) -> RigidTransform:
    """Place the board at every moment by a rig that is known: (moments,); the identity where nobody sees it."""
    places = [
        [_board_pose(camera, views.board, s)[0] if len(s.corner) else None for s in row]
        for camera, row in zip(rig, views.detections, strict=True)
    ]
    return stack_transforms([_consensus_board_pose(rig, views, places, m) for m in range(views.n_moments)])


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


def _board_pose(camera: Camera, board: Board, sighting: DetectedCorners) -> tuple[RigidTransform, float]:
    """Return camera_from_board of one view and its RMS [px]; the camera's own place does not matter."""
    corners = board.corners[sighting.corner]
    straight = camera.undistort_px(sighting.px)
    known = np.isfinite(straight).all(axis=1)
    if known.sum() < 4:
        return _IDENTITY, np.inf
    found, turns, shifts, errors = cv2.solvePnPGeneric(
        corners[known], straight[known], camera.K, None, flags=cv2.SOLVEPNP_IPPE
    )
    if not found:
        return _IDENTITY, np.inf
    best = int(np.argmin(np.ravel(errors)))
    place = RigidTransform.from_components(shifts[best].ravel(), Rotation.from_rotvec(turns[best].ravel()))
    off = replace(camera, camera_from_world=_IDENTITY).px_from_world(place.apply(corners)) - sighting.px
    error = np.sqrt(np.mean(np.sum(off**2, axis=1)))
    return (place, float(error)) if np.isfinite(error) else (_IDENTITY, np.inf)


def _n_shared_moments(views: Views) -> Array:
    """Return how many moments every two cameras share: (cameras, cameras), 0 on the diagonal."""
    sees = (views.n_corners > 0).astype(float)
    shared = sees @ sees.T
    np.fill_diagonal(shared, 0)
    return shared


def _relative_pose(
    one: Camera,
    other: Camera,
    views: Views,
    places: Sequence[RigidTransform | None],
    others: Sequence[RigidTransform | None],
    pair: tuple[int, int],
) -> RigidTransform:
    """Return one_from_other: of all shared moments' answers the one that most of them come near."""
    shared = [(a, b, m) for m, (a, b) in enumerate(zip(places, others, strict=True)) if a is not None and b is not None]
    answers = [a * b.inv() for a, b, _ in shared]
    plain = replace(one, camera_from_world=_IDENTITY)

    def misfit(answer: RigidTransform) -> float:
        off = []
        for _, b, m in shared:
            sighting = views.detections[pair[0]][m]
            seen = plain.px_from_world((answer * b).apply(views.board.corners[sighting.corner]))
            off.append(np.median(np.nan_to_num(np.linalg.norm(seen - sighting.px, axis=1), nan=1e6)))
        return float(np.median(off))

    return min(answers, key=misfit)


def _consensus_board_pose(
    rig: Rig, views: Views, places: Sequence[Sequence[RigidTransform | None]], moment: int
) -> RigidTransform:
    """Return world_from_board at a moment: of the cameras' answers the one that suits all of them."""
    answers = [
        camera.camera_from_world.inv() * place
        for camera, row in zip(rig, places, strict=True)
        if (place := row[moment]) is not None
    ]
    if len(answers) < 2:
        return answers[0] if answers else _IDENTITY

    def misfit(answer: RigidTransform) -> float:
        off = []
        for camera, row in zip(rig, views.detections, strict=True):
            if len(row[moment].corner):
                seen = camera.px_from_world(answer.apply(views.board.corners[row[moment].corner]))
                off.append(np.mean(np.nan_to_num(np.linalg.norm(seen - row[moment].px, axis=1), nan=1e6)))
        return float(np.sum(off))

    return min(answers, key=misfit)


def _refuse_unlinked(views: Views, n_shared: Array, reached: Ints) -> None:
    away = [views.cameras[i] for i in range(len(views.cameras)) if i not in set(reached.tolist())]
    linked_names = [views.cameras[i] for i in reached]
    raise CalibrationError(
        f"no view of the board is shared between {', '.join(away)} and {', '.join(linked_names)}: show the board to "
        "two cameras at once, one of each group"
    )


def stack_transforms(places: Sequence[RigidTransform]) -> RigidTransform:
    """Return single places as one value (n,)."""
    return RigidTransform.from_components(
        np.stack([place.translation for place in places]),
        Rotation.from_quat(np.stack([place.rotation.as_quat() for place in places])),
    )
