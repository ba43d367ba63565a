# Included after project(): links nothing but static libraries. -DCMAKE_PROJECT_ldi_INCLUDE=packaging/static.cmake
set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
if(WIN32)
    add_link_options(-Wl,--allow-multiple-definition)  # mbrtowc() of photo3d/windows_utf8.cpp comes before the C library's
    # Headers of this machine, without its C library beside them: build/release_headers has links to their folders.
    foreach(name IN ITEMS CLI11::CLI11 nlohmann_json::nlohmann_json)
        add_library(${name} INTERFACE IMPORTED GLOBAL)
        target_include_directories(${name} INTERFACE "${CMAKE_CURRENT_SOURCE_DIR}/build/release_headers")
    endforeach()
else()
    add_link_options(-static)
    # What libheif and Debian's libtiff need, in the order in which the linker resolves it.
    find_library(LDI_LIBDE265_LIBRARY de265 REQUIRED)
    set(CMAKE_CXX_STANDARD_LIBRARIES "${LDI_LIBDE265_LIBRARY} -lLerc -ljbig -lzstd -llzma -ldeflate -ljpeg -lz -lm")
endif()
