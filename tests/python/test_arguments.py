"""Calls every entry point with arguments of the wrong type, shape or value, and with arrays in every memory layout."""
import re
from pathlib import Path

import ldi
import numpy as np
import pytest
from scenes import layouts_of, scene

PHOTO, DEPTH = scene(48, 64)
LAYER = ldi.lift(ldi.clean_depth(PHOTO, DEPTH))
LAYERS = ldi.expand(LAYER)
MADE = ldi.photo3d(PHOTO, DEPTH, inpaint="diffusion")


def check_message(raised, *words):
    """Checks that a message is short and has the argument's name, the expected and the actual value."""
    text = str(raised.value)
    assert len(re.sub(r"/\S+", "PATH", text)) < 160 and "\n" not in text and "ldi._ldi" not in text, text
    assert re.match(r".+: expected .+, found .+", text), text
    for word in words:
        assert word in text, (word, text)


def png_of(picture, folder):
    ldi.write_png(folder / "picture.png", picture)
    return ldi.read_photo(folder / "picture.png").tobytes()


# Name of the argument, and a call that returns a result to compare.
TAKES_PHOTO = {
    "photo3d": ("photo", lambda photo, folder: ldi.photo3d(photo, DEPTH, inpaint="diffusion").glb()),
    "clean_depth": ("photo", lambda photo, folder: ldi.clean_depth(photo, DEPTH).disparity.tobytes()),
    "DepthNetwork": ("photo", lambda photo, folder: ldi.depth_network()(photo).tobytes()),
    "write_png": ("picture", png_of),
}
TAKES_DEPTH = {
    "photo3d": ("depth", lambda depth: ldi.photo3d(PHOTO, depth, inpaint="diffusion").glb()),
    "clean_depth": ("depth", lambda depth: ldi.clean_depth(PHOTO, depth).disparity.tobytes()),
    "photo3d, function": ("depth(photo)", lambda depth: ldi.photo3d(PHOTO, lambda photo: depth, inpaint="diffusion").glb()),
    "clean_depth, function": ("depth(photo)", lambda depth: ldi.clean_depth(PHOTO, lambda photo: depth).disparity.tobytes()),
}
TAKES_COLORS = {
    "photo3d": lambda colors: ldi.photo3d(PHOTO, DEPTH, inpaint=lambda layers: colors(layers)),
    "inpaint": lambda colors: ldi.inpaint(LAYERS, lambda layers: colors(layers)),
}

WRONG_TYPES = {
    "None": lambda a: None,
    "a string": lambda a: "photo.jpg",
    "a list of strings": lambda a: ["a", "b"],
    "objects": lambda a: a.astype(object),
    "complex": lambda a: a.astype(complex),
    "bool": lambda a: a.astype(bool),
    "dates": lambda a: a.astype("datetime64[s]"),
    "a dictionary": lambda a: {},
}
NOT_BYTES = {
    "uint16": lambda a: a.astype(np.uint16),
    "int8": lambda a: a.astype(np.int8),
    "int64": lambda a: a.astype(np.int64),
    "float32": lambda a: a.astype(np.float32),
    "float64": lambda a: a / 255.0,
    "a list": lambda a: a.tolist(),
}
WRONG_SHAPES = {
    "no dimension": lambda a: a.ravel()[0],
    "one dimension": lambda a: a.ravel(),
    "four dimensions": lambda a: a[None].reshape(1, *a.shape[:2], -1),
    "no rows": lambda a: a[:0],
    "no columns": lambda a: a[:, :0],
    "no values": lambda a: np.zeros((0, 0), a.dtype),
    "two channels": lambda a: np.zeros((*a.shape[:2], 2), a.dtype),
    "four channels": lambda a: np.zeros((*a.shape[:2], 4), a.dtype),
    "no channels": lambda a: np.zeros((*a.shape[:2], 0), a.dtype),
    "channels first": lambda a: np.zeros((3, *a.shape[:2]), a.dtype),
}


