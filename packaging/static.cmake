# Links only static libraries. Included after project() by -DCMAKE_PROJECT_ldi_INCLUDE=packaging/static.cmake
set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
if(WIN32)
    add_link_options(-Wl,--allow-multiple-definition)  # uses mbrtowc() of photo3d/windows_utf8.cpp instead of the C library's
    # build/release_headers links to the headers of these libraries only, so that the compiler does not find this machine's C library.
    foreach(name IN ITEMS CLI11::CLI11 nlohmann_json::nlohmann_json)
        add_library(${name} INTERFACE IMPORTED GLOBAL)
        target_include_directories(${name} INTERFACE "${CMAKE_CURRENT_SOURCE_DIR}/build/release_headers")
    endforeach()
else()
    add_link_options(-static)
    # Dependencies of libheif and Debian's libtiff, in the linker's order.
    find_library(LDI_LIBDE265_LIBRARY de265 REQUIRED)
    set(CMAKE_CXX_STANDARD_LIBRARIES "${LDI_LIBDE265_LIBRARY} -lLerc -ljbig -lzstd -llzma -ldeflate -ljpeg -lz -lm")
endif()
