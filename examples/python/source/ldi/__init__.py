"""One photograph in, a 3D photo out, as NumPy arrays that show the library's own memory."""
import functools
import os

from ._ldi import Chart, Curve, DepthNetwork, Error, InpaintingNetwork, Layers, Mesh, Photo3D, read_photo, write_png
from ._ldi import photo3d as _photo3d

__all__ = ["Chart", "Curve", "DepthNetwork", "Error", "InpaintingNetwork", "Layers", "Mesh", "Photo3D", "depth_network", "inpainting_network", "photo3d", "read_photo", "write_png"]

_MODELS = os.path.join(os.path.dirname(__file__), "models")


@functools.lru_cache(maxsize=4)
def depth_network(path=os.path.join(_MODELS, "tiefenrausch_small.safetensors")):
    """The network that estimates depth; read once."""
    with open(path, "rb") as weights:
        return DepthNetwork(weights.read(), str(path))


@functools.lru_cache(maxsize=4)
def inpainting_network(path=os.path.join(_MODELS, "farbrausch.safetensors"), arithmetic="float32"):
    """The network that colors hidden surfaces; read once."""
    with open(path, "rb") as weights:
        return InpaintingNetwork(weights.read(), str(path), arithmetic)


def photo3d(photo, depth=None, *, depth_kind="disparity", depth_is_inverse=False, inpaint="network", long_side=1536, focal_length=26.0, motion=0.08, grain=0.6, threads=0, progress=None):
    """Turns a photo into a 3D photo.

    photo             H x W x 3 uint8; rows may have gaps, nothing is copied then
    depth             h x w, of the photo's proportions, NaN where it is not known; None: by depth_network()
    depth_kind        "disparity", larger is nearer, or "meters"
    depth_is_inverse  the disparity is 1 / distance up to scale, without a shift
    inpaint           "network", "diffusion", or an InpaintingNetwork
    focal_length      35 mm equivalent, in millimeters
    threads           0: as many as the machine has
    progress          progress(stage, fraction); an exception it raises ends the work, as Ctrl-C does
    """
    if depth_kind not in ("disparity", "meters"):
        raise ValueError(f'depth_kind: expected "disparity" or "meters", found {depth_kind!r}')
    if isinstance(inpaint, str) and inpaint not in ("network", "diffusion"):
        raise ValueError(f'inpaint: expected "network", "diffusion" or an InpaintingNetwork, found {inpaint!r}')
    colors = None if inpaint == "diffusion" else inpainting_network() if inpaint == "network" else inpaint
    return _photo3d(photo, depth, None if depth is not None else depth_network(), colors, depth_kind == "meters", depth_is_inverse, long_side, focal_length, motion, grain, threads, progress)
