"""The functions of the package, which check options and call the extension."""
import functools
import numbers
import os

import numpy as np

from . import _ldi
from ._errors import FileError, InputError
from ._ldi import Atlas, Chart, Charts, Curve, Depth, DepthNetwork, InpaintingNetwork, Layer, Layers, Mesh, Photo3D, SilhouetteNetwork

_FOLDER = os.path.dirname(os.path.abspath(__file__))


def _number(name, value, low, high, kind=numbers.Real):
    expected = f"{'an integer' if kind is numbers.Integral else 'a number'} from {low} to {high}"
    if not isinstance(value, kind) or isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name}: expected {expected}, found {type(value).__name__}")
    if not low <= value <= high:
        raise InputError("invalid option", name, expected, repr(value))
    return int(value) if kind is numbers.Integral else float(value)


def _integer(name, value, low, high):
    return _number(name, value, low, high, numbers.Integral)


def _instance(name, value, kind):
    if not isinstance(value, kind):
        raise TypeError(f"{name}: expected ldi.{kind.__name__}, found {type(value).__name__}")
    return value


def _choice(name, value, choices):
    if not isinstance(value, str):
        raise TypeError(f"{name}: expected a string, found {type(value).__name__}")
    if value not in choices:
        raise InputError("invalid option", name, " or ".join(repr(c) for c in choices), repr(value))
    return value


def _point(name, value):
    point = np.asarray(value)
    if point.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected three numbers, found {type(value).__name__}")
    with np.errstate(over="ignore"):
        point = point.astype(np.float32)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InputError("invalid option", name, "three finite numbers", repr(value))
    return [float(coordinate) for coordinate in point]


def _threads(value):
    return _integer("threads", value, 0, 1024)


def _flag(name, value):
    """Returns an argument that must be True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name}: expected True or False, found {type(value).__name__}")
    return bool(value)


def _unmasked(depth):
    """Replaces masked values with NaN."""
    return depth.astype(np.float32).filled(np.nan) if isinstance(depth, np.ma.MaskedArray) else depth


def _depth(depth, kind, is_inverse):
    """Returns (depth, is_metric, is_inverse), the arguments of the extension's functions."""
    _choice("depth_kind", kind, ("disparity", "meters"))
    is_inverse = _flag("depth_is_inverse", is_inverse)
    if depth is None:
        depth = depth_network()
    elif callable(depth) and not isinstance(depth, DepthNetwork):
        estimate, depth = depth, lambda photo: _unmasked(estimate(photo))
    if isinstance(depth, DepthNetwork) and (kind != "disparity" or is_inverse):
        option, value = ("depth_kind", kind) if kind != "disparity" else ("depth_is_inverse", is_inverse)
        raise InputError("invalid option", option, "no other meaning for the result of a network", repr(value))
    return _unmasked(depth), kind == "meters", is_inverse


def _inpainter(inpaint):
    """Returns the extension's inpainter; None for diffusion."""
    if isinstance(inpaint, InpaintingNetwork) or callable(inpaint):
        return inpaint
    if not isinstance(inpaint, str):
        raise TypeError(f'inpaint: expected "network", "diffusion", an ldi.InpaintingNetwork or a function, found {type(inpaint).__name__}')
    return inpainting_network() if _choice("inpaint", inpaint, ("network", "diffusion")) == "network" else None


def _silhouettes(silhouettes):
    """Returns the extension's network; None for alignment."""
    if isinstance(silhouettes, SilhouetteNetwork):
        return silhouettes
    if not isinstance(silhouettes, str):
        raise TypeError(f'silhouettes: expected "network", "alignment" or an ldi.SilhouetteNetwork, found {type(silhouettes).__name__}')
    return silhouette_network() if _choice("silhouettes", silhouettes, ("network", "alignment")) == "network" else None


def _progress(progress):
    if progress is not None and not callable(progress):
        raise TypeError(f"progress: expected a function or None, found {type(progress).__name__}")
    return progress


