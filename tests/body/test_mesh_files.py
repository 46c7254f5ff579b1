"""Mesh files are OBJ, PLY or STL by what they hold, within limits; nothing that they name is opened."""

import builtins

import pytest
import trimesh

from airborne.body import mesh_files
from airborne.body.mesh_files import read_mesh
from airborne.errors import BodyError

BOX = trimesh.creation.box((0.5, 0.4, 0.3))


@pytest.mark.parametrize("kind", ["obj", "ply", "stl", "stl_ascii"])
def test_a_mesh_is_read_by_what_it_holds_whatever_it_is_called(tmp_path, kind):
    path = tmp_path / "box.txt"
    BOX.export(path, file_type=kind)
    mesh = read_mesh(path, 2.0)
    assert mesh.faces.shape == (12, 3)
    assert mesh.vertices_m.max(axis=0) == pytest.approx([0.5, 0.4, 0.3])


@pytest.mark.parametrize("kind", ["glb", "off", "dae", "3mf", "xyz", "zip", "json"])
def test_another_kind_is_refused_by_its_bytes_and_no_package_is_named(tmp_path, kind):
    path = tmp_path / f"box.{'obj' if kind == 'glb' else kind}"
    texts = {"glb": BOX.export(file_type="glb"), "off": BOX.export(file_type="off").encode()}
    texts["zip"] = b"PK\x03\x04" + bytes(99)
    path.write_bytes(texts.get(kind, b"<COLLADA/>"))
    with pytest.raises(BodyError, match="not an OBJ, PLY or STL mesh; convert it") as caught:
        read_mesh(path, 1.0)
    assert not any(word in str(caught.value) for word in ("module", "collada", "lxml", "networkx", "pip", "install"))


def test_sizes_are_limited_and_the_number_is_told(tmp_path, monkeypatch):
    path = tmp_path / "box.ply"
    path.write_text("ply\nformat ascii 1.0\nelement vertex 3\nelement face 1234567\nend_header\n")
    with pytest.raises(BodyError, match="1234567 faces, expected 200000 at most"):
        read_mesh(path, 1.0)
    for kind in ("obj", "stl", "stl_ascii", "ply"):
        BOX.export(path, file_type=kind)
        monkeypatch.setattr(mesh_files, "_MOST_FACES", 11)
        with pytest.raises(BodyError, match="12 faces, expected 11 at most"):
            read_mesh(path, 1.0)
    monkeypatch.setattr(mesh_files, "_LARGEST_BYTES", 100)
    with pytest.raises(BodyError, match="MB, expected 0 at most; reduce it"):
        read_mesh(path, 1.0)


def test_a_mesh_that_names_materials_and_textures_opens_only_itself(tmp_path, monkeypatch, capfd):
    BOX.export(tmp_path / "box.obj")
    text = (tmp_path / "box.obj").read_text()
    (tmp_path / "box.obj").write_text(f"mtllib {tmp_path / 'secret'}\nusemtl x\n{text}")
    BOX.export(tmp_path / "box.ply", encoding="ascii")
    text = (tmp_path / "box.ply").read_text()
    (tmp_path / "box.ply").write_text(text.replace("comment", f"comment TextureFile {tmp_path / 'secret'}\ncomment", 1))
    (tmp_path / "secret").write_text("newmtl x\nKd 1 0 0\n")
    opened, really = [], builtins.open
    monkeypatch.setattr(builtins, "open", lambda *args, **kwargs: (opened.append(args[0]), really(*args, **kwargs))[1])
    for name in ("box.obj", "box.ply"):
        assert read_mesh(tmp_path / name, 1.0).faces.shape == (12, 3)
    assert [str(path) for path in opened if "secret" in str(path)] == []
    assert capfd.readouterr() == ("", "")
