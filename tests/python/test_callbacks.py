"""Python functions as depth estimator, inpainter and progress listener."""
import os
import signal
import sys
import threading
import time

import ldi
import numpy as np
import pytest
from scenes import scene

PHOTO, DEPTH = scene()


class Unusual(Exception):
    """An exception that is unknown to the package."""

    def __init__(self, one, two):
        super().__init__(one, two)


def estimated(depth):
    return ldi.photo3d(PHOTO, depth, inpaint="diffusion")


def inpainted(inpaint):
    return ldi.photo3d(PHOTO, DEPTH, inpaint=inpaint)


# Entry points that call a function.
WAYS = {
    "depth of photo3d": estimated,
    "depth of clean_depth": lambda function: ldi.clean_depth(PHOTO, function),
    "inpaint of photo3d": inpainted,
    "inpaint of inpaint": lambda function: ldi.inpaint(ldi.expand(ldi.lift(ldi.clean_depth(PHOTO, DEPTH))), function),
    "progress of photo3d": lambda function: ldi.photo3d(PHOTO, DEPTH, inpaint="diffusion", progress=lambda stage, fraction: function(stage)),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("failure", [Unusual(1, 2), LookupError("none"), KeyboardInterrupt(), SystemExit(3), MemoryError(), StopIteration(), ldi.InputError("a", "b", "c", "d"), OSError(5, "five")], ids=lambda f: type(f).__name__)
def test_exceptions_reach_the_caller_unchanged(way, failure):
    def fail(_):
        raise failure

    with pytest.raises(type(failure)) as raised:
        WAYS[way](fail)
    assert raised.value is failure
    names = []
    trace = raised.value.__traceback__
    while trace:
        names.append(trace.tb_frame.f_code.co_name)
        trace = trace.tb_next
    assert names[-1] == "fail"  # the traceback ends where the exception was raised


@pytest.mark.parametrize("way", WAYS)
def test_functions_run_on_the_calling_thread(way):
    threads = set()

    def note(argument):
        threads.add(threading.get_ident())
        return DEPTH if way.startswith("depth") else argument.color if way.startswith("inpaint") else None

    WAYS[way](note)
    assert threads == {threading.get_ident()}


@pytest.mark.parametrize("way", [w for w in WAYS if not w.startswith("progress")])
def test_functions_may_use_the_package(way):
    def work(argument):
        inner = ldi.photo3d(PHOTO, DEPTH, inpaint=lambda layers: ldi.inpainting_network()(layers))
        return inner.disparity if way.startswith("depth") else np.repeat(inner.layers.color[:1], len(argument), axis=0)

    WAYS[way](work)


@pytest.mark.parametrize("way", WAYS)
def test_every_kind_of_function(way):
    class Callable:
        def __call__(self, argument):
            return DEPTH if way.startswith("depth") else argument.color if way.startswith("inpaint") else None

    WAYS[way](Callable())
    WAYS[way](Callable().__call__)


def test_an_estimator_gives_the_same_result_as_its_map():
    assert estimated(lambda photo: DEPTH).glb() == estimated(DEPTH).glb()
    far = np.where(DEPTH > 0.5, 1.0, 4.0)
    by_function = ldi.photo3d(PHOTO, lambda photo: far, depth_kind="meters", inpaint="diffusion")
    assert by_function.glb() == ldi.photo3d(PHOTO, far, depth_kind="meters", inpaint="diffusion").glb()


def test_an_estimator_receives_the_photo_of_the_caller():
    large = np.zeros((200, 300, 3), np.uint8)
    large[50:146, 60:188] = PHOTO
    seen = []
    made = ldi.photo3d(large[50:146, 60:188], lambda photo: seen.append(photo) or DEPTH, inpaint="diffusion", long_side=64)
    assert (seen[0] == PHOTO).all() and np.shares_memory(seen[0], large)  # full size, without a copy
    assert made.photo.shape == (48, 64, 3)


def test_a_network_is_an_estimator():
    assert ldi.photo3d(PHOTO, ldi.depth_network(), inpaint="diffusion").glb() == ldi.photo3d(PHOTO, inpaint="diffusion").glb()
    disparity = ldi.depth_network()(PHOTO)
    assert disparity.dtype == np.float32 and disparity.ndim == 2 and disparity.min() > 0 and disparity.flags.writeable


def test_an_inpainter_that_calls_the_network_gives_its_result():
    network = ldi.inpainting_network()
    assert inpainted(lambda layers: network(layers)).glb() == inpainted("network").glb() == inpainted(network).glb()


def test_an_inpainter_sets_unknown_colors_only():
    made = ldi.photo3d(PHOTO, DEPTH, inpaint=lambda layers: np.full((len(layers), 3), (10, 20, 30), np.uint8), texture=0, grain=0,
                       frame="crop")  # past the frame, pixels have the border's colors
    layers = made.layers
    assert (layers.color[layers.known == 0] == (10, 20, 30)).all() and (layers.known == 0).any()
    assert not (layers.color[layers.known == 1] == (10, 20, 30)).all(axis=1).any()


def test_layers_passed_to_an_inpainter_stay_unchanged():
    kept = []

    def keep(layers):
        kept.append((layers, layers.color, layers.color.copy(), layers.known.copy()))
        assert len(layers.disparity) == len(layers) and (layers.known == 0).any() and not layers.color.flags.writeable
        return np.zeros((len(layers), 3), np.uint8)

    made = inpainted(keep)
    layers, color, before, known = kept[0]
    del made
    for _ in range(3):
        inpainted(lambda layers: layers.color)  # reuses the memory
    assert (color == before).all() and (layers.known == known).all() and len(layers.x) == len(before)


def test_layers_passed_to_an_inpainter_can_be_charted_but_not_inpainted():
    def use(layers):
        assert len(ldi.make_charts(layers)) > 0
        with pytest.raises(ldi.InputError, match="layers passed to an inpainter"):
            ldi.inpaint(layers)
        return layers.color

    inpainted(use)


def test_progress_reports_every_stage():
    told = []
    ldi.photo3d(PHOTO, DEPTH, progress=lambda stage, fraction: told.append((stage, fraction)))
    assert told[0] == ("depth estimation", 0) and told[-1] == ("meshing", 1) and len({stage for stage, _ in told}) == 8


def test_progress_ends_the_work_within_a_stage():
    told = []

    def stop(stage, fraction):
        told.append(stage)
        if stage == "depth filter":
            raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        ldi.photo3d(PHOTO, DEPTH, progress=stop)
    assert told[-1] == "depth filter"


def test_control_c_ends_the_work():
    def interrupt(stage, fraction):
        if stage == "depth filter" and fraction == 0:
            os.kill(os.getpid(), signal.SIGINT)

    # In tests that a shell started in the background, Control-C is ignored by default.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            ldi.photo3d(PHOTO, DEPTH, progress=interrupt)
    finally:
        signal.signal(signal.SIGINT, before)


CALLS = {
    "photo3d": lambda photo, depth, made: ldi.photo3d(photo, depth),
    "clean_depth": lambda photo, depth, made: ldi.clean_depth(photo, depth),
    "lift": lambda photo, depth, made: ldi.lift(made.depth),
    "expand": lambda photo, depth, made: ldi.expand(ldi.lift(made.depth)),
    "inpaint": lambda photo, depth, made: ldi.inpaint(made.layers),
    "make_charts": lambda photo, depth, made: ldi.make_charts(made.layers),
    "make_atlas": lambda photo, depth, made: ldi.make_atlas(made.layers, made.charts),
    "make_mesh": lambda photo, depth, made: ldi.make_mesh(made.layers, made.charts, made.atlas),
    "DepthNetwork": lambda photo, depth, made: ldi.depth_network()(photo),
    "InpaintingNetwork": lambda photo, depth, made: ldi.inpainting_network()(made.layers),
    "glb": lambda photo, depth, made: made.glb(),
    "render": lambda photo, depth, made: made.render(),
}


@pytest.fixture(scope="module")
def large():
    photo, depth = (np.repeat(np.repeat(a, 10, 0), 10, 1) for a in (PHOTO, DEPTH))
    return photo, depth, ldi.photo3d(photo, depth)


@pytest.mark.parametrize("call", CALLS)
def test_other_threads_run_meanwhile(call, large):
    """In this test, Python does not switch threads by itself. Another thread therefore runs only while the library releases the interpreter's lock."""
    is_done, runs = threading.Event(), []

    def run():
        while not is_done.is_set():
            time.sleep(0)
            runs.append(0)

    interval = sys.getswitchinterval()
    other = threading.Thread(target=run)
    other.start()
    try:
        sys.setswitchinterval(1e6)
        time.sleep(0.01)  # gives the other thread time to read the new interval
        before = len(runs)
        for _ in range(20):  # on a busy machine, the other thread may not run during the first call
            CALLS[call](*large)
            if len(runs) > before:
                break
        assert len(runs) > before
    finally:
        sys.setswitchinterval(interval)
        is_done.set()
        other.join()


def test_two_threads_convert_at_once():
    expected = inpainted(lambda layers: layers.color).glb()
    found = []

    def work():
        for _ in range(3):
            found.append(inpainted(lambda layers: layers.color).glb())

    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == 6 * [expected]