@pytest.mark.parametrize("entry", TAKES_PHOTO)
@pytest.mark.parametrize("kind", {**WRONG_TYPES, **NOT_BYTES})
def test_photo_of_wrong_type(entry, kind, tmp_path):
    name, call = TAKES_PHOTO[entry]
    with pytest.raises(TypeError) as raised:
        call({**WRONG_TYPES, **NOT_BYTES}[kind](PHOTO), tmp_path)
    check_message(raised, name, "uint8")


@pytest.mark.parametrize("entry", TAKES_PHOTO)
@pytest.mark.parametrize("kind", WRONG_SHAPES)
def test_photo_of_wrong_shape(entry, kind, tmp_path):
    name, call = TAKES_PHOTO[entry]
    with pytest.raises(ldi.InputError) as raised:
        call(WRONG_SHAPES[kind](PHOTO), tmp_path)
    check_message(raised, name)
    assert raised.value.where == name and raised.value.code == "mismatch"


@pytest.mark.parametrize("entry", ["photo3d", "clean_depth", "DepthNetwork"])
def test_photo_without_channels_is_no_photo(entry, tmp_path):
    with pytest.raises(ldi.InputError, match="found 48 x 64 values of uint8"):
        TAKES_PHOTO[entry][1](PHOTO[:, :, 0], tmp_path)


@pytest.mark.parametrize("entry", TAKES_PHOTO)
@pytest.mark.parametrize("layout", layouts_of(PHOTO))
def test_photo_in_every_layout(entry, layout, tmp_path):
    call = TAKES_PHOTO[entry][1]
    assert call(layouts_of(PHOTO)[layout], tmp_path) == call(PHOTO, tmp_path)


@pytest.mark.parametrize("entry", TAKES_PHOTO)
def test_photo_that_repeats_one_row(entry, tmp_path):
    repeated = np.broadcast_to(PHOTO[20], PHOTO.shape)
    call = TAKES_PHOTO[entry][1]
    assert call(repeated, tmp_path) == call(repeated.copy(), tmp_path)


@pytest.mark.parametrize("entry", TAKES_DEPTH)
@pytest.mark.parametrize("kind", WRONG_TYPES)
def test_depth_of_wrong_type(entry, kind):
    name, call = TAKES_DEPTH[entry]
    if kind == "None" and "function" not in entry:
        pytest.skip("None requests the network")
    with pytest.raises(TypeError) as raised:
        call(WRONG_TYPES[kind](DEPTH))
    check_message(raised, name + ": ", "real numbers")


@pytest.mark.parametrize("entry", TAKES_DEPTH)
@pytest.mark.parametrize("kind", WRONG_SHAPES)
def test_depth_of_wrong_shape(entry, kind):
    name, call = TAKES_DEPTH[entry]
    with pytest.raises(ldi.InputError) as raised:
        call(WRONG_SHAPES[kind](DEPTH))
    check_message(raised, name)


@pytest.mark.parametrize("entry", TAKES_DEPTH)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_depth_without_a_finite_value(entry, value):
    with pytest.raises(ldi.InputError, match="depth: expected .+, found .+") as raised:
        TAKES_DEPTH[entry][1](np.full_like(DEPTH, value))
    check_message(raised)


@pytest.mark.parametrize("entry", TAKES_DEPTH)
def test_depth_of_other_proportions(entry):
    with pytest.raises(ldi.InputError, match="depth: expected the proportions of the photo, 64 x 48, found 40 x 48"):
        TAKES_DEPTH[entry][1](DEPTH[:, :40])


@pytest.mark.parametrize("entry", TAKES_DEPTH)
@pytest.mark.parametrize("layout", layouts_of(DEPTH))
def test_depth_in_every_layout(entry, layout):
    call = TAKES_DEPTH[entry][1]
    assert call(layouts_of(DEPTH)[layout]) == call(DEPTH)


