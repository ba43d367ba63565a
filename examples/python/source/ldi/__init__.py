"""Turns one photo into a 3D photo.

Most results are NumPy arrays over the library's own memory. photo3d() runs the whole pipeline; clean_depth(), lift(), expand(), inpaint(),
grow_past_frame(), make_charts(), make_atlas() and make_mesh() are its stages. Each stage returns a new value.
"""
from ._api import clean_depth, depth_network, expand, grow_past_frame, inpaint, inpainting_network, lift, make_atlas, make_charts, make_mesh, photo3d, read_photo, silhouette_network, write_png
from ._errors import Error, FileError, InputError
from ._ldi import Atlas, Chart, Charts, Curve, Depth, DepthNetwork, InpaintingNetwork, Layer, Layers, Mesh, Photo3D, SilhouetteNetwork
from ._ldi import version as __version__

__all__ = [
    "Atlas", "Chart", "Charts", "Curve", "Depth", "DepthNetwork", "Error", "FileError", "InpaintingNetwork", "InputError", "Layer", "Layers", "Mesh", "Photo3D",
    "SilhouetteNetwork",
    "clean_depth", "depth_network", "expand", "grow_past_frame", "inpaint", "inpainting_network", "lift", "make_atlas", "make_charts", "make_mesh", "photo3d", "read_photo", "silhouette_network", "write_png",
]
