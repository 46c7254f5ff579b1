"""Photoreal recordings of people that airborne did not draw: `python benchmarks/rendered_people/record.py FOLDER`.

After FOLDER, names of people (1 to 10, see people.py) choose some; `--frames N` stops after N frames. Writes
FOLDER/NAME/ with cam1.mp4 and so on, Calib.toml, trial.toml and truth_joints.csv; measure.py then tracks them.

The body is MakeHuman's (CC0, from the package anny), posed by linear blend skinning and prescribed joint angles, its
orientation integrated so that angular momentum stays constant. Blender draws a hall as the still background of each
camera; the person is lit by rays against the own mesh and drawn over it. Images have noise; the start is clicked.

Needs an environment of its own, of Python 3.11: `pip install bpy anny embreex numba av opencv-python-headless`. So
nothing of airborne is imported here. Some five minutes for each person, most of them for the hall.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import av
import numpy as np
from body import body_of
from cameras import SIZE, place_cameras, write_calibration
from drawing import Patch, draw_frame, painting_of, read_background, to_pixels
from flight import RATE_HZ, Flight, fly
from hall import Bystanders, render_hall
from people import PEOPLE, Person

_BYSTANDER, _BYSTANDER_FRAMES = "3", (-1, 10, -3, 0)  # chosen: who stands by, in poses of which frames
_NOISE_SD = 2.0  # of 255, chosen
_BIT_RATE = 6_000_000  # per second, chosen
_CLICK_SD_M = 0.015  # chosen: about as a person clicks joints
_NOT_CLICKED = ("neck", "pelvis")


def record(folder: Path, name: str, bystanders: Bystanders, n_frames: int | None = None) -> None:
    """Write the recording of a person into a folder, of all frames or the first ones."""
    person = PEOPLE[name]
    folder.mkdir(parents=True, exist_ok=True)
    body = body_of(person)
    flight = fly(body, person)
    n_frames = min(n_frames or person.n_frames, person.n_frames)
    rng = np.random.default_rng(1000 + person.seed)
    cameras = place_cameras(rng, person, flight.centres_m)
    write_calibration(folder / "Calib.toml", cameras)
    write_truth(folder / "truth_joints.csv", flight, n_frames)
    print(f"person {name}: {n_frames} frames of {len(cameras)} cameras, drawing the hall", flush=True)
    with tempfile.TemporaryDirectory() as scratch:
        middle_m = flight.centres_m[len(flight.centres_m) // 2]
        paths = render_hall(rng, Path(scratch), cameras, middle_m, person.light, bystanders)
        backgrounds = [read_background(str(path)) for path in paths]
    vertices_m = flight.vertices_m.astype(float)
    painting = painting_of(body, person, vertices_m[0])
    patches: list[list[Patch]] = []  # by frame and camera
    for frame in range(n_frames):
        patches.append(draw_frame(painting, vertices_m[frame], cameras, backgrounds))
        if frame % 10 == 0:
            print(f"person {name}: frame {frame} drawn", flush=True)
    rng = np.random.default_rng(person.seed)
    for number, (background, *of_camera) in enumerate(zip(backgrounds, *patches, strict=True), start=1):
        write_video(rng, folder / f"cam{number}.mp4", to_pixels(background), of_camera)
    write_trial(rng, folder / "trial.toml", name, person, flight)
    print(f"person {name}: written to {folder}", flush=True)


def write_truth(path: Path, flight: Flight, n_frames: int) -> None:
    """Write the true joints of the first frames, in the table that `airborne.evaluation` reads."""
    lines = ["time_s,joint,x_m,y_m,z_m"]
    for frame in range(n_frames):
        for joint, at_m in flight.joints_m.items():
            lines.append(",".join([f"{frame / RATE_HZ:.6f}", joint, *(f"{value:.5f}" for value in at_m[frame])]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_video(rng: np.random.Generator, path: Path, background: np.ndarray, patches: Sequence[Patch]) -> None:
    """Write a camera's video: the patches over a background (h, w, 3) sRGB, with noise; H.264."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=RATE_HZ, options={"preset": "medium"})
        stream.width, stream.height = SIZE
        stream.pix_fmt, stream.bit_rate = "yuv420p", _BIT_RATE
        stream.codec_context.color_range = stream.codec_context.colorspace = 1  # said to be limited range, BT.709
        for x, y, pixels in patches:
            image = background.copy()
            image[y : y + pixels.shape[0], x : x + pixels.shape[1]] = pixels
            noisy = image + rng.normal(0, _NOISE_SD, image.shape)
            frame = av.VideoFrame.from_ndarray(np.clip(noisy + 0.5, 0, 255).astype(np.uint8), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def write_trial(rng: np.random.Generator, path: Path, name: str, person: Person, flight: Flight) -> None:
    """Write a trial for `airborne track`: stature and mass are known, joints of frame 0 are clicked."""
    lines = [f'name = "person {name}"', ""]
    for number in range(1, person.n_cameras + 1):
        lines += ["[[camera]]", f'name = "cam{number}"', f'video = "cam{number}.mp4"', ""]
    lines += ["[calibration]", 'file = "Calib.toml"', "", "[body]", 'preset = "human18"']
    lines += [f"stature_m = {person.stature_m}", f"mass_kg = {person.mass_kg}", "", "[start]", "frame = 0", ""]
    lines += ["[start.joints_m]"]
    for joint, at_m in flight.joints_m.items():
        if joint not in _NOT_CLICKED:
            x, y, z = at_m[0] + rng.normal(0, _CLICK_SD_M, 3)
            lines.append(f"{joint} = [{x:.3f}, {y:.3f}, {z:.3f}]")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def bystanders() -> Bystanders:
    """Return the people who stand by: one person in poses of the own flight."""
    body = body_of(PEOPLE[_BYSTANDER])
    vertices_m = fly(body, PEOPLE[_BYSTANDER]).vertices_m
    return Bystanders([vertices_m[frame] for frame in _BYSTANDER_FRAMES], body.faces, body.materials)


def main() -> None:
    """Record the people named on the command line, or all."""
    parser = argparse.ArgumentParser(description="Record people that airborne did not draw.")
    parser.add_argument("folder", type=Path, help="where a folder for each person is written")
    parser.add_argument("names", nargs="*", metavar="name", help=f"some of {', '.join(PEOPLE)}; without, all")
    parser.add_argument("--frames", type=int, help="stop after so many frames")
    args = parser.parse_args()
    if unknown := set(args.names) - set(PEOPLE):
        parser.error(f"no person {', '.join(sorted(unknown))}; there are {', '.join(PEOPLE)}")
    standing_by = bystanders()
    for name in args.names or PEOPLE:
        record(args.folder / name, name, standing_by, args.frames)


if __name__ == "__main__":
    main()
