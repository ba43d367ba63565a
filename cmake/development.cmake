# Packages and settings for ldi's own tests, benchmarks and examples. Projects that link ldi::ldi do not read this file.

if(NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
    find_program(LDI_CCACHE ccache)
    if(LDI_CCACHE)
        message(STATUS "Compiling through ${LDI_CCACHE}; -DLDI_CCACHE= turns it off")
        set(CMAKE_CXX_COMPILER_LAUNCHER "${LDI_CCACHE}")
    endif()
endif()

set(CMAKE_CXX_EXTENSIONS OFF)

add_library(ldi_development INTERFACE)
target_compile_options(ldi_development INTERFACE
    -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow
    $<$<BOOL:${LDI_WARNINGS_AS_ERRORS}>:-Werror>)
target_include_directories(ldi_development INTERFACE "${PROJECT_SOURCE_DIR}")
target_compile_definitions(ldi_development INTERFACE
    LDI_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    LDI_SHARED_DIR="${PROJECT_SOURCE_DIR}/../shared")
find_package(nlohmann_json QUIET)  # programs write JSON; benchmarks read it
target_link_libraries(ldi_development INTERFACE $<IF:$<TARGET_EXISTS:ldi::io>,ldi::io,ldi::ldi>
    $<TARGET_NAME_IF_EXISTS:nlohmann_json::nlohmann_json>)

# For photo3d --compress. Without meshoptimizer or libwebp, the program refuses this option.
if(LDI_BUILD_IO)
    find_package(meshoptimizer CONFIG QUIET)
    find_package(LdiReaders REQUIRED)
    ldi_has(ldi_has_compression "photo3d --compress" meshoptimizer::meshoptimizer=libmeshoptimizer-dev ldi_readers::libwebp=libwebp-dev)
endif()
if(ldi_has_compression)
    add_library(ldi_compression INTERFACE)
    target_link_libraries(ldi_compression INTERFACE meshoptimizer::meshoptimizer ldi_readers::libwebp)
    target_compile_definitions(ldi_compression INTERFACE LDI_WITH_COMPRESSION)
endif()

# Optional packages. Tests, benchmarks and lessons whose packages are missing are left out.
find_package(Eigen3 CONFIG QUIET)
find_package(xtensor QUIET)
find_package(benchmark QUIET)
find_package(Python3 QUIET COMPONENTS Interpreter)

if(LDI_TEST_SINGLE_INCLUDE)
    set(forward "${PROJECT_BINARY_DIR}/single_include_forward")
    execute_process(
        COMMAND "${Python3_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/single_include/amalgamate.py" --forward "${forward}"
        COMMAND_ERROR_IS_FATAL ANY)
    target_include_directories(ldi_development BEFORE INTERFACE "${forward}")
endif()
