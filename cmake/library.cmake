# The two targets that a user links: ldi::ldi, and ldi::io for files and third-party formats.

find_package(Threads REQUIRED)

add_library(ldi INTERFACE)
add_library(ldi::ldi ALIAS ldi)
target_compile_features(ldi INTERFACE cxx_std_20)
target_include_directories(ldi INTERFACE
    "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>"
    "$<INSTALL_INTERFACE:include>")
target_link_libraries(ldi INTERFACE Threads::Threads)

if(LDI_BUILD_IO)
    find_package(stb REQUIRED)
    find_package(PNG REQUIRED)
    find_package(libexif REQUIRED)
    find_package(protozero REQUIRED)
    find_package(LdiReaders REQUIRED)

    add_library(ldi_io INTERFACE)
    add_library(ldi::io ALIAS ldi_io)
    set_target_properties(ldi_io PROPERTIES EXPORT_NAME io)
    target_link_libraries(ldi_io INTERFACE
        ldi::ldi stb::stb PNG::PNG libexif::libexif protozero::protozero ldi_readers::all)
endif()