def _path(path):
    """Encodes a path for the system."""
    path = os.fsencode(path)
    if b"\0" in path:
        raise InputError("invalid option", "path", "a path without NUL characters", repr(path))
    return path


def _weights(path, default):
    return os.path.join(os.fsencode(_FOLDER), b"models", default) if path is None else os.path.abspath(_path(path))


def _network(kind, path, *options):
    """Reads a network, once per file and change of the file."""
    try:
        status = os.stat(path)
        version = status.st_mtime_ns, status.st_size
    except OSError:
        version = None  # reading reports the reason
    return _network_of(kind, path, version, *options)


@functools.lru_cache(maxsize=4)
def _network_of(kind, path, version, *options):
    name = path.decode("utf-8", "backslashreplace")
    try:
        with open(path, "rb") as file:
            weights = file.read()
    except OSError as failure:
        raise FileError("file access", name, "a readable file", failure.strerror) from failure
    return kind(weights, name, *options)


def depth_network(path=None):
    """Reads the network that estimates depth, once per file.

    path  a safetensors file; None: the network of this package
    """
    return _network(DepthNetwork, _weights(path, b"tiefenrausch_small.safetensors"))


def inpainting_network(path=None, *, arithmetic="float32"):
    """Reads the network that colors hidden surfaces, once per file.

    path        a safetensors file; None: the network of this package
    arithmetic  "float32", or "int8", which is faster and less exact
    """
    _choice("arithmetic", arithmetic, ("float32", "int8"))
    return _network(InpaintingNetwork, _weights(path, b"farbrausch.safetensors"), arithmetic)


def silhouette_network(path=None):
    """Reads the network that decides silhouettes, once per file.

    path  a safetensors file; None: the network of this package
    """
    return _network(SilhouetteNetwork, _weights(path, b"silhouettes.safetensors"))


def photo3d(photo, depth=None, *, depth_kind="disparity", depth_is_inverse=False, silhouettes="network", inpaint="network", long_side=1536, focal_length=26.0, motion=0.08, frame="grow", texture=1.0, grain=0.6, threads=0, progress=None):
    """Turns a photo into a 3D photo.

    photo             H x W x 3 uint8; not copied if the pixels of each row are contiguous in memory
    depth             h x w numbers, a map with the photo's aspect ratio, NaN where unknown; a DepthNetwork; a function
                      from the photo to such a map; None: depth_network()
    depth_kind        "disparity", larger is nearer, or "meters"
    depth_is_inverse  the disparity is 1 / distance up to a factor, without a shift
    silhouettes       "network" or a SilhouetteNetwork: decides which pixels beside a silhouette belong to the surface in front,
                      where the depth is coarser than the photo; "alignment": moves silhouettes onto edges of the photo
    inpaint           "network", "diffusion", an InpaintingNetwork, or a function from Layers to K x 3 uint8 colors, of
                      which only those of pixels with known == 0 are used
    long_side         larger photos are shrunk to this many pixels, 1 to 16384
    focal_length      35 mm equivalent, in millimeters
    motion            maximum parallax between the nearest and the farthest surface, as a share of the long side, 0 to 1
    frame             "grow": surfaces continue past the photo's border as far as the motion uncovers them, and pages show the
                      whole photo; "crop": they end there, and pages hide the border
    texture, grain    strength of the photo's texture and of noise on inpainted surfaces, 0 to 4
    threads           0: one per processor
    progress          called as progress(stage, fraction); an exception it raises ends the work, as Ctrl-C does
    """
    depth, is_metric, is_inverse = _depth(depth, depth_kind, depth_is_inverse)
    return _ldi.photo3d(
        photo, depth, is_metric, is_inverse, _silhouettes(silhouettes), _inpainter(inpaint), _integer("long_side", long_side, 1, 16384), _number("focal_length", focal_length, 1, 10000),
        _number("motion", motion, 0, 1), _choice("frame", frame, ("grow", "crop")) == "grow", _number("texture", texture, 0, 4), _number("grain", grain, 0, 4), _threads(threads), _progress(progress))


