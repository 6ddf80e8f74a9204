"""Surface meshes against geometry in closed form, and their textures."""

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Sphere
from flysim.worlds.surface.atlas import atlas_patches, atlas_pixels, atlas_points, atlas_size
from flysim.worlds.surface.mesh import segments, surface_mesh, write_obj

SHAPES = [
    Box((0.4, 0.3, 0.35)),
    Box((0.1, 5.0, 1.2)),
    Cylinder(0.5, 0.7),
    Cylinder(0.03, 0.9),
    Sphere(0.25),
    Plane((8.0, 6.0)),
]
SOLIDS = SHAPES[:-1]
lengths = st.floats(0.01, 5.0)


def corners(mesh):
    return mesh.vertices.astype(float)[mesh.faces]


def face_normals(mesh):
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def welded(mesh):
    """The mesh as one closed surface: vertices that differ in normal or texture alone are one."""
    points, index = np.unique(np.round(mesh.vertices, 5), axis=0, return_inverse=True)
    return trimesh.Trimesh(points, index.reshape(-1)[mesh.faces], process=False)


@pytest.mark.parametrize("shape", SOLIDS, ids=repr)
def test_solids_are_closed_with_the_right_area_and_volume(shape):
    mesh = welded(surface_mesh(shape))
    if isinstance(shape, Box):
        x, y, z = shape.size
        area, volume = 2.0 * (x * y + y * z + z * x), x * y * z
    elif isinstance(shape, Cylinder):
        r, h = shape.radius, shape.length
        area, volume = math.tau * r * (r + h), math.pi * r * r * h
    else:
        area, volume = 4.0 * math.pi * shape.radius**2, 4.0 / 3.0 * math.pi * shape.radius**3
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.area == pytest.approx(area, rel=5e-3)
    assert mesh.volume == pytest.approx(volume, rel=5e-3)  # positive: faces turn counter-clockwise from outside


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_normals_are_unit_outward_and_flat_or_smooth(shape):
    mesh = surface_mesh(shape)
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0, abs=1e-6)
    cosine = np.einsum("fij,fj->fi", mesh.normals[mesh.faces].astype(float), face_normals(mesh))
    assert cosine.min() > (1.0 - 1e-6 if isinstance(shape, Box | Plane) else 0.99)
    if isinstance(shape, Sphere):
        assert mesh.normals == pytest.approx(mesh.vertices / shape.radius, abs=1e-6)


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_vertices_lie_on_the_shape_and_reach_its_extremes(shape):
    mesh = surface_mesh(shape)
    assert shape.distance(mesh.vertices.astype(float)).max() < 1e-6
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx(np.ptp(shape.outline(), axis=0), abs=1e-6)


@pytest.mark.parametrize("radius", [0.01, 0.1, 0.5, 3.0])
def test_a_cylinder_is_round_to_a_tenth_of_a_millimetre(radius):
    mesh = surface_mesh(Cylinder(radius, 1.0))
    middles = corners(mesh).reshape(-1, 3)
    side = np.abs(mesh.normals[mesh.faces][:, 0, 2]) < 0.5
    edge = corners(mesh)[side]
    for i in range(3):
        middles = np.concatenate([middles, (edge[:, i] + edge[:, (i + 1) % 3]) / 2.0])
    on_side = np.hypot(*middles[len(corners(mesh)) * 3 :, :2].T)
    assert radius - on_side.min() <= 1.001e-4
    assert on_side.max() <= radius + 1e-6


def test_a_sphere_is_round_to_two_tenths_of_a_millimetre():
    middles = corners(surface_mesh(Sphere(0.5))).mean(axis=1)
    assert 0.5 - np.linalg.norm(middles, axis=1).min() < 2e-4


def test_segments_are_bounded():
    assert segments(1e-5) == segments(1e-3) == 24
    assert segments(1e3) == 720
    assert segments(0.5) % 4 == 0


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_textures_are_not_mirrored_and_stay_inside(shape):
    mesh = surface_mesh(shape)
    assert mesh.uv.min() >= 0.0
    assert mesh.uv.max() <= 1.0
    a, b, c = np.moveaxis(mesh.uv.astype(float)[mesh.faces], 1, 0)
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert turn.min() > 0.0  # counter-clockwise on the surface is counter-clockwise in the picture


@settings(max_examples=60, deadline=None)
@given(x=lengths, y=lengths, z=lengths)
def test_a_boxs_faces_share_no_texel_and_have_one_scale(x, y, z):
    box = Box((x, y, z))
    mesh, size = surface_mesh(box), np.array(atlas_size(box))
    flat = mesh.uv.astype(float)[mesh.faces] * size
    for points, texels in zip(corners(mesh), flat, strict=True):
        for i in range(3):
            true = np.linalg.norm(points[i] - points[i - 1])
            assert np.linalg.norm(texels[i] - texels[i - 1]) == pytest.approx(true, rel=1e-3, abs=1e-5)
    rectangles = [(f.reshape(-1, 2).min(0), f.reshape(-1, 2).max(0)) for f in flat.reshape(6, -1, 2)]
    for i, (low, high) in enumerate(rectangles):
        for other_low, other_high in rectangles[:i]:
            overlap = np.minimum(high, other_high) - np.maximum(low, other_low)
            assert (overlap < 1e-4 * size.max()).any()


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_patches_do_not_overlap(shape):
    patches = atlas_patches(shape)
    for i, a in enumerate(patches):
        for b in patches[:i]:
            overlap = [
                min(a.origin[k] + a.size[k], b.origin[k] + b.size[k]) - max(a.origin[k], b.origin[k]) for k in range(2)
            ]
            assert min(overlap) <= 1e-9


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_each_texel_shows_the_point_that_the_mesh_puts_there(shape):
    mesh = surface_mesh(shape)
    width, height = 700, 500
    points = atlas_points(shape, width, height)
    uv = mesh.uv.astype(float)[mesh.faces].mean(axis=1)
    column, row = (uv[:, 0] * width).astype(int), ((1.0 - uv[:, 1]) * height).astype(int)
    texel = np.max(np.array(atlas_size(shape)) / (width, height))
    off = np.linalg.norm(points[row, column] - corners(mesh).mean(axis=1), axis=1)
    assert off.max() < 1.5 * texel + 2e-4