@pytest.mark.parametrize("entry", TAKES_DEPTH)
@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", ">u2", ">i4", "f2", "f4", "f8", "g", ">f4", ">f8"])
def test_depth_of_every_real_type(entry, kind):
    """Disparity may have any scale and shift, so integers are as valid as fractions."""
    whole = np.where(DEPTH > 0.5, 100, 20)
    call = TAKES_DEPTH[entry][1]
    assert call(whole.astype(kind)) == call(whole.astype(np.float32))


@pytest.mark.parametrize("entry", TAKES_DEPTH)
def test_depth_may_be_a_list_or_have_one_channel(entry):
    call = TAKES_DEPTH[entry][1]
    assert call(DEPTH.tolist()) == call(DEPTH) == call(DEPTH[:, :, None])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_depth_with_unknown_values_is_filled_in(value):
    holes = DEPTH.copy()
    holes[:3] = value
    assert ldi.clean_depth(PHOTO, holes).disparity.tobytes() == ldi.clean_depth(PHOTO, DEPTH).disparity.tobytes()


def test_a_masked_array_has_unknown_values():
    values = DEPTH.copy()
    values[:3] = 99
    masked = np.ma.MaskedArray(values, mask=values == 99)
    for given in (masked, lambda photo: masked):
        assert ldi.clean_depth(PHOTO, given).disparity.tobytes() == ldi.clean_depth(PHOTO, DEPTH).disparity.tobytes()


@pytest.mark.parametrize("size", [(1, 1), (1, 2), (2, 1), (1, 40), (40, 1), (3, 3), (17, 5)])
def test_photos_of_few_pixels(size):
    photo = np.arange(3 * size[0] * size[1], dtype=np.uint8).reshape(*size, 3)
    for depth in (np.ones(size), np.arange(size[0] * size[1]).reshape(size), None):
        made = ldi.photo3d(photo, depth)
        assert made.photo.shape == photo.shape and made.glb()[:4] == b"glTF"


@pytest.mark.parametrize("entry", TAKES_COLORS)
@pytest.mark.parametrize("kind", {**WRONG_TYPES, **NOT_BYTES})
def test_colors_of_wrong_type(entry, kind):
    with pytest.raises(TypeError) as raised:
        TAKES_COLORS[entry](lambda layers: {**WRONG_TYPES, **NOT_BYTES}[kind](layers.color))
    check_message(raised, "inpaint(layers): ", "uint8")


@pytest.mark.parametrize("entry", TAKES_COLORS)
@pytest.mark.parametrize("change", [lambda c: c[:-1], lambda c: np.vstack([c, c[:1]]), lambda c: c[:, :2], lambda c: c[:, 0], lambda c: c.ravel(), lambda c: c[None], lambda c: c[:0], lambda c: c[0, 0]])
def test_colors_of_wrong_shape(entry, change):
    with pytest.raises(ldi.InputError) as raised:
        TAKES_COLORS[entry](lambda layers: change(layers.color))
    check_message(raised, "inpaint(layers): ", " x 3 values of uint8")


@pytest.mark.parametrize("entry", TAKES_COLORS)
@pytest.mark.parametrize("layout", layouts_of(LAYERS.color))
def test_colors_in_every_layout(entry, layout):
    def pattern(layers):
        return layouts_of(np.arange(3 * len(layers)).astype(np.uint8).reshape(-1, 3))[layout]

    result = TAKES_COLORS[entry](pattern)
    assert (result if entry == "inpaint" else result.layers).color.shape[1] == 3


