"""A small file that declares a huge picture of a board: it is refused before it is decoded."""

import struct
import subprocess
import sys
import zlib

from tests.support.calibration_scenes import BOARD_TOML

SIDE_PX = 20_000


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def huge_png() -> bytes:
    """A black picture of 20,000 x 20,000 pixels, of one bit each."""
    rows = zlib.compress(bytes((SIDE_PX // 8 + 1) * SIDE_PX))
    header = struct.pack(">IIBBBBB", SIDE_PX, SIDE_PX, 1, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def test_it_is_refused_in_one_line(tmp_path):
    (tmp_path / "board.toml").write_text(BOARD_TOML)
    for camera in ("left", "right"):
        (tmp_path / camera).mkdir()
        (tmp_path / camera / "0.png").write_bytes(huge_png())
    (tmp_path / "sources.toml").write_text(
        '[[camera]]\nname = "left"\npictures = "left"\n[[camera]]\nname = "right"\npictures = "right"\n'
        '[board]\nfile = "board.toml"\n'
    )
    command = [sys.executable, "-c", "import sys; sys.argv[0] = 'airborne'; from airborne.cli import main; main()"]
    done = subprocess.run(
        [*command, "calibrate", "sources.toml", "-o", "calib.toml"], cwd=tmp_path, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "0.png cannot be read as an image, or is too large for one" in done.stderr