def clean_depth(photo, depth=None, *, depth_kind="disparity", depth_is_inverse=False, silhouettes="network", long_side=1536, threads=0):
    """Stage 1: estimates depth, resamples it to the photo's resolution, and sharpens its edges. Returns a Depth.

    The arguments are those of photo3d().
    """
    depth, is_metric, is_inverse = _depth(depth, depth_kind, depth_is_inverse)
    return _ldi.clean_depth(photo, depth, is_metric, is_inverse, _silhouettes(silhouettes), _integer("long_side", long_side, 1, 16384), _threads(threads))


def lift(depth, focal_length=26.0, *, threads=0):
    """Stage 2: turns a photo with Depth into a Layer, whose pixels are not linked across silhouettes.

    focal_length  35 mm equivalent, in millimeters
    """
    return _ldi.lift(_instance("depth", depth, Depth), _number("focal_length", focal_length, 1, 10000), _threads(threads))


def expand(layer, motion=0.08):
    """Stage 3: grows hidden surfaces behind the silhouettes of a Layer. Returns Layers; hidden pixels have no color yet.

    motion  maximum parallax between the nearest and the farthest surface, as a share of the long side, 0 to 1
    """
    return _ldi.expand(_instance("layer", layer, Layer), _number("motion", motion, 0, 1))


def inpaint(layers, inpaint="network", *, texture=1.0, grain=0.6, threads=0):
    """Stage 4: colors the pixels with known == 0. Returns new Layers.

    The arguments are those of photo3d().
    """
    return _ldi.inpaint(_instance("layers", layers, Layers), _inpainter(inpaint), _number("texture", texture, 0, 4), _number("grain", grain, 0, 4), _threads(threads))


def grow_past_frame(layers):
    """Stage 5: continues inpainted Layers past the photo's border, as far as their motion uncovers them. Returns new Layers with a margin.

    Without it, surfaces end at the photo's border, as with photo3d(frame="crop").
    """
    return _ldi.grow_past_frame(_instance("layers", layers, Layers))


def make_charts(layers):
    """Stage 6: cuts Layers into Charts, in each of which no two pixels share a position."""
    return _ldi.make_charts(_instance("layers", layers, Layers))


def make_atlas(layers, charts, *, threads=0):
    """Stage 7: packs Charts into one texture. Returns an Atlas."""
    return _ldi.make_atlas(_instance("layers", layers, Layers), _instance("charts", charts, Charts), _threads(threads))


def make_mesh(layers, charts, atlas, *, threads=0):
    """Stage 8: triangulates the charts and places their vertices in space. Returns a Mesh."""
    return _ldi.make_mesh(_instance("layers", layers, Layers), _instance("charts", charts, Charts), _instance("atlas", atlas, Atlas), _threads(threads))


def read_photo(path):
    """Reads a photo as H x W x 3 uint8, upright, in sRGB: JPEG, PNG, GIF, BMP, and more where the package was built for it."""
    return _ldi.read_photo(_path(path))


def write_png(path, picture):
    """Writes H x W or H x W x 3 uint8 to a PNG file."""
    _ldi.write_png(_path(path), picture)


def _method(cls, name=None):
    """Adds a function to a class of the extension."""

    def add(function):
        function.__name__ = name or function.__name__
        function.__qualname__ = f"{cls.__name__}.{function.__name__}"
        function.__module__ = "ldi"
        setattr(cls, function.__name__, function)
        return function

    return add


@_method(DepthNetwork, "__call__")
def _call_depth_network(self, photo, *, threads=0):
    """Returns disparity for a photo H x W x 3 uint8: h x w float32, larger is nearer, known up to a factor."""
    return _ldi.estimate(self, photo, _threads(threads))


@_method(InpaintingNetwork, "__call__")
def _call_inpainting_network(self, layers, *, threads=0):
    """Returns the colors of Layers, inpainted where known is 0: K x 3 uint8."""
    return _ldi.inpaint_colors(self, _instance("layers", layers, Layers), _threads(threads))