# Every numeric option: a call with it, and its range.
NUMBERS = {
    ("photo3d", "long_side"): (lambda v: ldi.photo3d(PHOTO, DEPTH, long_side=v), 1, 16384, True),
    ("photo3d", "focal_length"): (lambda v: ldi.photo3d(PHOTO, DEPTH, focal_length=v), 1, 10000, False),
    ("photo3d", "motion"): (lambda v: ldi.photo3d(PHOTO, DEPTH, motion=v), 0, 1, False),
    ("photo3d", "texture"): (lambda v: ldi.photo3d(PHOTO, DEPTH, texture=v), 0, 4, False),
    ("photo3d", "grain"): (lambda v: ldi.photo3d(PHOTO, DEPTH, grain=v), 0, 4, False),
    ("photo3d", "threads"): (lambda v: ldi.photo3d(PHOTO, DEPTH, threads=v), 0, 1024, True),
    ("clean_depth", "long_side"): (lambda v: ldi.clean_depth(PHOTO, DEPTH, long_side=v), 1, 16384, True),
    ("clean_depth", "threads"): (lambda v: ldi.clean_depth(PHOTO, DEPTH, threads=v), 0, 1024, True),
    ("lift", "focal_length"): (lambda v: ldi.lift(MADE.depth, v), 1, 10000, False),
    ("lift", "threads"): (lambda v: ldi.lift(MADE.depth, threads=v), 0, 1024, True),
    ("expand", "motion"): (lambda v: ldi.expand(LAYER, v), 0, 1, False),
    ("inpaint", "texture"): (lambda v: ldi.inpaint(LAYERS, texture=v), 0, 4, False),
    ("inpaint", "grain"): (lambda v: ldi.inpaint(LAYERS, grain=v), 0, 4, False),
    ("inpaint", "threads"): (lambda v: ldi.inpaint(LAYERS, threads=v), 0, 1024, True),
    ("make_atlas", "threads"): (lambda v: ldi.make_atlas(MADE.layers, MADE.charts, threads=v), 0, 1024, True),
    ("make_mesh", "threads"): (lambda v: ldi.make_mesh(MADE.layers, MADE.charts, MADE.atlas, threads=v), 0, 1024, True),
    ("DepthNetwork", "threads"): (lambda v: ldi.depth_network()(PHOTO, threads=v), 0, 1024, True),
    ("InpaintingNetwork", "threads"): (lambda v: ldi.inpainting_network()(LAYERS, threads=v), 0, 1024, True),
    ("glb", "quality"): (lambda v: MADE.glb(v), 1, 100, True),
    ("html", "quality"): (lambda v: MADE.html(quality=v), 1, 100, True),
    ("render", "width"): (lambda v: MADE.render(width=v), 1, 16384, True),
    ("render", "samples"): (lambda v: MADE.render(samples=v), 1, 8, True),
    ("render", "threads"): (lambda v: MADE.render(threads=v), 0, 1024, True),
}


@pytest.mark.parametrize("entry", NUMBERS, ids=".".join)
@pytest.mark.parametrize("value", ["1", b"1", [1], (), {}, 1j, True, np.True_, np.array([1, 2]), object()], ids=repr)
def test_option_of_wrong_type(entry, value):
    with pytest.raises(TypeError) as raised:
        NUMBERS[entry][0](value)
    check_message(raised, entry[1] + ": ")


@pytest.mark.parametrize("entry", NUMBERS, ids=".".join)
def test_option_out_of_range(entry):
    call, low, high, is_integer = NUMBERS[entry]
    wrong = [low - 1, high + 1, -(10**30), 10**30] if is_integer else [low - 0.001, high * 1.001, np.nan, np.inf, -np.inf, -1e300, np.float32("inf")]
    for value in wrong:
        with pytest.raises(ldi.InputError) as raised:
            call(value)
        check_message(raised, entry[1] + ": ", f"from {low} to {high}")
        assert raised.value.code == "invalid option" and raised.value.where == entry[1]
    if is_integer:
        with pytest.raises(TypeError):
            call(low + 0.5)


@pytest.mark.parametrize("entry", [e for e in NUMBERS if e[1] not in ("threads", "long_side", "width")], ids=".".join)
def test_option_at_the_ends_of_its_range(entry):
    call, low, high, is_integer = NUMBERS[entry]
    for value in (low, high):
        call(np.int64(value) if is_integer else np.float64(value))


