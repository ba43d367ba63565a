# Included after project(): links nothing but static libraries. -DCMAKE_PROJECT_ldi_INCLUDE=packaging/static.cmake
set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
if(NOT WIN32)
    add_link_options(-static)
    # What Debian's libtiff needs, in the order in which the linker resolves it.
    set(CMAKE_CXX_STANDARD_LIBRARIES "-lLerc -ljbig -lzstd -llzma -ldeflate -ljpeg -lz -lm")
endif()
