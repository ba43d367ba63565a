# Installs the checkout that contains this file: vcpkg install ldi --overlay-ports=packaging/vcpkg
set(VCPKG_BUILD_TYPE release)  # headers are the same in all configurations

vcpkg_cmake_configure(
    SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.."
    OPTIONS -DLDI_INSTALL=ON -DLDI_BUILD_IO=OFF -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF -DLDI_BUILD_EXAMPLES=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH share/cmake/ldi)
vcpkg_fixup_pkgconfig()
vcpkg_install_copyright(FILE_LIST "${CMAKE_CURRENT_LIST_DIR}/../../../LICENSE")
