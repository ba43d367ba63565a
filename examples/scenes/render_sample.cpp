// Writes a scene's photo (JPEG) and its depth map (16-bit grey PNG, disparity, white near), such as the shipped sample:
//
//     render_sample still_life 1152 1536 examples/photo3d/sample.jpg examples/photo3d/sample_depth.png
#include "scene.hpp"

#include <png.h>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STBI_WRITE_NO_STDIO_WARNINGS
#include <stb/stb_image_write.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

namespace {

[[noreturn]] void cannot_write(const std::string& path) {
    ldi::raise(ldi::error_code::file_access, path, "a file that can be written", "an error while writing");
}

void write_photo(const std::string& path, const ldi::image<std::uint8_t>& colour) {
    const int quality = 90;
    if (stbi_write_jpg(path.c_str(), static_cast<int>(ldi::width(colour)), static_cast<int>(ldi::height(colour)), 3,
                       colour.data(), quality) == 0)
        cannot_write(path);
}

/// 12 significant bits, spread over 16: finer ones show nowhere, and do not compress.
std::vector<std::uint8_t> big_endian_disparity(const ldi::image<float>& disparity) {
    std::vector<std::uint8_t> bytes;
    bytes.reserve(disparity.size() * 2);
    for (const float d : disparity) {
        const unsigned value = static_cast<unsigned>(std::lround(std::clamp(d, 0.0F, 1.0F) * 4095.0F));
        const unsigned spread = value << 4U | value >> 8U;
        bytes.push_back(static_cast<std::uint8_t>(spread >> 8U));
        bytes.push_back(static_cast<std::uint8_t>(spread & 255U));
    }
    return bytes;
}

void write_disparity(const std::string& path, const ldi::image<float>& disparity) {
    std::vector<std::uint8_t> bytes = big_endian_disparity(disparity);
    std::FILE* const file = std::fopen(path.c_str(), "wb");
    if (file == nullptr) cannot_write(path);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    volatile bool written = false;
    if (setjmp(png_jmpbuf(png)) == 0) {  // libpng comes back here with 1 when it fails
        png_init_io(png, file);
        png_set_IHDR(png, info, static_cast<png_uint_32>(ldi::width(disparity)), static_cast<png_uint_32>(ldi::height(disparity)),
                     16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
        png_set_compression_level(png, 9);
        png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_ALL_FILTERS);
        png_write_info(png, info);
        for (std::size_t y = 0; y < ldi::height(disparity); ++y) png_write_row(png, bytes.data() + y * ldi::width(disparity) * 2);
        png_write_end(png, info);
        written = true;
    }
    png_destroy_write_struct(&png, &info);
    if (std::fclose(file) != 0 || !written) cannot_write(path);
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 6 && count != 7) {
        std::fprintf(stderr, "usage: %s SCENE WIDTH HEIGHT OUT.jpg OUT_depth.png [SAMPLES]\n", arguments[0]);
        return 2;
    }
    try {
        const std::int32_t width = static_cast<std::int32_t>(std::strtol(arguments[2], nullptr, 10));
        const std::int32_t height = static_cast<std::int32_t>(std::strtol(arguments[3], nullptr, 10));
        const std::int32_t samples = count == 7 ? static_cast<std::int32_t>(std::strtol(arguments[6], nullptr, 10)) : 8;
        if (width < 1 || height < 1 || samples < 1)
            ldi::raise(ldi::error_code::invalid_option, "size", "whole numbers above 0", "something else");
        const ldi::scenes::scene scene = ldi::scenes::scene_by_name(arguments[1], width, height);
        ldi::view photo;
        photo.camera = scene.camera;
        ldi::scenes::picture_options options;
        options.samples = samples;
        ldi::thread_pool threads;
        const ldi::scenes::picture result = ldi::scenes::render(scene, photo, options, threads);
        write_photo(arguments[4], result.colour);
        write_disparity(arguments[5], result.disparity);
        std::printf("depth %.3f to %.3f\n", static_cast<double>(scene.range.z_near), static_cast<double>(scene.range.z_far));
    } catch (const std::exception& failure) {
        std::fprintf(stderr, "%s\n", failure.what());
        return 1;
    }
}
