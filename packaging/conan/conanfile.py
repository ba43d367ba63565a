"""Conan 2 recipe for the checkout that contains it: conan create packaging/conan"""

import re
from pathlib import Path

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.files import copy, load


class Ldi(ConanFile):
    name = "ldi"
    description = "Layered depth images, and 3D photos made from them"
    license = "MIT"
    topics = ("layered-depth-image", "3d-photo", "header-only")
    package_type = "header-library"
    settings = "os", "arch", "compiler", "build_type"
    no_copy_source = True

    def set_version(self):
        text = load(self, Path(self.recipe_folder) / "../../include/ldi/version.hpp")
        self.version = ".".join(re.findall(r"#define LDI_VERSION_\w+ (\d+)", text))

    def export_sources(self):
        root = Path(self.recipe_folder).parent.parent
        for pattern in ("LICENSE", "include/*.hpp", "single_include/*.hpp", "examples/models/*.safetensors"):
            copy(self, pattern, src=root, dst=self.export_sources_folder)

    def validate(self):
        if self.settings.get_safe("compiler.cppstd"):
            check_min_cppstd(self, 20)

    def package(self):
        source, target = Path(self.source_folder), Path(self.package_folder)
        copy(self, "LICENSE", src=source, dst=target / "licenses")
        copy(self, "*.hpp", src=source / "include", dst=target / "include")
        copy(self, "*.hpp", src=source / "single_include", dst=target / "share/ldi/single_include")
        copy(self, "*.safetensors", src=source / "examples/models", dst=target / "share/ldi/models")

    def package_id(self):
        self.info.clear()

    def package_info(self):
        self.cpp_info.bindirs = []
        self.cpp_info.libdirs = []
        if self.settings.os in ("Linux", "FreeBSD"):
            self.cpp_info.system_libs = ["pthread"]
