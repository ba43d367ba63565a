"""The Python package, as tests/python/run.sh installs it."""
import os
import signal
import struct
import threading
import time

import ldi
import numpy as np
import pytest


def scene(height=96, width=128):
    """A checkered square before a checkered wall, and its disparity."""
    y, x = np.mgrid[0:height, 0:width]
    near = (abs(y - height // 2) < height // 4) & (abs(x - width // 2) < width // 4)
    check = ((x // 6 + y // 6) % 2 * 100 + 50).astype(np.uint8)
    photo = np.stack([check, np.where(near, 200, check), np.where(near, check, 30)], axis=2).astype(np.uint8)
    return photo, np.where(near, 1.0, 0.2).astype(np.float32)


@pytest.fixture(scope="module")
def made():
    return ldi.photo3d(*scene())


def root_of(array):
    """What an array's memory belongs to."""
    while isinstance(array, np.ndarray):
        array = array.base
    return array


def test_arrays_show_the_memory_of_the_result(made):
    owners = {"photo": made, "disparity": made, "atlas": made, "chart_of": made}
    for name, owner in owners.items():
        assert root_of(getattr(made, name)) is owner
        assert np.shares_memory(getattr(made, name), getattr(made, name))  # each time the same
        assert not getattr(made, name).flags.writeable
    for part, names in ((made.layers, ("x", "left", "color", "disparity", "known")), (made.mesh, ("positions", "triangles", "texture_coordinates")), (made.curves[0], ("sides",)), (made.charts[0], ("pixels",))):
        for name in names:
            assert root_of(getattr(part, name)) is part and np.shares_memory(getattr(part, name), getattr(part, name))


def test_arrays_outlive_the_result():
    result = ldi.photo3d(*scene(), inpaint="diffusion")
    color, sides, copy = result.layers.color, result.curves[0].sides, result.layers.color.copy()
    expected = sides.copy()
    del result
    for _ in range(3):
        ldi.photo3d(*scene(), inpaint="diffusion")
    assert (color == copy).all() and (sides == expected).all()


def test_shapes_and_relations(made):
    layers, mesh = made.layers, made.mesh
    assert made.photo.shape == (96, 128, 3) and made.disparity.shape == (96, 128) and len(layers) > 96 * 128
    assert layers.color.shape == (len(layers), 3) and layers.known.min() == 0
    linked = layers.right >= 0
    assert (layers.left[layers.right[linked]] == np.flatnonzero(linked)).all() and (layers.x[layers.right[linked]] == layers.x[linked] + 1).all()
    assert made.chart_of.max() == len(made.charts) - 1 and sum(len(chart.pixels) for chart in made.charts) == len(layers)
    assert mesh.triangles.max() == len(mesh.positions) - 1 and mesh.texture_coordinates.shape == (len(mesh.positions), 2)
    assert 0 <= mesh.texture_coordinates.min() and mesh.texture_coordinates.max() <= 1 and mesh.positions[:, 2].max() < 0
    far, near = made.curves[0].sides.T
    assert (made.disparity.ravel()[near] > made.disparity.ravel()[far]).all()


def test_parts_of_larger_arrays_give_the_same():
    photo, depth = scene()
    expected = ldi.photo3d(photo, depth, inpaint="diffusion").glb()
    large = np.zeros((120, 200, 3), np.uint8)
    large[10:106, 40:168] = photo
    assert ldi.photo3d(large[10:106, 40:168], depth.astype(np.float64), inpaint="diffusion").glb() == expected
    assert ldi.photo3d(np.asfortranarray(photo), depth[::-1].copy()[::-1], inpaint="diffusion", threads=1).glb() == expected


def test_glb(made):
    glb = made.glb()
    assert glb[:4] == b"glTF" and struct.unpack("<I", glb[8:12])[0] == len(glb) and len(made.glb(quality=20)) < len(glb)


def test_render(made):
    from_photo = made.render()
    assert from_photo.shape == (96, 128, 3) and abs(from_photo.astype(int) - made.photo).mean() < 8
    assert made.render((0.05, 0, 0), target=(0, 0, -2), width=64).shape == (48, 64, 3)
    assert (made.render((0.05, 0, 0)) != from_photo).any()


def test_depth_by_the_network():
    made = ldi.photo3d(scene()[0])
    assert made.disparity.min() >= 0 and 0.9 < made.disparity.max() <= 1
    assert ldi.depth_network() is ldi.depth_network()


def test_meters_and_holes():
    photo, disparity = scene()
    meters = 1 / disparity
    meters[:4] = np.nan
    made = ldi.photo3d(photo, meters, depth_kind="meters", inpaint="diffusion")
    assert made.layers.z_near == pytest.approx(1, rel=0.01) and made.layers.z_far == pytest.approx(5, rel=0.2)


def test_errors():
    photo, depth = scene()
    for arguments, code, word in (((photo[:, :, 0], depth), "mismatch", "H x W x 3"), ((photo, depth[:, :40]), "mismatch", "proportions"), ((photo, np.full_like(depth, np.nan)), "invalid data", "valid")):
        with pytest.raises(ldi.Error, match=word) as raised:
            ldi.photo3d(*arguments)
        assert raised.value.code == code and raised.value.expected and raised.value.found and raised.value.where
    with pytest.raises(TypeError):
        ldi.photo3d(photo.astype(np.float32), depth)
    for wrong in ({"depth_kind": "feet"}, {"inpaint": "magic"}):
        with pytest.raises(ValueError):
            ldi.photo3d(photo, depth, **wrong)
    with pytest.raises(ldi.Error):
        ldi.DepthNetwork(b"nothing")
    with pytest.raises(ldi.Error, match="none.jpg"):
        ldi.read_photo("none.jpg")


def test_progress_tells_every_stage_and_may_end_the_work():
    told = []
    ldi.photo3d(*scene(), progress=lambda stage, fraction: told.append((stage, fraction)))
    assert told[0] == ("depth estimation", 0) and told[-1] == ("meshing", 1) and len({stage for stage, _ in told}) == 8

    def stop(stage, fraction):
        told.append(stage)
        if stage == "depth filter":
            raise LookupError("enough")

    told.clear()
    with pytest.raises(LookupError, match="enough"):
        ldi.photo3d(*scene(), progress=stop)
    assert told[-1] == "depth filter"


def test_control_c_ends_the_work():
    def interrupt(stage, fraction):
        if stage == "depth filter" and fraction == 0:
            os.kill(os.getpid(), signal.SIGINT)

    # A shell that starts tests in the background lets them ignore Control-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            ldi.photo3d(*scene(), progress=interrupt)
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_run_meanwhile():
    photo, depth = (np.repeat(np.repeat(a, 8, 0), 8, 1) for a in scene())
    during, is_done = [], threading.Event()

    def count():
        while not is_done.is_set():
            during.append(time.monotonic())
            time.sleep(0.001)

    other = threading.Thread(target=count)
    other.start()
    stages = []
    ldi.photo3d(photo, depth, inpaint="diffusion", progress=lambda stage, fraction: stages.append((time.monotonic(), fraction)))
    is_done.set()
    other.join()
    within = [t for t in during if any(begin < t < end for (begin, f0), (end, f1) in zip(stages, stages[1:]) if f0 == 0)]
    assert within


def test_pictures_are_read_and_written(tmp_path):
    photo, _ = scene()
    path = str(tmp_path / "photo.png")
    ldi.write_png(path, photo[::2, :, :])
    assert (ldi.read_photo(path) == photo[::2]).all()
