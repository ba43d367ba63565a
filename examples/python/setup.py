"""Builds the extension from the headers in ../../include, and copies the networks' weights and the viewer beside it."""
import glob
import os
import re
import shlex
import shutil
import subprocess

from pybind11.setup_helpers import Pybind11Extension
from setuptools import setup
from setuptools.command.build_py import build_py

TOP = os.path.join("..", "..")
VIEWER = os.path.join(TOP, "build", "viewer", "viewer.html")  # examples/viewer/build.sh builds it


class build_with_data(build_py):
    def run(self):
        super().run()
        folder = os.path.join(self.build_lib, "ldi")
        os.makedirs(os.path.join(folder, "models"), exist_ok=True)
        for name in ("tiefenrausch_small.safetensors", "silhouettes.safetensors", "farbrausch.safetensors"):
            shutil.copy(os.path.join(TOP, "examples", "models", name), os.path.join(folder, "models"))
        # packaging/release.sh links libraries into the wheel, and names the folder of their licenses in this variable.
        licenses = os.environ.get("LDI_LICENSES")
        if licenses:
            shutil.copytree(licenses, os.path.join(folder, "licenses"), dirs_exist_ok=True)
        if os.path.exists(VIEWER):
            shutil.copy(VIEWER, folder)
        else:
            print(f"{VIEWER} is missing, so Photo3D.html() will raise an error. examples/viewer/build.sh builds it.")


def is_usable(header, library, condition="1"):
    """Returns whether the compiler finds a library and its header."""
    program = f"#include <cstdio>\n#include <{header}>\n#if !({condition})\n#error too old\n#endif\nint main() {{}}\n"
    command = [*shlex.split(os.environ.get("CXX", "c++")), "-std=c++17", "-x", "c++", "-", f"-l{library}", "-o", os.devnull]
    return subprocess.run(command, input=program.encode(), stderr=subprocess.DEVNULL).returncode == 0


def version():
    with open(os.path.join(TOP, "include", "ldi", "version.hpp"), encoding="utf-8") as header:
        return ".".join(re.findall(r"#define LDI_VERSION_\w+ (\d+)", header.read()))


# The same readers as in cmake/FindLdiReaders.cmake. For each macro: the reader's header, its library, and a condition, if any.
readers = {
    "LDI_WITH_LIBHEIF": ("libheif/heif.h", "heif"),
    "LDI_WITH_LIBWEBP": ("webp/decode.h", "webp"),
    "LDI_WITH_LIBTIFF": ("tiffio.h", "tiff", "TIFFLIB_VERSION >= 20221213"),
    "LDI_WITH_LCMS2": ("lcms2.h", "lcms2"),
    "LDI_WITH_LIBJPEG": ("jpeglib.h", "jpeg"),
}
# The environment variable LDI_READERS lists the readers to look for, as in CMake, separated by semicolons.
wanted = os.environ.get("LDI_READERS", "libheif;libwebp;libtiff;lcms2;libjpeg").split(";")
found = [(macro, library[1]) for macro, library in readers.items() if macro[9:].lower() in wanted and is_usable(*library)]
if ("LDI_WITH_LIBWEBP", "webp") in found and is_usable("meshoptimizer.h", "meshoptimizer") and is_usable("nlohmann/json.hpp", "c"):
    found.append(("LDI_WITH_COMPRESSION", "meshoptimizer"))

extension = Pybind11Extension(
    "ldi._ldi",
    ["source/module.cpp"],
    depends=glob.glob("source/*.hpp") + glob.glob(os.path.join(TOP, "include", "ldi", "**", "*.hpp"), recursive=True),
    include_dirs=[os.path.join(TOP, "include"), TOP],
    define_macros=[(macro, None) for macro, _ in found],
    libraries=["png"] + [library for _, library in found],
    cxx_std=20,
    extra_compile_args=["-O2", "-g0"],
)

setup(
    version=version(),
    packages=["ldi"],
    package_dir={"": "source"},
    package_data={"ldi": ["py.typed", "*.pyi"]},
    ext_modules=[extension],
    cmdclass={"build_py": build_with_data},
    zip_safe=False,
)
