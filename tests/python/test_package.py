"""The package as a whole: names, documentation, stubs, README, errors, pickles, memory."""
import copy
import importlib.metadata
import inspect
import os
import pickle
import re
import shutil
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import ldi
import numpy as np
import pytest
from scenes import scene

TOP = Path(__file__).parents[2]
PHOTO, DEPTH = scene()
MADE = ldi.photo3d(PHOTO, DEPTH)
CLASSES = {name: value for name, value in vars(ldi).items() if name in ldi.__all__ and isinstance(value, type)}


def test_names():
    assert sorted(n for n in dir(ldi) if not n.startswith("_")) == sorted(ldi.__all__) == sorted(set(ldi.__all__))
    assert all(getattr(ldi, name).__module__ == "ldi" for name in ldi.__all__)
    namespace = {}
    exec("from ldi import *", namespace)
    assert set(namespace) - {"__builtins__"} == set(ldi.__all__)


def test_version():
    header = (TOP / "include" / "ldi" / "version.hpp").read_text()
    assert ldi.__version__ == importlib.metadata.version("ldi") == ".".join(re.findall(r"#define LDI_VERSION_\w+ (\d+)", header))


def test_everything_is_documented():
    documented = {"ldi": ldi, **{name: getattr(ldi, name) for name in ldi.__all__}}
    for name, cls in CLASSES.items():
        for member, value in vars(cls).items():
            if not member.startswith("_") or member in ("__call__", "__len__", "__getitem__"):
                documented[f"{name}.{member}"] = value
    assert len(documented) > 80
    for name, value in documented.items():
        text = value.__doc__
        assert text and len(text) >= 8 and "ldi._ldi" not in text and "self:" not in text, name


def test_functions_have_signatures():
    for name in ldi.__all__:
        if inspect.isfunction(getattr(ldi, name)):
            parameters = inspect.signature(getattr(ldi, name)).parameters
            assert "args" not in parameters and "kwargs" not in parameters
    with pytest.raises(TypeError, match="unexpected keyword argument 'qualtiy'"):
        MADE.glb(qualtiy=3)


def test_arguments_are_documented():
    text = ldi.photo3d.__doc__
    assert all(name in text for name in inspect.signature(ldi.photo3d).parameters)


def test_stubs_are_right(tmp_path):
    """mypy's stubtest compares __init__.pyi with the package."""
    if subprocess.run([sys.executable, "-c", "import mypy"], stderr=subprocess.DEVNULL).returncode != 0:
        pytest.skip("mypy is not installed")
    (tmp_path / "config").write_text("[mypy]\nignore_missing_imports = True\n")  # names of the extension
    run = subprocess.run([sys.executable, "-m", "mypy.stubtest", "--mypy-config-file", "config", "ldi"], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0 and run.stdout.startswith("Success: no issues found"), run.stdout + run.stderr


def test_results_describe_themselves():
    layer = ldi.lift(MADE.depth)
    for value in (MADE, MADE.depth, layer, MADE.layers, MADE.curves[0], MADE.charts, MADE.charts[0], MADE.atlas, MADE.mesh, ldi.depth_network(), ldi.inpainting_network()):
        assert re.fullmatch(r"<ldi\.\w+: .{8,80}>", repr(value)), repr(value)
        assert type(value).__name__ in repr(value) and str(value) == repr(value)
    assert repr(MADE).startswith("<ldi.Photo3D: 128 x 96, ") and repr(MADE.layers) == f"<ldi.Layers: 128 x 96, {len(MADE.layers)} pixels>"


# Errors ---------------------------------------------------------------------------------------------------------------------------


def test_errors_have_the_bases_that_callers_expect():
    assert issubclass(ldi.InputError, ldi.Error) and issubclass(ldi.InputError, ValueError)
    assert issubclass(ldi.FileError, ldi.Error) and issubclass(ldi.FileError, OSError) and not issubclass(ldi.FileError, ValueError)


@pytest.mark.parametrize("kind", [ldi.Error, ldi.InputError, ldi.FileError])
def test_errors_survive_pickling(kind):
    failure = pickle.loads(pickle.dumps(kind("mismatch", "photo.jpg", "one", "two")))
    assert type(failure) is kind and str(failure) == "photo.jpg: expected one, found two"
    assert (failure.code, failure.where, failure.expected, failure.found) == ("mismatch", "photo.jpg", "one", "two")


def run_limited(code, more_bytes):
    """Runs code in a process with `more_bytes` of memory beyond what the loaded package uses."""
    code = f"""
import resource, sys
import numpy as np, ldi
ldi.depth_network(), ldi.inpainting_network()
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + {more_bytes},) * 2)
try:
    {code}
except MemoryError as failure:
    print("MemoryError", failure)
"""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})


@pytest.mark.parametrize("code", [
    "ldi.photo3d(np.zeros((1500, 1500, 3), np.uint8), threads=1)",
    "ldi.photo3d(np.zeros((1500, 1500, 3), np.uint8), np.ones((1500, 1500), np.float32), inpaint='diffusion', threads=1)",
    "ldi.clean_depth(np.zeros((1500, 1500, 3), np.uint8), np.ones((1500, 1500), np.float32), threads=1)",
])
def test_too_little_memory_is_a_memory_error(code):
    run = run_limited(code, 40_000_000)
    assert run.returncode == 0 and run.stdout.startswith("MemoryError"), (run.returncode, run.stdout, run.stderr)


# Pickles --------------------------------------------------------------------------------------------------------------------------


