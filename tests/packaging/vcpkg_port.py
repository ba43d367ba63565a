#!/usr/bin/env python3
"""Checks that the vcpkg port installs ldi, and that a consumer finds it. Never runs vcpkg, which downloads its tools: mocks replace its
functions.

    vcpkg_port.py PREFIX FOLDER COMPILER
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PORT = ROOT / "packaging/vcpkg/ldi"
FUNCTIONS = """
function(run)
    execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
endfunction()
function(vcpkg_cmake_configure)
    cmake_parse_arguments(PARSE_ARGV 0 a "" SOURCE_PATH OPTIONS)
    run("${CMAKE_COMMAND}" -S "${a_SOURCE_PATH}" -B "${FOLDER}/build" -DCMAKE_BUILD_TYPE=Release
        "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_INSTALL_PREFIX=${FOLDER}/installed" ${a_OPTIONS})
endfunction()
function(vcpkg_cmake_install)
    run("${CMAKE_COMMAND}" --build "${FOLDER}/build" --target install)
endfunction()
function(vcpkg_cmake_config_fixup)
    cmake_parse_arguments(PARSE_ARGV 0 a "" CONFIG_PATH "")
    file(GLOB files "${FOLDER}/installed/${a_CONFIG_PATH}/*.cmake")
    if(NOT files)
        message(FATAL_ERROR "no package config in ${a_CONFIG_PATH}")
    endif()
    # Moves share/cmake/ldi to share/ldi, and corrects relative paths to the prefix.
    foreach(file IN LISTS files)
        file(READ "${file}" text)
        string(REPLACE "/../../../" "/../../" text "${text}")
        string(REPLACE "get_filename_component(_IMPORT_PREFIX \\"\\${_IMPORT_PREFIX}\\" PATH)\\nif(" "if(" text "${text}")
        cmake_path(GET file FILENAME name)
        file(WRITE "${FOLDER}/installed/share/ldi/${name}" "${text}")
    endforeach()
    file(REMOVE_RECURSE "${FOLDER}/installed/share/cmake")
endfunction()
function(vcpkg_fixup_pkgconfig)
    if(NOT EXISTS "${FOLDER}/installed/share/pkgconfig/ldi.pc")
        message(FATAL_ERROR "no file for pkg-config")
    endif()
endfunction()
function(vcpkg_install_copyright)
    cmake_parse_arguments(PARSE_ARGV 0 a "" "" FILE_LIST)
    configure_file("${a_FILE_LIST}" "${FOLDER}/installed/share/ldi/copyright" COPYONLY)
endfunction()
"""

folder, compiler = Path(sys.argv[2]), sys.argv[3]
os.environ["CMAKE_GENERATOR"] = "Ninja"  # make may not be installed
shutil.rmtree(folder, ignore_errors=True)
folder.mkdir(parents=True)

manifest = json.loads((PORT / "vcpkg.json").read_text(encoding="utf-8"))
version = ".".join(re.findall(r"#define LDI_VERSION_\w+ (\d+)", (ROOT / "include/ldi/version.hpp").read_text(encoding="utf-8")))
if manifest["version-semver"] != version:
    sys.exit(f"vcpkg.json: expected version {version}, found {manifest['version-semver']}")

script = folder / "run_port.cmake"
script.write_text(f'set(FOLDER "{folder}")\nset(COMPILER "{compiler}")\n{FUNCTIONS}\ninclude("{PORT / "portfile.cmake"}")\n', encoding="utf-8")
subprocess.run(["cmake", "-P", script], check=True)
if list((folder / "installed").rglob("lib")) or not (folder / "installed/share/ldi/copyright").is_file():
    sys.exit("expected a license and no folder lib, as the library has only headers, found a folder lib or no license")
consumer = Path(__file__).with_name("find_package")
subprocess.run(["cmake", "-S", consumer, "-B", folder / "consumer", f"-DCMAKE_CXX_COMPILER={compiler}",
                f"-DCMAKE_PREFIX_PATH={folder / 'installed'}", "-DWITHOUT_FILES=ON"], check=True, stdout=subprocess.DEVNULL)
subprocess.run(["cmake", "--build", folder / "consumer"], check=True, stdout=subprocess.DEVNULL)
subprocess.run([folder / "consumer/consumer"], check=True)
print("the port works with mocks of vcpkg's functions; vcpkg itself was not run")
