from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from airborne.body import BodyModel, Box, Ellipsoid, Mesh, Part, Pose, Segment, surface_arrays
from airborne.cameras import Camera
from airborne.errors import CalibrationError
from airborne.rendering import FLAT, render
from tests.support.bodies import LIGHTS, camera, in_slabs, posed_random
from tests.support.ray_casting import render_reference
from tests.support.tolerances import SOLVED

GREY = 1e-2  # grey levels between float32 kernels and float64 rays

KINDS = {
    "ellipsoids": ["ellipsoid"] * 5,
    "boxes": ["box"] * 3,
    "meshes": ["mesh"] * 3,
    "slabs": ["slab"] * 5,
    "smooth meshes": ["smooth"] * 3,
    "a mixture": ["ellipsoid", "box", "mesh", "slab", "box"],
}


def one_part(shape, position=(0.0, 0.0, 0.0), rotation=None) -> BodyModel:
    place = RigidTransform.from_components(np.array(position), rotation or Rotation.identity())
    return BodyModel(
        "one", (Segment("only", None, np.zeros(3), (Part("part", shape, place, np.array([200.0, 100.0, 50.0])),)),)
    )


def at_origin(model: BodyModel):
    return surface_arrays(model), model.with_pose(Pose(world_from_root=RigidTransform.identity()))


def axis_camera(size=(81, 61), focal=100.0) -> Camera:
    """Camera at the world's origin, looking along z."""
    K = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])
    return Camera(name="axis", K=K, size=size, camera_from_world=RigidTransform.identity())


def assert_same_maps(drawn, cast) -> None:
    assert np.array_equal(drawn.part, cast.part)
    assert np.array_equal(drawn.segment, cast.segment)
    np.testing.assert_allclose(drawn.inverse_depth, cast.inverse_depth, rtol=SOLVED)
    np.testing.assert_allclose(drawn.colour, cast.colour, atol=GREY)


@pytest.mark.parametrize("kinds", KINDS.values(), ids=KINDS.keys())
@pytest.mark.parametrize("seed", range(6))
def test_maps_equal_rays_in_any_pose(kinds, seed):
    shapes, posed = posed_random(kinds, seed)
    seen_by = camera(turn=0.7 * seed, skew=3.0 * (seed % 2))
    cast = render_reference(shapes, posed, seen_by, LIGHTS)
    assert cast.mask.sum() > 100
    assert_same_maps(render(shapes, posed, seen_by, LIGHTS), cast)


@pytest.mark.parametrize("kinds", KINDS.values(), ids=KINDS.keys())
@pytest.mark.parametrize("corner", [(0, 0), (20, 0), (0, 18), (20, 18)])
def test_maps_equal_rays_where_the_image_edge_cuts_the_body(kinds, corner):
    shapes, posed = posed_random(kinds, 3)
    v, u = np.nonzero(render(shapes, posed, camera(), FLAT).mask)
    offset = (int(np.median(u)) - corner[0], int(np.median(v)) - corner[1])  # a corner lies in the body's middle
    cropped = camera().resample(scale=(1, 1), offset=offset, size=(21, 19))
    cast = render_reference(shapes, posed, cropped, LIGHTS)
    assert cast.mask[corner[1]].any() and cast.mask[:, corner[0]].any()
    assert_same_maps(render(shapes, posed, cropped, LIGHTS), cast)


def test_every_kind_of_shape_occludes_every_other():
    occlusions = set()
    for seed in range(8):
        shapes, posed = posed_random(KINDS["a mixture"], seed)
        whole = render(shapes, posed, camera(), FLAT)
        kinds = np.array(["ellipsoid"] * len(posed.model.parts))
        kinds[np.unique(shapes.polygon_part)] = "polygon"
        for part in range(len(kinds)):
            alone = render(
                shapes._replace(
                    ellipsoid_semi_axes=np.where(
                        (shapes.ellipsoid_part == part)[:, None], shapes.ellipsoid_semi_axes, 1e-6
                    ),
                    corners=np.where(
                        np.repeat(shapes.polygon_part == part, np.diff(shapes.start))[:, None], shapes.corners, 0
                    ),
                ),
                posed,
                camera(),
                FLAT,
            )
            covering = whole.part[(alone.part == part) & (whole.part != part)]
            occlusions |= {(kinds[other], kinds[part]) for other in np.unique(covering)}
    assert occlusions == {(a, b) for a in ("ellipsoid", "polygon") for b in ("ellipsoid", "polygon")}


