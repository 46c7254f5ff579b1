"""Arrays come back by any name; what declares more than it holds, or holds objects, is refused unread."""

import io
import zipfile

import numpy as np
import pytest

from airborne.io.npz import read_arrays, write_arrays


def packed(path, header, body=b""):
    text = header.encode()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + body)
    return path


def test_arrays_come_back_by_names_that_numpy_keeps_for_itself(tmp_path):
    arrays = {"file": np.arange(6.0).reshape(2, 3), "allow_pickle": np.ones(2, np.int32), "cam 1": np.zeros((0, 3))}
    write_arrays(tmp_path / "a.npz", arrays)
    back = read_arrays(tmp_path / "a.npz")
    assert list(back) == list(arrays)
    for name in arrays:
        np.testing.assert_array_equal(back[name], arrays[name])
        np.testing.assert_array_equal(np.load(tmp_path / "a.npz")[name], arrays[name])


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000, 1000000), }\n", "declares more numbers"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (3,), }\n", "holds objects"),
        ("{'descr': ((((", "Cannot parse header|never closed|EOF"),
    ],
)
def test_what_is_no_plain_array_is_refused(tmp_path, header, said):
    with pytest.raises(ValueError, match=said):
        read_arrays(packed(tmp_path / "a.npz", header, b"1234"))


def test_a_file_that_unpacks_to_gigabytes_is_refused_unread(tmp_path):
    header = "{'descr': '|u1', 'fortran_order': False, 'shape': (300000000,), }\n"
    small = packed(tmp_path / "a.npz", header, bytes(300_000_000))
    assert small.stat().st_size < 1_000_000
    with pytest.raises(ValueError, match="more than 256 MB"):
        read_arrays(small)


def test_a_file_of_another_kind_is_refused(tmp_path):
    text = io.BytesIO()
    np.save(text, np.ones(3))
    (tmp_path / "a.npz").write_bytes(text.getvalue())
    with pytest.raises(ValueError, match="not a zip file"):
        read_arrays(tmp_path / "a.npz")
