"""Recordings of a board, a wand and points, written as a user would have them."""

from dataclasses import replace
from fractions import Fraction

import av
import cv2
import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.calibration.sources.boards import Board
from airborne.cameras import Rig, camera_looking_at
from tests.support.board_prints import photographed

SIZE = (640, 480)
BOARD = Board(kind="charuco", columns=6, rows=5, square_m=0.12, marker_m=0.09, dictionary="DICT_4X4_50")
BOARD_TOML = 'kind = "charuco"\ncolumns = 6\nrows = 5\nsquare_m = 0.12\nmarker_m = 0.09\ndictionary = "DICT_4X4_50"\n'


def three_side_by_side() -> Rig:
    """Cameras in a row that look at the same place, without distortion."""
    places = ([-1.0, -2.5, 1.5], [0.0, -2.6, 1.2], [1.1, -2.4, 1.6])
    return Rig(
        tuple(
            camera_looking_at(f"cam{i}", place, [0, 0, 1], focal_px=560 + 10 * i, size=SIZE)
            for i, place in enumerate(places)
        )
    )


def wave_board(n: int) -> RigidTransform:
    """A board that is turned and moved in front of the cameras, frame by frame."""
    return board_at(np.linspace(0, 6, n))


def board_at(t: np.ndarray) -> RigidTransform:
    """The places of the waved board at these times."""
    turn = np.column_stack([0.5 * np.sin(2.1 * t), 0.6 * np.cos(1.7 * t), 0.4 * np.sin(1.3 * t)])
    shift = np.column_stack([0.35 * np.sin(1.9 * t), 0.4 * np.cos(1.1 * t), 1 + 0.3 * np.sin(2.3 * t)])
    facing = Rotation.from_euler("x", -90, degrees=True)
    middle = RigidTransform.from_translation(-BOARD.corners.mean(axis=0))
    return RigidTransform.from_components(shift, Rotation.from_rotvec(turn) * facing) * middle


def board_pictures(rig: Rig, places: RigidTransform) -> dict[str, list[np.ndarray]]:
    """Every camera's grey pictures."""
    return {camera.name: [photographed(BOARD, camera, place) for place in places] for camera in rig}


def write_videos(folder, pictures: dict[str, list[np.ndarray]], rate=10) -> None:
    """Write `<camera>.mp4`, hardly compressed, and `board.toml`."""
    (folder / "board.toml").write_text(BOARD_TOML)
    for name, greys in pictures.items():
        with av.open(str(folder / f"{name}.mp4"), "w") as container:
            stream = container.add_stream("libx264", rate=Fraction(rate), options={"crf": "12", "preset": "ultrafast"})
            stream.width, stream.height, stream.pix_fmt = SIZE[0], SIZE[1], "yuv420p"
            for grey in greys:
                frame = av.VideoFrame.from_ndarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB), format="rgb24")
                container.mux(stream.encode(frame))
            container.mux(stream.encode())


def write_pictures(folder, pictures: dict[str, list[np.ndarray]]) -> None:
    """Write `<camera>/000.png`, ... and `board.toml`."""
    (folder / "board.toml").write_text(BOARD_TOML)
    for name, greys in pictures.items():
        (folder / name).mkdir()
        for i, grey in enumerate(greys):
            cv2.imwrite(str(folder / name / f"{i:03d}.png"), grey)


def write_control_points(path, rig: Rig, points: np.ndarray, sd_px=0.3, seed=0) -> None:
    """Write a table of surveyed points as clicked."""
    rng = np.random.default_rng(seed)
    header = ["point", "x_m", "y_m", "z_m", *(f"{camera.name}_{axis}" for camera in rig for axis in "uv")]
    lines = [",".join(header)]
    for i, point in enumerate(points):
        px = np.concatenate([camera.px_from_world(point) + rng.normal(0, sd_px, 2) for camera in rig])
        lines.append(",".join([f"P{i}", *(f"{value:.4f}" for value in (*point, *px))]))
    path.write_text("\n".join(lines) + "\n")


def knocked(rig: Rig, name: str) -> Rig:
    """The rig with one camera turned."""
    turned = Rotation.from_rotvec([0.01, 0.02, 0.0])
    return Rig(
        tuple(
            replace(c, camera_from_world=RigidTransform.from_rotation(turned) * c.camera_from_world)
            if c.name == name
            else c
            for c in rig
        )
    )


def write_wand(path, rig: Rig, n=60, length_m=0.6, sd_px=0.3, seed=0) -> None:
    """Write the places of a wand's two markers, `frame,marker,camera,u_px,v_px`."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform([-0.7, -0.6, 0.4], [0.7, 0.7, 1.6], (n, 3))
    half = length_m / 2 * Rotation.random(n, rng=rng).apply([1, 0, 0])
    lines = ["frame,marker,camera,u_px,v_px"]
    for frame in range(n):
        for marker, point in ((1, middle[frame] - half[frame]), (2, middle[frame] + half[frame])):
            for camera in rig:
                u, v = camera.px_from_world(point) + rng.normal(0, sd_px, 2)
                lines.append(f"{frame},{marker},{camera.name},{u:.4f},{v:.4f}")
    path.write_text("\n".join(lines) + "\n")


def write_clicks(path, rig: Rig, points: dict[str, np.ndarray]) -> None:
    """Write points without places as clicked."""
    lines = [",".join(["point", *(f"{camera.name}_{axis}" for camera in rig for axis in "uv")])]
    for name, point in points.items():
        px = np.concatenate([camera.px_from_world(point) for camera in rig])
        lines.append(",".join([name, *(f"{value:.4f}" for value in px)]))
    path.write_text("\n".join(lines) + "\n")
