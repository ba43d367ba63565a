"""Builds the extension from the headers of ../../include, and puts the networks' weights beside it."""
import os
import shutil

from pybind11.setup_helpers import Pybind11Extension
from setuptools import setup
from setuptools.command.build_py import build_py

TOP = os.path.join("..", "..")


class build_with_weights(build_py):
    def run(self):
        super().run()
        folder = os.path.join(self.build_lib, "ldi", "models")
        os.makedirs(folder, exist_ok=True)
        for name in ("tiefenrausch_small.safetensors", "farbrausch.safetensors"):
            shutil.copy(os.path.join(TOP, "examples", "models", name), folder)


extension = Pybind11Extension(
    "ldi._ldi",
    ["source/module.cpp"],
    include_dirs=[os.path.join(TOP, "include")],
    libraries=["png", "exif"],
    cxx_std=20,
    extra_compile_args=["-O2", "-g0"],
)

setup(packages=["ldi"], package_dir={"": "source"}, package_data={"ldi": ["py.typed", "*.pyi"]}, ext_modules=[extension], cmdclass={"build_py": build_with_weights}, zip_safe=False)