@_method(Photo3D)
def glb(self, quality=85, *, compress=False):
    """Returns the bytes of a GLB file.

    quality   JPEG quality of the texture, 1 to 100
    compress  reduces the file to a third to two thirds, for viewers that support EXT_meshopt_compression and EXT_texture_webp
    """
    return _ldi.glb(self, _integer("quality", quality, 1, 100), _flag("compress", compress))


@_method(Photo3D)
def html(self, title="3D photo", *, quality=85, compress=False):
    """Returns an HTML page that shows the 3D photo: one file without external resources.

    title              title of the page
    quality, compress  as for glb()
    """
    if not isinstance(title, str):
        raise TypeError(f"title: expected a string, found {type(title).__name__}")
    title = title.encode("utf-8", "replace").decode()  # replaces lone surrogates, which UTF-8 cannot encode
    return _ldi.html(self, os.fsencode(os.path.join(_FOLDER, "viewer.html")), title, _integer("quality", quality, 1, 100), _flag("compress", compress))


@_method(Photo3D)
def render(self, position=(0, 0, 0), target=None, width=None, *, samples=2, threads=0):
    """Returns a picture from another viewpoint, H x W x 3 uint8.

    position  of the camera; the photo's camera is at the origin and looks along -z
    target    the point that the camera looks at; None: it looks along -z
    width     in pixels, 1 to 16384; None: the photo's
    samples   per pixel and axis, 1 to 8
    """
    position = _point("position", position)
    if target is not None:
        target = _point("target", target)
        if (target[0], target[2]) == (position[0], position[2]):
            raise InputError("invalid option", "target", "a point that is not straight above or below position", repr(tuple(target)))
    width = None if width is None else _integer("width", width, 1, 16384)
    return _ldi.render(self, position, target, width, _integer("samples", samples, 1, 8), _threads(threads))


def _add_repr(cls, text):
    _method(cls, "__repr__")(lambda self: f"<ldi.{cls.__name__}: {text(self)}>")


_add_repr(Depth, lambda d: f"{d.disparity.shape[1]} x {d.disparity.shape[0]} pixels from {d.estimated.shape[1]} x {d.estimated.shape[0]} samples")
_add_repr(Curve, lambda c: f"{len(c)} pixel sides{', closed' if c.is_closed else ''}")
_add_repr(Layer, lambda s: f"{s.width} x {s.height} pixels, {len(s.curves)} curves")
_add_repr(Layers, lambda s: f"{s.width} x {s.height}, {len(s)} pixels")
_add_repr(Chart, lambda c: f"{c.width} x {c.height} at ({c.x}, {c.y}), {len(c.pixels)} pixels")
_add_repr(Charts, lambda c: f"{len(c)} charts of {len(c.chart_of)} pixels")
_add_repr(Atlas, lambda a: f"{a.color.shape[1]} x {a.color.shape[0]} texels, {100 * a.fill:.0f} % filled")
_add_repr(Mesh, lambda m: f"{len(m.positions)} vertices, {len(m.triangles)} triangles")
_add_repr(Photo3D, lambda p: f"{p.layers.width} x {p.layers.height}, {len(p.charts)} charts, {len(p.mesh.triangles)} triangles")
_add_repr(DepthNetwork, lambda n: "disparity from a photo")
_add_repr(InpaintingNetwork, lambda n: "colors of hidden surfaces")
_add_repr(SilhouetteNetwork, lambda n: "sides of silhouettes")

for _class in (Atlas, Chart, Charts, Curve, Depth, DepthNetwork, InpaintingNetwork, Layer, Layers, Mesh, Photo3D, SilhouetteNetwork):
    _class.__module__ = "ldi"
for _function in (clean_depth, depth_network, expand, grow_past_frame, inpaint, inpainting_network, lift, make_atlas, make_charts, make_mesh, photo3d, read_photo, silhouette_network, write_png):
    _function.__module__ = "ldi"