def test_the_texture_of_a_long_wall_is_not_as_high_as_the_wall_is_long():
    assert atlas_size(Box((0.1, 5.0, 1.2))) == pytest.approx((10.2, 1.3))
    assert atlas_pixels(Box((0.1, 5.0, 1.2)), 0.01) == (1020, 130)


def file_mesh(uv=None):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    return Mesh(vertices=vertices, faces=faces.astype(np.int32), uv=uv, path=None)


def test_a_file_mesh_keeps_its_texture_coordinates():
    uv = np.array([[0, 0], [3, 0], [0, -1], [1, 1]], float)
    mesh = surface_mesh(file_mesh(uv))
    assert mesh.uv[:3] == pytest.approx(uv[[0, 2, 1]])
    assert welded(mesh).volume == pytest.approx(1.0 / 6.0)
    assert mesh.normals[0] == pytest.approx([0, 0, -1])


def test_a_file_mesh_without_texture_coordinates_gets_its_bounding_boxs():
    mesh = surface_mesh(file_mesh())
    assert mesh.uv.min() >= 0.0
    assert mesh.uv.max() <= 1.0
    assert np.ptp(mesh.uv, axis=0).min() > 0.3


def test_records_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        surface_mesh(SHAPES[0]).vertices[0] = 0.0


def test_obj_round_trip(tmp_path):
    mesh = surface_mesh(Cylinder(0.2, 0.5))
    pixels = np.arange(45, dtype=np.uint8).reshape(3, 5, 3)  # rows that are no multiple of 4 bytes
    path = write_obj(mesh, pixels, (1.0, 0.0, 0.0), tmp_path / "part_1.obj")
    assert path == tmp_path / "part_1.obj"
    with Image.open(tmp_path / "part_1.bmp") as image:
        assert np.array_equal(np.asarray(image), pixels)
    material = (tmp_path / "part_1.mtl").read_text().splitlines()
    assert "Kd 1 1 1" in material
    assert "map_Kd part_1.bmp" in material
    lines = [line.split() for line in path.read_text().splitlines()]

    def rows(head):
        return np.array([[float(w) for w in line[1:]] for line in lines if line[0] == head], np.float32)

    assert np.array_equal(rows("v"), mesh.vertices)
    assert np.array_equal(rows("vt"), mesh.uv)
    assert rows("vn") == pytest.approx(mesh.normals, abs=1e-6)
    faces = [[w.split("/") for w in line[1:]] for line in lines if line[0] == "f"]
    assert np.array_equal(np.array(faces, int)[..., 0] - 1, mesh.faces)
    assert all(len(set(corner)) == 1 for face in faces for corner in face)


def test_obj_without_texture_has_the_colour(tmp_path):
    write_obj(surface_mesh(SHAPES[0]), None, (0.25, 0.5, 1.0), tmp_path / "plain.obj")
    material = (tmp_path / "plain.mtl").read_text()
    assert "Kd 0.25 0.5 1\n" in material
    assert "map_Kd" not in material
    assert not (tmp_path / "plain.bmp").exists()


def test_tiny_renderer_draws_the_texture_the_right_way_round(tmp_path):
    pybullet = pytest.importorskip("pybullet")
    # Four quarters: red and green above, blue and white below, on the +x side of a box seen from +x.
    box = Box((0.5, 1.0, 1.0))
    width, height = atlas_pixels(box, 0.01)
    picture = np.zeros((height, width, 3), np.uint8)
    points = atlas_points(box, width, height)
    front = np.isclose(points[..., 0], 0.25)
    left, above = points[..., 1] < 0.0, points[..., 2] > 0.0
    picture[front & left & above] = (200, 0, 0)
    picture[front & ~left & above] = (0, 200, 0)
    picture[front & left & ~above] = (0, 0, 200)
    picture[front & ~left & ~above] = (200, 200, 200)
    path = write_obj(surface_mesh(box), picture, (1.0, 1.0, 1.0), tmp_path / "quarters.obj")
    client = pybullet.connect(pybullet.DIRECT)
    try:
        shape = pybullet.createVisualShape(pybullet.GEOM_MESH, fileName=str(path), physicsClientId=client)
        pybullet.createMultiBody(0, -1, shape, physicsClientId=client)
        image = pybullet.getCameraImage(
            80,
            80,
            pybullet.computeViewMatrix([2.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            pybullet.computeProjectionMatrixFOV(40.0, 1.0, 0.1, 10.0),
            lightDirection=[1.0, 0.0, 0.0],
            lightSpecularCoeff=0,
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=client,
        )
    finally:
        pybullet.disconnect(client)
    rgb = np.reshape(image[2], (80, 80, 4))[..., :3].astype(int)
    assert np.argmax(rgb[25, 25]) == 0
    assert np.argmax(rgb[25, 55]) == 1
    assert np.argmax(rgb[55, 25]) == 2
    assert np.ptp(rgb[55, 55]) < 5 < rgb[55, 55].min()
