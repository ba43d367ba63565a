"""The stages one by one, and the arrays that they return."""
import ldi
import numpy as np
import pytest
from scenes import scene

PHOTO, DEPTH = scene()
ARRAYS = {
    ldi.Depth: ("photo", "estimated", "disparity"),
    ldi.Layer: ("left", "right", "up", "down", "color", "disparity", "known"),
    ldi.Layers: ("left", "right", "up", "down", "color", "disparity", "known"),
    ldi.Curve: ("sides",),
    ldi.Charts: ("chart_of",),
    ldi.Atlas: ("color", "placements"),
    ldi.Mesh: ("positions", "texture_coordinates", "pixels", "triangles"),
}
COPIES = {ldi.Layer: ("x", "y"), ldi.Layers: ("x", "y"), ldi.Chart: ("pixels",)}


def names_of(kind):
    return ARRAYS.get(kind, ()) + COPIES.get(kind, ())


@pytest.fixture(scope="module")
def made():
    return ldi.photo3d(PHOTO, DEPTH)


def stages(photo, depth=None, inpaint="network", **options):
    cleaned = ldi.clean_depth(photo, depth, **options)
    layer = ldi.lift(cleaned)
    layers = ldi.grow_past_frame(ldi.inpaint(ldi.expand(layer), inpaint))
    charts = ldi.make_charts(layers)
    atlas = ldi.make_atlas(layers, charts)
    return ldi.Photo3D(layers, charts, atlas, ldi.make_mesh(layers, charts, atlas))


def results():
    cleaned = ldi.clean_depth(PHOTO, DEPTH)
    layer = ldi.lift(cleaned)
    layers = ldi.expand(layer)
    charts = ldi.make_charts(layers)
    atlas = ldi.make_atlas(layers, charts)
    return [cleaned, layer, layer.curves[0], layers, charts, charts[0], atlas, ldi.make_mesh(layers, charts, atlas)]


@pytest.mark.parametrize("depth", [None, DEPTH, DEPTH[::4, ::4], lambda photo: DEPTH], ids=["network", "map", "coarse map", "function"])
@pytest.mark.parametrize("inpaint", ["network", "diffusion", lambda layers: 255 - layers.color], ids=["network", "diffusion", "function"])
def test_stages_give_the_same_result_as_photo3d(depth, inpaint):
    assert stages(PHOTO, depth, inpaint).glb() == ldi.photo3d(PHOTO, depth, inpaint=inpaint).glb()


def test_the_network_decides_silhouettes_where_depth_is_coarser_than_the_photo():
    def made(depth, **options):
        glb = ldi.photo3d(PHOTO, depth, inpaint="diffusion", **options).glb()
        assert glb == stages(PHOTO, depth, "diffusion", **options).glb()
        return glb

    coarse = DEPTH[::4, ::4]
    assert made(coarse) == made(coarse, silhouettes="network") == made(coarse, silhouettes=ldi.silhouette_network())
    assert made(coarse) != made(coarse, silhouettes="alignment")
    assert made(DEPTH) == made(DEPTH, silhouettes="alignment")


def test_options_of_stages_are_those_of_photo3d():
    depth = ldi.clean_depth(PHOTO, 1 / DEPTH, depth_kind="meters", long_side=100)
    layers = ldi.grow_past_frame(ldi.inpaint(ldi.expand(ldi.lift(depth, 40), 0.2), "diffusion", texture=0.5, grain=2))
    whole = ldi.photo3d(PHOTO, 1 / DEPTH, depth_kind="meters", long_side=100, focal_length=40, motion=0.2, inpaint="diffusion", texture=0.5, grain=2).layers
    for name in names_of(ldi.Layers) + ("focal_length", "z_near", "z_far", "width", "height", "margin"):
        assert np.array_equal(getattr(layers, name), getattr(whole, name)), name
    assert whole.width == 100 and len(layers) > len(ldi.expand(ldi.lift(depth), 0.05))


def test_layers_grow_past_the_frame_at_most_once(made):
    cropped = ldi.photo3d(PHOTO, DEPTH, frame="crop").layers
    assert cropped.margin == 0 and cropped.width == made.layers.width == PHOTO.shape[1]
    margin = made.layers.margin
    assert margin > 4 and made.layers.x.max() < PHOTO.shape[1] + 2 * margin
    inside = (made.layers.x >= margin) & (made.layers.x < margin + PHOTO.shape[1]) & (made.layers.y >= margin) & (made.layers.y < margin + PHOTO.shape[0])
    assert inside.sum() == len(cropped) and np.array_equal(np.sort(made.layers.disparity[inside]), np.sort(cropped.disparity))
    with pytest.raises(ldi.InputError, match="border"):
        ldi.grow_past_frame(made.layers)


def test_stages_do_not_change_their_arguments(made):
    parts = [made.depth, ldi.lift(made.depth), made.layers, made.charts, made.atlas]
    before = [[getattr(part, name).copy() for name in names_of(type(part))] for part in parts]
    ldi.expand(parts[1])
    ldi.inpaint(made.layers, lambda layers: 255 - layers.color)
    ldi.make_mesh(made.layers, ldi.make_charts(made.layers), ldi.make_atlas(made.layers, made.charts))
    after = [[getattr(part, name) for name in names_of(type(part))] for part in parts]
    assert all(np.array_equal(a, b) for part_a, part_b in zip(before, after) for a, b in zip(part_a, part_b))


