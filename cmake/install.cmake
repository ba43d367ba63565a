# Installs the headers, the single header, the targets, the files for find_package(ldi) and pkg-config, the networks' weights and the
# license.

include(CMakePackageConfigHelpers)
set(package_dir "${CMAKE_INSTALL_DATADIR}/cmake/ldi")

install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/ldi" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.hpp")
install(FILES "${PROJECT_SOURCE_DIR}/single_include/ldi/ldi.hpp" DESTINATION "${CMAKE_INSTALL_DATADIR}/ldi/single_include/ldi")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DATADIR}/licenses/ldi")
set(models_dir "${CMAKE_INSTALL_DATADIR}/ldi/models")
install(DIRECTORY "${PROJECT_SOURCE_DIR}/examples/models/" DESTINATION "${models_dir}" FILES_MATCHING PATTERN "*.safetensors")
install(TARGETS ldi EXPORT ldiTargets)
install(EXPORT ldiTargets NAMESPACE ldi:: DESTINATION "${package_dir}")
if(TARGET ldi_io)
    install(TARGETS ldi_io EXPORT ldiIoTargets)
    install(EXPORT ldiIoTargets NAMESPACE ldi:: DESTINATION "${package_dir}")
    install(FILES cmake/Findstb.cmake cmake/Findprotozero.cmake cmake/FindLdiReaders.cmake
        DESTINATION "${package_dir}")
endif()

configure_package_config_file(cmake/ldiConfig.cmake.in "${PROJECT_BINARY_DIR}/ldiConfig.cmake"
    INSTALL_DESTINATION "${package_dir}" PATH_VARS models_dir)
write_basic_package_version_file("${PROJECT_BINARY_DIR}/ldiConfigVersion.cmake" COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES "${PROJECT_BINARY_DIR}/ldiConfig.cmake" "${PROJECT_BINARY_DIR}/ldiConfigVersion.cmake" DESTINATION "${package_dir}")

# Writes ldi.pc for pkg-config; the file suits every architecture. Its paths are relative to its own folder, so that an installed tree can
# be moved, unless CMake's options contain absolute paths.
set(pc_prefix "${CMAKE_INSTALL_PREFIX}")
if(NOT IS_ABSOLUTE "${CMAKE_INSTALL_DATADIR}")
    file(RELATIVE_PATH up "/${CMAKE_INSTALL_DATADIR}/pkgconfig" "/")
    string(REGEX REPLACE "/$" "" pc_prefix "\${pcfiledir}/${up}")
endif()
set(pc_include "\${prefix}")
cmake_path(APPEND pc_include "${CMAKE_INSTALL_INCLUDEDIR}")  # an absolute path replaces the prefix
configure_file(cmake/ldi.pc.in "${PROJECT_BINARY_DIR}/ldi.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/ldi.pc" DESTINATION "${CMAKE_INSTALL_DATADIR}/pkgconfig")