@pytest.mark.parametrize("centre", [(0.0, 0.0, 5.0), (0.8, -0.5, 4.0), (-1.0, 0.9, 3.0)])
def test_a_sphere_covers_the_pixels_whose_centres_lie_in_its_cone(centre):
    radius, seen_by = 0.4, axis_camera()
    shapes, posed = at_origin(one_part(Ellipsoid(np.full(3, radius)), centre))
    u, v = np.meshgrid(np.arange(seen_by.size[0]), np.arange(seen_by.size[1]))
    rays = np.stack([(u - 40) / 100, (v - 30) / 100, np.ones(u.shape)], axis=-1)
    along = rays @ np.array(centre) / np.linalg.norm(rays, axis=-1)
    inside = np.array(centre) @ np.array(centre) - along**2 <= radius**2
    assert inside.any()
    assert np.array_equal(render(shapes, posed, seen_by, FLAT).mask, inside)


def test_a_square_facing_the_camera_covers_whole_pixels_up_to_its_edge():
    shapes, posed = at_origin(one_part(Box(np.array([0.101, 0.061, 0.2])), (0.0, 0.0, 1.1)))
    drawn = render(shapes, posed, axis_camera(), FLAT)
    v, u = np.nonzero(drawn.mask)  # the near face is 1 m away: half sides of 5.05 and 3.05 px about pixel (40, 30)
    assert (u.min(), u.max(), v.min(), v.max()) == (35, 45, 27, 33)
    assert drawn.mask.sum() == 11 * 7
    np.testing.assert_allclose(drawn.inverse_depth[drawn.mask], 1, rtol=SOLVED)


def test_a_box_that_reaches_behind_the_camera_is_cut_not_lost():
    beam = one_part(Box(np.array([0.3, 0.2, 6.0])), (0.3, 0.35, 0.5), Rotation.from_rotvec([0.1, -0.2, 0.3]))
    shapes, posed = at_origin(beam)
    assert shapes.corners[:, 2].min() < 0 < shapes.corners[:, 2].max()
    cast = render_reference(shapes, posed, axis_camera(), LIGHTS)
    assert cast.mask.sum() > 100
    assert_same_maps(render(shapes, posed, axis_camera(), LIGHTS), cast)


@pytest.mark.parametrize("centre_z", [0.0, 0.3, -3.0], ids=["around the camera", "across its plane", "behind it"])
def test_an_ellipsoid_that_is_not_wholly_in_front_is_left_out(centre_z):
    shapes, posed = at_origin(one_part(Ellipsoid(np.array([0.5, 0.6, 0.7])), (0.1, 0.0, centre_z)))
    drawn = render(shapes, posed, axis_camera(), FLAT)
    assert not drawn.mask.any() and not render_reference(shapes, posed, axis_camera(), FLAT).mask.any()


def test_a_body_outside_the_image_draws_nothing():
    shapes, posed = at_origin(one_part(Ellipsoid(np.array([0.5, 0.6, 0.7])), (10.0, 0.0, 5.0)))
    assert not render(shapes, posed, axis_camera(), FLAT).mask.any()


def cut_at(whole: BodyModel, heights: list[float]) -> BodyModel:
    (segment,) = whole.segments
    return replace(whole, segments=(replace(segment, parts=in_slabs(segment.parts[0], heights)),))


@pytest.mark.parametrize("seed", range(20))
def test_slabs_of_one_ellipsoid_cover_it_without_a_gap_each_where_its_heights_are_hit(seed):
    heights = [-0.3, 0.1, 0.35]
    rng = np.random.default_rng(seed)
    place = (*rng.normal(0, 0.4, 2), rng.uniform(2, 6)), Rotation.random(rng=rng)
    model = one_part(Ellipsoid(rng.uniform(0.4, 0.6, 3)), *place)
    slabs, cut = at_origin(cut_at(model, heights))
    whole, drawn = render(*at_origin(model), axis_camera(), FLAT), render(slabs, cut, axis_camera(), FLAT)
    assert whole.mask.sum() > 100
    assert np.array_equal(drawn.mask, whole.mask)
    np.testing.assert_allclose(drawn.inverse_depth, whole.inverse_depth, rtol=SOLVED)
    v, u = np.nonzero(drawn.mask)
    hits = np.stack([(u - 40) / 100, (v - 30) / 100, np.ones(len(u))], axis=1) / drawn.inverse_depth[v, u][:, None]
    height = cut.model.parts[0].segment_from_part.inv().apply(hits)[:, 2]
    slab = np.searchsorted(heights, height)
    is_clear = np.abs(height[:, None] - heights).min(axis=1) > 1e-4  # float32 depths place the rest on either side
    assert np.array_equal(drawn.part[v, u][is_clear], slab[is_clear])
    assert len(np.unique(slab)) >= 2


