import os
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

class Error(Exception):
    code: str
    where: str
    expected: str
    found: str

class DepthNetwork:
    def __init__(self, weights: bytes, name: str = ...) -> None: ...

class InpaintingNetwork:
    def __init__(self, weights: bytes, name: str = ..., arithmetic: str = ...) -> None: ...

class Layers:
    x: NDArray[np.int32]
    y: NDArray[np.int32]
    left: NDArray[np.int32]
    right: NDArray[np.int32]
    up: NDArray[np.int32]
    down: NDArray[np.int32]
    color: NDArray[np.uint8]
    disparity: NDArray[np.float32]
    known: NDArray[np.uint8]
    focal_length: float
    z_near: float
    z_far: float
    def __len__(self) -> int: ...

class Curve:
    sides: NDArray[np.int32]
    is_closed: bool

class Chart:
    x: int
    y: int
    width: int
    height: int
    pixels: NDArray[np.int32]

class Mesh:
    positions: NDArray[np.float32]
    texture_coordinates: NDArray[np.float32]
    pixels: NDArray[np.int32]
    triangles: NDArray[np.uint32]

class Photo3D:
    photo: NDArray[np.uint8]
    estimated: NDArray[np.float32]
    disparity: NDArray[np.float32]
    atlas: NDArray[np.uint8]
    chart_of: NDArray[np.int32]
    layers: Layers
    mesh: Mesh
    curves: list[Curve]
    charts: list[Chart]
    def glb(self, quality: int = ...) -> bytes: ...
    def render(self, position: Sequence[float] = ..., target: Sequence[float] | None = ..., width: int | None = ..., samples: int = ...) -> NDArray[np.uint8]: ...

def depth_network(path: str | os.PathLike[str] = ...) -> DepthNetwork: ...
def inpainting_network(path: str | os.PathLike[str] = ..., arithmetic: Literal["float32", "int8"] = ...) -> InpaintingNetwork: ...
def photo3d(
    photo: NDArray[np.uint8],
    depth: NDArray[np.floating] | None = ...,
    *,
    depth_kind: Literal["disparity", "meters"] = ...,
    depth_is_inverse: bool = ...,
    inpaint: Literal["network", "diffusion"] | InpaintingNetwork = ...,
    long_side: int = ...,
    focal_length: float = ...,
    motion: float = ...,
    grain: float = ...,
    threads: int = ...,
    progress: Callable[[str, float], object] | None = ...,
) -> Photo3D: ...
def read_photo(path: str) -> NDArray[np.uint8]: ...
def write_png(path: str, picture: NDArray[np.uint8]) -> None: ...
