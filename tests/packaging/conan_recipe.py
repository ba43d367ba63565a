#!/usr/bin/env python3
"""Checks that the conan recipe exports all files that it packages, and that a compiler finds the package. Without conan, a mock module with
the few functions that the recipe calls replaces it.

    conan_recipe.py PREFIX FOLDER COMPILER
"""

import fnmatch
import importlib.util
import os
import shutil
import subprocess
import sys
import types
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
RECIPE = ROOT / "packaging/conan"
folder, compiler = Path(sys.argv[2]), sys.argv[3]
shutil.rmtree(folder, ignore_errors=True)
folder.mkdir(parents=True)

if shutil.which("conan"):
    environment = os.environ | {"CONAN_HOME": str(folder / "home")}
    subprocess.run(["conan", "profile", "detect"], check=True, env=environment)
    subprocess.run(["conan", "create", RECIPE, "--build=missing"], check=True, env=environment)
    sys.exit()


def copy(recipe, pattern, src, dst):
    """Replaces conan.tools.files.copy(). A pattern may match files in subfolders, and must match at least one file."""
    found = [path for path in Path(src).rglob("*") if path.is_file() and fnmatch.fnmatch(path.relative_to(src).as_posix(), pattern)]
    if not found:
        sys.exit(f"expected a file that matches {pattern} in {src}, found none")
    for path in found:
        target = Path(dst) / path.relative_to(src)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)


modules = {
    "conan": {"ConanFile": object},
    "conan.tools": {},
    "conan.tools.build": {"check_min_cppstd": None, "can_run": None},
    "conan.tools.cmake": {"CMake": None, "cmake_layout": None},
    "conan.tools.files": {"copy": copy, "load": lambda recipe, path: Path(path).read_text(encoding="utf-8")},
}
for name, members in modules.items():
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(members)


def load_recipe(path):
    spec = importlib.util.spec_from_file_location("recipe", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


sys.dont_write_bytecode = True
recipe = load_recipe(RECIPE / "conanfile.py").Ldi()
load_recipe(RECIPE / "test_package/conanfile.py")
recipe.recipe_folder, recipe.export_sources_folder = str(RECIPE), str(folder / "source")
recipe.source_folder, recipe.package_folder = recipe.export_sources_folder, str(folder / "package")
recipe.set_version()
if len(recipe.version.split(".")) != 3:
    sys.exit(f"expected a version of three numbers in the recipe, found {recipe.version}")
recipe.export_sources()
recipe.package()

package = folder / "package"
headers = {path.relative_to(ROOT / "include") for path in (ROOT / "include").rglob("*.hpp")}
if headers != {path.relative_to(package / "include") for path in (package / "include").rglob("*.hpp")}:
    sys.exit("expected the same headers in the package as in the source, found others")
if not (package / "licenses/LICENSE").is_file() or not (package / "share/ldi/single_include/ldi/ldi.hpp").is_file():
    sys.exit("the package lacks the license or the single header")
consumer = Path(__file__).with_name("consumer.cpp")
subprocess.run([compiler, "-std=c++20", f"-I{package / 'include'}", consumer, "-pthread", "-o", folder / "consumer"], check=True)
subprocess.run([folder / "consumer"], check=True)
print("the recipe works with a mock of conan; conan itself is missing and was not run")