def test_layers_can_be_inpainted_again(made):
    again = ldi.inpaint(made.layers, lambda layers: np.zeros((len(layers), 3), np.uint8), texture=0, grain=0)
    assert (again.color[again.known == 0] == 0).all() and not np.shares_memory(again.color, made.layers.color)
    assert (again.color[again.known == 1] == made.layers.color[again.known == 1]).all()


def root_of(array):
    """Returns the object that owns an array's memory."""
    while isinstance(array, np.ndarray):
        array = array.base
    return array


KINDS = (ldi.Depth, ldi.Layer, ldi.Curve, ldi.Layers, ldi.Charts, ldi.Chart, ldi.Atlas, ldi.Mesh)


@pytest.mark.parametrize("index", range(8), ids=[kind.__name__ for kind in KINDS])
def test_positions_and_the_pixels_of_a_chart_are_copies_in_int32_that_nobody_can_change(index):
    owner = results()[index]
    for name in COPIES.get(type(owner), ()):
        array, again = getattr(owner, name), getattr(owner, name)
        assert array.dtype == np.int32 and len(array) > 0 and np.array_equal(array, again) and not np.shares_memory(array, again), name
        with pytest.raises(ValueError):
            array[...] = 0


@pytest.mark.parametrize("index", range(8), ids=[kind.__name__ for kind in KINDS])
def test_arrays_show_the_memory_of_their_owner(index):
    owner = results()[index]
    for name in ARRAYS.get(type(owner), ()):
        array = getattr(owner, name)
        assert root_of(array) is owner and np.shares_memory(array, getattr(owner, name)), name
        with pytest.raises(ValueError):
            array[...] = 0


@pytest.mark.parametrize("index", range(8))
def test_arrays_outlive_their_owner(index):
    owner = results()[index]
    arrays = [(getattr(owner, name), getattr(owner, name).copy()) for name in names_of(type(owner))]
    del owner
    for _ in range(3):
        results()
    assert all((array == copy).all() for array, copy in arrays)


def test_arrays_of_a_photo3d_belong_to_its_parts(made):
    assert root_of(made.photo) is made.depth and root_of(made.disparity) is made.depth
    assert made.layers is made.layers and made.mesh is made.mesh  # one object per array, not per access
    assert np.shares_memory(made.curves[0].sides, made.curves[0].sides)


def test_shapes_and_relations(made):
    layers, mesh = made.layers, made.mesh
    assert made.photo.shape == (96, 128, 3) and made.disparity.shape == (96, 128) and len(layers) > 96 * 128
    assert (layers.width, layers.height) == (128, 96)
    assert layers.color.shape == (len(layers), 3) and layers.known.min() == 0
    linked = layers.right >= 0
    assert (layers.left[layers.right[linked]] == np.flatnonzero(linked)).all() and (layers.x[layers.right[linked]] == layers.x[linked] + 1).all()
    assert made.charts.chart_of.max() == len(made.charts) - 1 and sum(len(chart.pixels) for chart in made.charts) == len(layers)
    assert made.atlas.placements.shape == (len(made.charts), 2) and 0 < made.atlas.fill <= 1
    chart, (x, y) = made.charts[-1], made.atlas.placements[-1]
    texels = made.atlas.color[layers.y[chart.pixels] - chart.y + y, layers.x[chart.pixels] - chart.x + x]
    assert (texels == layers.color[chart.pixels]).all()
    assert mesh.triangles.max() == len(mesh.positions) - 1 and mesh.texture_coordinates.shape == (len(mesh.positions), 2)
    assert 0 <= mesh.texture_coordinates.min() and mesh.texture_coordinates.max() <= 1 and mesh.positions[:, 2].max() < 0
    far, near = made.curves[0].sides.T
    assert (made.disparity.ravel()[near] > made.disparity.ravel()[far]).all()


def test_charts_are_a_sequence(made):
    assert len(list(made.charts)) == len(made.charts) and (made.charts[0].pixels == made.charts[-len(made.charts)].pixels).all()
    for index in (len(made.charts), -len(made.charts) - 1):
        with pytest.raises(IndexError):
            made.charts[index]


def test_a_layer_is_the_photo(made):
    layer = ldi.lift(made.depth)
    assert (layer.x + 128 * layer.y == np.arange(96 * 128)).all() and layer.depth is made.depth
    assert (layer.disparity.reshape(96, 128) == made.disparity).all() and len(layer.curves) == len(made.curves)


def test_depth_in_meters_stays_in_meters():
    meters = 1 / DEPTH
    meters[:4], meters[-4:] = np.nan, np.inf
    meters[4:6] = -1
    depth = ldi.clean_depth(PHOTO, meters, depth_kind="meters")
    assert depth.z_near == pytest.approx(1, rel=0.01) and depth.z_far == pytest.approx(5, rel=0.2)


def test_depth_by_the_network():
    depth = ldi.clean_depth(PHOTO)
    assert depth.disparity.min() >= 0 and 0.9 < depth.disparity.max() <= 1 and depth.disparity.shape == (96, 128)


def test_zero_disparity_is_far_away():
    """In maps of 1 / distance, 0 means infinitely far, such as the sky, and not an unknown value."""
    depth = ldi.clean_depth(PHOTO, np.where(DEPTH > 0.5, 1.0, 0.0), depth_is_inverse=True)
    assert depth.disparity.min() == 0 and depth.disparity.max() == 1 and depth.z_far > 10 * depth.z_near
