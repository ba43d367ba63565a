# Finds the optional libraries with which ldi::io reads more formats, and reads and writes JPEG faster. ldi_readers::all links those
# that are installed and defines one macro for each, which include/ldi/io/detail/readers.hpp reads.
#
# LDI_READERS  libraries to look for: a list of libheif (HEIC, AVIF), libwebp, libtiff (from 4.5), lcms2 (color profiles), pugixml (XMP),
#              libjpeg (or libjpeg-turbo)

set(LDI_READERS "libheif;libwebp;libtiff;lcms2;pugixml;libjpeg" CACHE STRING "Optional libraries that ldi::io uses if they are installed")

set(ldi_header_of_libheif libheif/heif.h)
set(ldi_header_of_libwebp webp/decode.h)
set(ldi_header_of_libtiff tiffio.h)
set(ldi_header_of_lcms2 lcms2.h)
set(ldi_header_of_pugixml pugixml.hpp)
set(ldi_header_of_libjpeg jpeglib.h)
set(LdiReaders_PACKAGE_OF_libheif libheif-dev)
set(LdiReaders_PACKAGE_OF_libwebp libwebp-dev)
set(LdiReaders_PACKAGE_OF_libtiff libtiff-dev)
set(LdiReaders_PACKAGE_OF_lcms2 liblcms2-dev)
set(LdiReaders_PACKAGE_OF_pugixml libpugixml-dev)
set(LdiReaders_PACKAGE_OF_libjpeg libjpeg-dev)

if(NOT TARGET ldi_readers::all)
    add_library(ldi_readers::all INTERFACE IMPORTED GLOBAL)
    foreach(reader IN LISTS LDI_READERS)
        string(TOUPPER ${reader} macro)
        string(REGEX REPLACE "^lib" "" library ${reader})
        find_path(LDI_${macro}_INCLUDE_DIR ${ldi_header_of_${reader}})
        find_library(LDI_${macro}_LIBRARY NAMES ${library})
        mark_as_advanced(LDI_${macro}_INCLUDE_DIR LDI_${macro}_LIBRARY)
        if(NOT LDI_${macro}_INCLUDE_DIR OR NOT LDI_${macro}_LIBRARY)
            list(APPEND LdiReaders_MISSING ${reader})
            continue()
        endif()
        if(reader STREQUAL libtiff)
            file(STRINGS "${LDI_${macro}_INCLUDE_DIR}/tiffvers.h" tiff_version REGEX "define TIFFLIB_VERSION ")
            string(REGEX REPLACE "[^0-9]" "" tiff_version "${tiff_version}")
            if(tiff_version LESS 20221213)  # 4.5.0 is the first version with an error handler per file
                list(APPEND LdiReaders_MISSING ${reader})
                continue()
            endif()
        endif()
        list(APPEND LdiReaders_NAMES ${reader})
        add_library(ldi_readers::${reader} UNKNOWN IMPORTED GLOBAL)
        set_target_properties(ldi_readers::${reader} PROPERTIES
            IMPORTED_LOCATION "${LDI_${macro}_LIBRARY}"
            INTERFACE_INCLUDE_DIRECTORIES "${LDI_${macro}_INCLUDE_DIR}"
            INTERFACE_COMPILE_DEFINITIONS LDI_WITH_${macro})
        target_link_libraries(ldi_readers::all INTERFACE ldi_readers::${reader})
    endforeach()
    message(STATUS "Optional libraries of ldi::io: ${LdiReaders_NAMES}")
endif()

set(LdiReaders_FOUND TRUE)
