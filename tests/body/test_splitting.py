"""Cutting a mesh moves nothing, tears nothing and loses nothing."""

import numpy as np
import pytest
import trimesh

from airborne.body import Mesh
from airborne.body.splitting import faces_between, split_at
from tests.support.tolerances import EXACT, ROUNDTRIP

BALL = trimesh.creation.icosphere(subdivisions=2, radius=0.3)


def ball():
    vertices = np.asarray(BALL.vertices)
    return Mesh(vertices, np.asarray(BALL.faces), vertices / 0.3)


def solid(*meshes):
    return trimesh.util.concatenate([trimesh.Trimesh(m.vertices_m, m.faces, process=False) for m in meshes])


@pytest.mark.parametrize("height", [0.0, 0.011, -0.2, float(BALL.vertices[40, 2]), 0.2999])
@pytest.mark.parametrize("direction", [[0, 0, 1.0], [0.6, 0, 0.8], [1 / 3, 2 / 3, -2 / 3]])
def test_cut_mesh_stays_closed_with_its_volume_and_no_face_crosses_the_cut(height, direction):
    mesh = ball()
    cut = split_at(mesh, mesh.vertices_m @ direction - height)
    whole = trimesh.Trimesh(cut.vertices_m, cut.faces, process=False)
    assert whole.is_watertight and whole.is_winding_consistent
    assert whole.volume == pytest.approx(BALL.volume, rel=ROUNDTRIP)
    heights = (cut.vertices_m @ direction - height)[cut.faces]
    assert np.all((heights.max(axis=1) < 1e-9) | (heights.min(axis=1) > -1e-9))
    np.testing.assert_allclose(np.linalg.norm(cut.normals, axis=1), 1, atol=EXACT)


def test_pieces_between_heights_share_the_surface_and_lie_where_they_should():
    mesh = ball()
    for height in (-0.1, 0.05):
        mesh = split_at(mesh, mesh.vertices_m[:, 2] - height)
    bounds = [(-np.inf, -0.1), (-0.1, 0.05), (0.05, np.inf)]
    pieces = [faces_between(mesh, mesh.vertices_m[:, 2], *bound) for bound in bounds]
    assert sum(solid(piece).area for piece in pieces) == pytest.approx(BALL.area, rel=ROUNDTRIP)
    for piece, (low, high) in zip(pieces, bounds, strict=True):
        assert piece.vertices_m[:, 2].min() > low - EXACT and piece.vertices_m[:, 2].max() < high + EXACT
        np.testing.assert_allclose(
            piece.normals, piece.vertices_m / np.linalg.norm(piece.vertices_m, axis=1)[:, None], atol=0.02
        )


def test_mesh_without_normals_has_none_after_the_cut():
    mesh = Mesh(ball().vertices_m, ball().faces)
    cut = split_at(mesh, mesh.vertices_m[:, 0])
    assert len(cut.faces) > len(mesh.faces)
    assert cut.normals is None and faces_between(cut, cut.vertices_m[:, 0], 0, np.inf).normals is None


def test_cut_beside_the_mesh_leaves_it_as_it_is():
    mesh = ball()
    assert split_at(mesh, mesh.vertices_m[:, 2] - 0.4) is mesh