@pytest.mark.parametrize("name", ["position", "target"])
def test_points(name):
    for value in ("abc", None if name == "position" else "x", {}, ["a", "b", "c"], [1j, 0, 0], np.array([True, False, True])):
        with pytest.raises(TypeError) as raised:
            MADE.render(**{name: value})
        check_message(raised, name + ": ")
    for value in ((), (1, 2), (1, 2, 3, 4), [[0, 0, 1]], (0, 0, np.nan), (np.inf, 0, 0), 5):
        with pytest.raises(ldi.InputError) as raised:
            MADE.render(**{name: value})
        check_message(raised, name + ": ", "three finite numbers")
    for target in ((1, 2, 3), (1, 4, 3), (1, -1, 3)):
        with pytest.raises(ldi.InputError, match="target: .*straight above or below"):
            MADE.render((1, 2, 3), target)
    with pytest.raises(ldi.InputError, match="straight above or below"):
        MADE.render((0, 0, 0), (1e-60, 1, 0))
    with pytest.raises(ldi.InputError, match="three finite numbers"):
        MADE.render((1e300, 0, 0))
    assert (MADE.render(np.array([0.01, 0, 0]), np.array([0, 0, -2.0])) == MADE.render([0.01, 0, 0], (0, 0, -2))).all()


CHOICES = {
    "depth_kind": lambda v: ldi.photo3d(PHOTO, DEPTH, depth_kind=v),
    "depth_kind of clean_depth": lambda v: ldi.clean_depth(PHOTO, DEPTH, depth_kind=v),
    "inpaint": lambda v: ldi.photo3d(PHOTO, DEPTH, inpaint=v),
    "silhouettes": lambda v: ldi.photo3d(PHOTO, DEPTH, silhouettes=v),
    "silhouettes of clean_depth": lambda v: ldi.clean_depth(PHOTO, DEPTH, silhouettes=v),
    "inpaint of inpaint": lambda v: ldi.inpaint(LAYERS, v),
    "arithmetic": lambda v: ldi.inpainting_network(arithmetic=v),
}


@pytest.mark.parametrize("name", CHOICES)
def test_choices(name):
    with pytest.raises(ldi.InputError) as raised:
        CHOICES[name]("magic")
    check_message(raised, name.split()[0] + ": ", "'magic'")
    for value in (None, 3, b"network", ["network"]):
        with pytest.raises(TypeError) as raised:
            CHOICES[name](value)
        check_message(raised, name.split()[0] + ": ")


def test_progress_and_title():
    for value in (3, "progress", []):
        with pytest.raises(TypeError) as raised:
            ldi.photo3d(PHOTO, DEPTH, progress=value)
        check_message(raised, "progress: ")
    for value in (3, None, b"me"):
        with pytest.raises(TypeError) as raised:
            MADE.html(value)
        check_message(raised, "title: ")


STAGES = {
    "lift": (lambda v: ldi.lift(v), "depth: expected ldi.Depth"),
    "expand": (lambda v: ldi.expand(v), "layer: expected ldi.Layer,"),
    "inpaint": (lambda v: ldi.inpaint(v), "layers: expected ldi.Layers"),
    "grow_past_frame": (lambda v: ldi.grow_past_frame(v), "layers: expected ldi.Layers"),
    "make_charts": (lambda v: ldi.make_charts(v), "layers: expected ldi.Layers"),
    "make_atlas, layers": (lambda v: ldi.make_atlas(v, MADE.charts), "layers: expected ldi.Layers"),
    "make_atlas, charts": (lambda v: ldi.make_atlas(MADE.layers, v), "charts: expected ldi.Charts"),
    "make_mesh, layers": (lambda v: ldi.make_mesh(v, MADE.charts, MADE.atlas), "layers: expected ldi.Layers"),
    "make_mesh, charts": (lambda v: ldi.make_mesh(MADE.layers, v, MADE.atlas), "charts: expected ldi.Charts"),
    "make_mesh, atlas": (lambda v: ldi.make_mesh(MADE.layers, MADE.charts, v), "atlas: expected ldi.Atlas"),
    "InpaintingNetwork": (lambda v: ldi.inpainting_network()(v), "layers: expected ldi.Layers"),
    "Photo3D, layers": (lambda v: ldi.Photo3D(v, MADE.charts, MADE.atlas, MADE.mesh), "layers: expected ldi.Layers"),
    "Photo3D, charts": (lambda v: ldi.Photo3D(MADE.layers, v, MADE.atlas, MADE.mesh), "charts: expected ldi.Charts"),
    "Photo3D, atlas": (lambda v: ldi.Photo3D(MADE.layers, MADE.charts, v, MADE.mesh), "atlas: expected ldi.Atlas"),
    "Photo3D, mesh": (lambda v: ldi.Photo3D(MADE.layers, MADE.charts, MADE.atlas, v), "mesh: expected ldi.Mesh"),
}


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("value", [None, "x", 3, PHOTO, MADE, MADE.curves, ldi.Layers], ids=["None", "str", "int", "array", "Photo3D", "list", "class"])
def test_stages_refuse_other_values(stage, value):
    call, text = STAGES[stage]
    with pytest.raises(TypeError) as raised:
        call(value)
    check_message(raised, text)