def arrays_of(value):
    """Returns all arrays and numbers of a result and of its parts."""
    if isinstance(value, (ldi.Curve, ldi.Chart)):
        return [getattr(value, "sides", None), getattr(value, "pixels", None)]
    found = []
    for name in sorted(n for n in dir(value) if not n.startswith("_")):
        member = getattr(value, name)
        if isinstance(member, (np.ndarray, int, float)):
            found.append(member)
        elif isinstance(member, list):
            found += [arrays_of(item) for item in member]
        elif not callable(member):
            found += arrays_of(member)
    return found + ([arrays_of(item) for item in value] if isinstance(value, ldi.Charts) else [])


def same(a, b):
    return len(a) == len(b) and all(same(x, y) if isinstance(x, list) else np.array_equal(x, y) and getattr(x, "dtype", 0) == getattr(y, "dtype", 0) for x, y in zip(a, b))


STAIRS = np.fromfunction(lambda y, x: (x // 3 + y // 3) % 7 / 7, (120, 160))
RESULTS = {
    "Photo3D": MADE,
    "Photo3D of the network": ldi.photo3d(PHOTO),
    "Photo3D of coarse depth": ldi.photo3d(PHOTO, DEPTH[::4, ::4], inpaint="diffusion", focal_length=50, motion=0.2),
    "Photo3D with less motion than requested": ldi.photo3d(np.zeros((120, 160, 3), np.uint8), STAIRS, inpaint="diffusion", motion=0.3),
    "Photo3D without silhouettes": ldi.photo3d(PHOTO, np.ones_like(DEPTH)),
    "Photo3D of one pixel": ldi.photo3d(PHOTO[:1, :1], np.ones((1, 1))),
    "Depth": MADE.depth,
    "Layer": ldi.lift(MADE.depth),
    "Layer of decided silhouettes": ldi.lift(ldi.clean_depth(PHOTO, DEPTH[::4, ::4])),
    "Layers": MADE.layers,
    "Layers without colors": ldi.expand(ldi.lift(MADE.depth)),
    "Charts": MADE.charts,
    "Atlas": MADE.atlas,
    "Mesh": MADE.mesh,
}


@pytest.mark.parametrize("name", RESULTS)
@pytest.mark.parametrize("way", [*(lambda v, p=p: pickle.loads(pickle.dumps(v, p)) for p in range(2, pickle.HIGHEST_PROTOCOL + 1)), copy.copy, copy.deepcopy], ids=["2", "3", "4", "5", "copy", "deepcopy"])
def test_results_survive_pickling(name, way):
    value = RESULTS[name]
    restored = way(value)
    assert type(restored) is type(value) and same(arrays_of(restored), arrays_of(value))
    if isinstance(value, ldi.Photo3D):
        assert restored.glb() == value.glb()
    if isinstance(value, ldi.Layers):
        assert ldi.inpaint(restored).color.tobytes() == ldi.inpaint(value).color.tobytes()


def test_restored_parts_go_together():
    layers, charts, atlas, mesh = (pickle.loads(pickle.dumps(part)) for part in (MADE.layers, MADE.charts, MADE.atlas, MADE.mesh))
    assert ldi.Photo3D(layers, charts, atlas, mesh).glb() == MADE.glb()
    assert ldi.make_mesh(layers, charts, atlas).positions.tobytes() == MADE.mesh.positions.tobytes()
    with pytest.raises(ldi.InputError):
        ldi.make_atlas(ldi.photo3d(PHOTO, DEPTH).layers, charts)


@pytest.mark.parametrize("name", ["Photo3D", "Depth", "Layer", "Layers", "Charts", "Atlas", "Mesh"])
def test_a_pickle_of_another_version_is_refused(name):
    value = RESULTS[name]
    state = value.__getstate__()
    for wrong in (("0.0.1", *state[1:]), (), state[:-1], (None, *state[1:])):
        with pytest.raises(ldi.InputError, match=re.escape(f"a pickle written by ldi {ldi.__version__}")):
            type(value).__new__(type(value)).__setstate__(wrong)


def test_networks_are_not_pickled():
    with pytest.raises(TypeError):
        pickle.dumps(ldi.depth_network())


def convert(scale):
    return ldi.photo3d(*scene(24 * scale, 32 * scale), inpaint="diffusion")


def fail(_):
    ldi.read_photo("none.jpg")


def test_results_and_errors_cross_processes():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert [made.glb() for made in pool.map(convert, (1, 2))] == [convert(1).glb(), convert(2).glb()]
        with pytest.raises(ldi.FileError, match="none.jpg"):
            list(pool.map(fail, (1,)))


# README ---------------------------------------------------------------------------------------------------------------------------


def test_readme(tmp_path):
    """Runs all Python code of the README, in order, as one script."""
    text = (TOP / "examples" / "python" / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 4
    shutil.copy(TOP / "examples" / "photo3d" / "sample.jpg", tmp_path / "photo.jpg")
    if "html(" in text and not os.path.exists(os.path.join(os.path.dirname(ldi.__file__), "viewer.html")):
        pytest.skip("the package was built without the viewer: see examples/viewer/build.sh")
    run = subprocess.run([sys.executable, "-W", "error", "-c", "\n".join(blocks)], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "photo.glb").read_bytes()[:4] == b"glTF" and (tmp_path / "photo.html").exists()
    for block in blocks:
        for code, shown in re.findall(r"^(.*?\S) +# -> (.*)$", block, re.MULTILINE):
            assert shown in run.stdout, code


def test_readme_names_every_function():
    text = (TOP / "examples" / "python" / "README.md").read_text(encoding="utf-8")
    for name in ldi.__all__:
        assert name in CLASSES or re.search(rf"\b{name}\(", text), name
