# Defines the two targets for users: ldi::ldi, and ldi::io for files and third-party formats.

find_package(Threads REQUIRED)

include(GNUInstallDirs)
add_library(ldi INTERFACE)
add_library(ldi::ldi ALIAS ldi)
target_compile_features(ldi INTERFACE cxx_std_20)
target_include_directories(ldi INTERFACE
    "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>"
    "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
target_link_libraries(ldi INTERFACE Threads::Threads)

if(LDI_BUILD_IO)
    find_package(stb QUIET)
    find_package(PNG QUIET)
    find_package(protozero QUIET)
    set(ldi_needs_io
        stb::stb=libstb-dev PNG::PNG=libpng-dev protozero::protozero=libprotozero-dev)
    ldi_has(ldi_has_io "ldi::io" ${ldi_needs_io})
endif()
if(LDI_BUILD_IO AND ldi_has_io)
    find_package(LdiReaders REQUIRED)
    foreach(reader IN LISTS LdiReaders_MISSING)
        ldi_leave_out("ldi::io's use of ${reader}" ${LdiReaders_PACKAGE_OF_${reader}})
    endforeach()

    add_library(ldi_io INTERFACE)
    add_library(ldi::io ALIAS ldi_io)
    set_target_properties(ldi_io PROPERTIES EXPORT_NAME io)
    target_link_libraries(ldi_io INTERFACE
        ldi::ldi stb::stb PNG::PNG protozero::protozero ldi_readers::all)
endif()