def test_a_slab_seen_along_its_axis_is_a_disc_or_a_ring():
    upside_down = Rotation.from_euler("X", 180, degrees=True)
    ball = one_part(Ellipsoid(np.full(3, 0.5)), (0.0, 0.0, 4.0), upside_down)
    row = render(*at_origin(cut_at(ball, [-0.2, 0.2, 0.4])), axis_camera(focal=300.0), FLAT).part[30]
    runs = row[np.append(True, np.diff(row) != 0)]
    assert list(runs[runs >= 0]) == [1, 2, 3, 2, 1]  # the lowest part is occluded by the ellipsoid itself


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 31.0])
def test_a_slab_whose_border_is_seen_edge_on_ends_in_a_straight_line(turn_deg):
    direction = np.array([-np.sin(np.radians(turn_deg)), np.cos(np.radians(turn_deg)), 0])  # part's z, in the image
    turn = Rotation.from_matrix(np.stack([np.cross([0, 0, 1], direction), [0, 0, 1.0], direction], axis=1))
    whole = one_part(Ellipsoid(np.array([0.5, 0.4, 0.6])), (0.0, 0.0, 3.0), turn)
    drawn = render(*at_origin(cut_at(whole, [0.0])), axis_camera(size=(80, 60)), FLAT)  # the plane holds the camera
    v, u = np.nonzero(drawn.mask)
    along = (u - 39.5) * direction[0] + (v - 29.5) * direction[1]
    assert np.array_equal(drawn.part[v, u], (along > 0).astype(int))


def test_a_smooth_mesh_of_a_ball_is_lit_as_a_ball():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.5)
    vertices, faces = np.asarray(ball.vertices), np.asarray(ball.faces)
    meshes = [Mesh(vertices, faces, normals) for normals in (None, vertices / 0.5)]
    pictures = [
        render(*at_origin(one_part(shape, (0.2, 0.1, 4.0))), axis_camera(focal=200.0), LIGHTS)
        for shape in (Ellipsoid(np.full(3, 0.5)), *meshes)
    ]
    inside = np.logical_and.reduce([picture.mask for picture in pictures])
    assert inside.sum() > 1500
    true, flat, smooth = (picture.colour[inside] for picture in pictures)
    errors = [np.quantile(np.abs(each - true), 0.99) for each in (flat, smooth)]  # outlines differ a little
    assert errors[0] > 2
    assert errors[1] < 0.6


def test_no_pixel_falls_between_the_faces_of_a_mesh():
    grid = np.arange(-20, 21) / 100  # every face meets its neighbours along rows and columns of pixels
    x, y = np.meshgrid(grid, grid)
    corner = (np.arange(40)[:, None] * 41 + np.arange(40)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 41, corner + 1], 1), np.stack([corner + 1, corner + 41, corner + 42], 1)]
    )
    sheet = Mesh(np.stack([x.ravel(), y.ravel(), np.ones(x.size)], 1), faces)
    K = np.array([[100.0, 0, 40], [0, 100, 30], [0, 0, 1]])
    for slant in np.linspace(0, 0.3, 7):
        turned = Rotation.from_rotvec([0.0, slant, 0.0])
        seen_by = Camera(name="axis", K=K, size=(81, 61), camera_from_world=RigidTransform.from_rotation(turned))
        mask = render(*at_origin(one_part(sheet)), seen_by, FLAT).mask
        v, u = np.nonzero(mask)
        assert all(mask[row, u[v == row].min() : u[v == row].max() + 1].all() for row in np.unique(v))
        assert mask.sum() > 1000


def test_flat_light_shows_each_part_in_its_own_colour():
    shapes, posed = posed_random(KINDS["a mixture"], 1)
    drawn = render(shapes, posed, camera(), FLAT)
    np.testing.assert_allclose(drawn.colour[drawn.mask], shapes.colours[drawn.part[drawn.mask]], rtol=SOLVED)


def test_a_region_is_a_cut_out_of_the_whole():
    shapes, posed = posed_random(KINDS["a mixture"], 2)
    whole = render(shapes, posed, camera(), LIGHTS)
    part = render(shapes, posed, camera(), LIGHTS, region=(30, 20, 57, 200))
    assert part.region == (30, 20, 57, 70)
    assert part.mask.any()
    assert np.array_equal(part.part, whole.part[20:70, 30:57])
    np.testing.assert_allclose(part.colour, whole.colour[20:70, 30:57], atol=GREY)
    np.testing.assert_allclose(part.inverse_depth, whole.inverse_depth[20:70, 30:57], rtol=SOLVED)


def test_a_distorted_camera_is_refused():
    shapes, posed = posed_random(["box"], 0)
    bent = Camera(
        name="bent",
        K=camera().K,
        size=camera().size,
        camera_from_world=camera().camera_from_world,
        distortion=np.array([0.1, 0, 0, 0, 0]),
    )
    with pytest.raises(CalibrationError, match="bent"):
        render(shapes, posed, bent, FLAT)