@pytest.mark.parametrize("call", [lambda: ldi.expand(LAYERS), lambda: ldi.inpaint(LAYER), lambda: ldi.make_charts(LAYER)])
def test_stages_in_the_wrong_order_are_refused(call):
    with pytest.raises(TypeError) as raised:
        call()
    check_message(raised)


@pytest.mark.parametrize("call", [
    lambda other: ldi.make_atlas(other.layers, MADE.charts),
    lambda other: ldi.make_mesh(other.layers, MADE.charts, MADE.atlas),
    lambda other: ldi.make_mesh(MADE.layers, other.charts, MADE.atlas),
    lambda other: ldi.make_mesh(MADE.layers, MADE.charts, other.atlas),
    lambda other: ldi.Photo3D(other.layers, MADE.charts, MADE.atlas, MADE.mesh),
    lambda other: ldi.Photo3D(MADE.layers, MADE.charts, MADE.atlas, other.mesh),
])
def test_parts_of_different_photos_are_refused_together(call):
    with pytest.raises(ldi.InputError) as raised:
        call(ldi.photo3d(*scene(40, 64), inpaint="diffusion"))
    check_message(raised, "one result of expand()")


# Paths ----------------------------------------------------------------------------------------------------------------------------

MODELS = Path(ldi.__file__).parent / "models"
READS = {
    "read_photo": lambda path: ldi.read_photo(path),
    "depth_network": lambda path: ldi.depth_network(path),
    "inpainting_network": lambda path: ldi.inpainting_network(path),
    "silhouette_network": lambda path: ldi.silhouette_network(path),
}


@pytest.fixture
def files(tmp_path):
    ldi.write_png(tmp_path / "read_photo", PHOTO)
    (tmp_path / "depth_network").write_bytes((MODELS / "tiefenrausch_small.safetensors").read_bytes())
    (tmp_path / "silhouette_network").write_bytes((MODELS / "silhouettes.safetensors").read_bytes())
    (tmp_path / "inpainting_network").write_bytes((MODELS / "farbrausch.safetensors").read_bytes())
    return tmp_path


class AnyPath:
    """An os.PathLike that is not a pathlib.Path."""

    def __init__(self, path):
        self.path = path

    def __fspath__(self):
        return self.path


@pytest.mark.parametrize("entry", READS)
@pytest.mark.parametrize("kind", [str, Path, bytes, AnyPath])
def test_paths(entry, kind, files):
    path = str(files / entry)
    assert READS[entry](path.encode() if kind is bytes else kind(path)) is not None


@pytest.mark.parametrize("kind", [str, Path, bytes, AnyPath])
def test_paths_to_write_to(kind, tmp_path):
    path = str(tmp_path / "ü.png")
    ldi.write_png(path.encode() if kind is bytes else kind(path), PHOTO)
    assert (ldi.read_photo(path) == PHOTO).all()


@pytest.mark.parametrize("entry", READS)
def test_paths_that_lead_nowhere(entry, files):
    for path in (files / "missing", files, files / "read_photo" / "below", str(files / "missing")):
        with pytest.raises(ldi.FileError) as raised:
            READS[entry](path)
        check_message(raised, str(path))
        assert isinstance(raised.value, OSError) and raised.value.filename == str(path)
    (files / "text").write_text("no photo, no weights")
    with pytest.raises(ldi.InputError) as raised:
        READS[entry](files / "text")
    check_message(raised, str(files / "text"))
    (files / "empty").touch()
    with pytest.raises(ldi.InputError):
        READS[entry](files / "empty")


@pytest.mark.parametrize("entry", [e for e in READS] + ["write_png"])
def test_values_that_are_no_paths_are_refused(entry, tmp_path):
    call = READS.get(entry, lambda path: ldi.write_png(path, PHOTO))
    for path in (3.5, ["photo.jpg"], object()) + (() if entry.endswith("network") else (None,)):
        with pytest.raises(TypeError) as raised:
            call(path)
        assert len(str(raised.value)) < 150
    for path in ("photo\0.jpg", b"photo\0.jpg"):
        with pytest.raises(ValueError) as raised:
            call(path)
        assert len(str(raised.value)) < 150
    for path in (str(tmp_path / "a\udcff"), bytes(tmp_path) + b"/\xff"):  # not UTF-8
        if entry == "write_png":
            call(path)
            assert (ldi.read_photo(path) == PHOTO).all()
        else:
            with pytest.raises(ldi.FileError):
                call(path)


def test_a_picture_that_cannot_be_written(tmp_path):
    with pytest.raises(ldi.FileError) as raised:
        ldi.write_png(tmp_path / "no folder" / "picture.png", PHOTO)
    check_message(raised, "no folder")


@pytest.mark.parametrize("network", [ldi.DepthNetwork, ldi.InpaintingNetwork, ldi.SilhouetteNetwork])
def test_weights(network):
    for weights in (None, "weights", 3, [1], PHOTO):
        with pytest.raises(TypeError, match="weights: expected bytes, found") as raised:
            network(weights)
        check_message(raised)
    for weights in (b"", b"nothing", bytes(1000)):
        with pytest.raises(ldi.InputError):
            network(weights)


@pytest.mark.parametrize("wrong", ["no", 0, 1, None])
def test_flags_must_be_true_or_false(wrong):
    for call in (lambda: ldi.photo3d(PHOTO, DEPTH, depth_is_inverse=wrong), lambda: ldi.clean_depth(PHOTO, DEPTH, depth_is_inverse=wrong)):
        with pytest.raises(TypeError) as raised:
            call()
        check_message(raised, "depth_is_inverse: expected True or False, found ")
    with pytest.raises(TypeError):
        MADE.glb(compress=wrong)


@pytest.mark.parametrize("options", [{"depth_kind": "meters"}, {"depth_is_inverse": True}])
def test_the_result_of_a_network_has_no_other_meaning(options):
    with pytest.raises(ldi.InputError) as raised:
        ldi.clean_depth(PHOTO, **options)
    check_message(raised, next(iter(options)) + ": expected no other meaning for the result of a network")


def test_a_changed_file_of_a_network_is_read_again(files):
    (files / "changed").write_bytes((files / "depth_network").read_bytes())
    ldi.depth_network(files / "changed")
    (files / "changed").write_bytes(b"junk")
    with pytest.raises(ldi.InputError):
        ldi.depth_network(files / "changed")


def test_a_network_is_read_once_per_file(files, monkeypatch):
    assert ldi.depth_network() is ldi.depth_network()
    monkeypatch.chdir(files)
    first = ldi.depth_network("depth_network")
    assert ldi.depth_network(files / "depth_network") is first
    (files / "other").mkdir()
    monkeypatch.chdir(files / "other")
    with pytest.raises(ldi.FileError):  # same name, other file
        ldi.depth_network("depth_network")
