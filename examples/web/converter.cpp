// The converter of the page: turns the bytes of a photo's file into a 3D photo (GLB). build.sh compiles it to WebAssembly;
// worker.js calls it.
//
// One thread calls all functions, one after the other. A function that fails returns 0, and web_message() then returns the
// message of the error. With -pthread, the functions use all processors.

#include "landing_pads.hpp"

#include "../photo3d/depth_direction.hpp"

#include <ldi/depth/network_decider.hpp>
#include <ldi/formats/farbrausch.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/formats/silhouettes.hpp>
#include <ldi/formats/tiefenrausch.hpp>
#include <ldi/io/detail/stb_image_write.hpp>
#include <ldi/io/photo_depth.hpp>
#include <ldi/photo3d.hpp>

#include <emscripten.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

EM_JS(void, report_progress, (const char* stage, int length, float fraction),
      { Module.onProgress(UTF8ToString(stage, length), fraction); });

namespace {

using namespace ldi;

#if defined(__EMSCRIPTEN_PTHREADS__)
struct executor_of_page : thread_pool {
    executor_of_page() : thread_pool((std::min)(std::thread::hardware_concurrency(), LDI_MAX_THREADS)) {}
};
#else
using executor_of_page = serial_executor;
#endif

/// State that is kept between calls.
struct converter {
    executor_of_page threads;
    std::optional<tiefenrausch> depth;
    std::optional<farbrausch> inpainting;
    std::optional<silhouette_network> silhouettes;
    std::optional<photo_with_depth> input;
    std::vector<std::byte> poster;
    buffer<std::byte> glb;
    photo3d_options options;
    std::size_t width = 0, height = 0;
    bool is_past_frame = false;
    std::string depth_source, message;
};

converter& state() {
    static converter only;
    return only;
}

/// Calls `function`. Returns 1, or 0 after an error. Stores the error's message for web_message().
template <class Function>
int attempt(Function&& function) {
    try {
        state().message.clear();
        function();
        return 1;
    } catch (const std::bad_alloc&) {
        state().message = "not enough memory";
    } catch (const std::length_error&) {
        state().message = "not enough memory";
    } catch (const std::exception& e) {
        state().message = e.what();
    }
    return 0;
}

progress_listener listener() {
    progress_listener result;
    result.on_progress = [](void*, std::string_view stage, float fraction) {
        report_progress(stage.data(), static_cast<int>(stage.size()), fraction);
    };
    return result;
}

/// Encodes a texture as a JPEG file.
std::vector<std::byte> encode_texture(image_view<const std::uint8_t> picture, int quality) {
    std::vector<std::byte> bytes;
    const auto append = [](void* to, void* data, int size) {
        std::vector<std::byte>& all = *static_cast<std::vector<std::byte>*>(to);
        const std::byte* const first = static_cast<const std::byte*>(data);
        all.insert(all.end(), first, first + size);
    };
    ldi::detail::stb::stbi_write_jpg_to_func(append, &bytes, static_cast<int>(picture.width()),
                                             static_cast<int>(picture.height()), static_cast<int>(picture.channels()),
                                             picture.data(), quality);
    return bytes;
}

/// Encodes a small picture of the photo, which pages show while the 3D photo loads.
std::vector<std::byte> encode_poster(const image<std::uint8_t>& photo) {
    constexpr std::size_t long_side = 512;
    constexpr int quality = 70;
    return encode_texture(ldi::shrink_photo(photo, long_side, state().threads), quality);
}

template <class T>
image<T> copy_of(const T* values, std::size_t height, std::size_t width, std::size_t channels) {
    image<T> copy(height, width, channels, unset);
    std::copy_n(values, height * width * channels, copy.data());
    return copy;
}

/// Fills invalid pixels of a file's depth map. Inverts the map if its direction is a guess that the depth network contradicts.
void complete(photo_with_depth& input) {
    if (!input.depth) return;
    photo_depth& depth = *input.depth;
    depth.disparity = fill_invalid(shrink_depth_map(std::move(depth.disparity)), depth.source);
    if (depth.is_white_near_a_guess) examples::invert_as_seen(input, *state().depth, state().threads);
}

/// Makes the 3D photo. Releases the input as soon as possible, because browsers on phones have little memory.
photo3d make(photo_with_depth input) {
    photo3d_options options = state().options;
    options.progress = listener();
    options.keeps_depth_maps = false;
    options.level = level_options();
    if (input.photo.focal_length_35mm) options.focal_length_35mm = *input.photo.focal_length_35mm;
    options.normalize.is_metric = input.depth && input.depth->is_metric;
    options.normalize.is_inverse_depth = !input.depth || input.depth->is_inverse_depth;
    const network_decider decider(&*state().silhouettes);
    const image<std::uint8_t>& photo = input.photo.color;
    cleaned_photo cleaned =
        input.depth ? clean_depth(photo, given_disparity{std::move(input.depth->disparity)}, decider, options, state().threads)
                    : clean_depth(photo, *state().depth, decider, options, state().threads);
    input = {};
    return make_photo3d(std::move(cleaned), photo_columns<>(), *state().inpainting, options, state().threads);
}

/// Encodes the GLB and the poster, and stores them and the photo's size for the functions below.
///
/// is_exact  write the texture as PNG, so that a test can compare its pixels
void encode(const photo3d& made, const std::string& name, bool is_exact) {
    constexpr int quality = 85;
    const progress_listener progress = listener();
    progress.report("encoding", 0);
    converter& c = state();
    glb_options facts;
    facts.camera = made.facts.camera;
    facts.motion = made.facts.motion, facts.is_past_frame = made.facts.margin > 0;
    facts.range = made.facts.range;
    facts.source = name;
    if (is_exact) {
        c.glb = encode_glb(made.mesh, encode_plain_png(made.atlas.color), facts);
    } else {
        c.glb = encode_glb(made.mesh, encode_texture(made.atlas.color, quality), facts);
    }
    c.poster = encode_poster(made.photo);
    c.width = made.photo.width(), c.height = made.photo.height();
    c.is_past_frame = facts.is_past_frame;
    progress.report("encoding", 1);
}

std::span<const std::byte> bytes_of(const void* data, std::size_t size) { return {static_cast<const std::byte*>(data), size}; }

/// Makes a scene of discs in front of a slope, so that every stage has work to do.
photo_with_depth scene_for_warm_up() {
    constexpr std::size_t height = 384, width = 512;
    photo_with_depth scene;
    scene.photo.color = image<std::uint8_t>(height, width, 3, unset);
    scene.depth = photo_depth{image<float>(height, width, 1, unset), true, false, false, "warm-up"};
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const std::size_t across = x % 128, down = y % 128;
            const bool is_disc = (across - 64) * (across - 64) + (down - 64) * (down - 64) < 32 * 32;
            scene.depth->disparity.row(y)[x] = is_disc ? 1.0F : 0.1F + 0.0005F * static_cast<float>(y);
            for (std::size_t c = 0; c < 3; ++c)
                scene.photo.color.row(y)[3 * x + c] = static_cast<std::uint8_t>((is_disc ? 200 : 40) + (x * 7 + y * 13 * c) % 23);
        }
    return scene;
}

}  // namespace

extern "C" {

/// Loads a network; returns 1, or 0 after an error.
///
/// kind  0 depth, 1 inpainting, 2 silhouettes
EMSCRIPTEN_KEEPALIVE int web_load(int kind, const void* data, std::size_t size) {
    return attempt([&] {
        if (kind == 0)
            state().depth.emplace(decode_tiefenrausch(bytes_of(data, size), "depth network"));
        else if (kind == 1)
            state().inpainting.emplace(decode_farbrausch(bytes_of(data, size), "inpainting network", std::nullopt));
        else
            state().silhouettes.emplace(decode_silhouettes(bytes_of(data, size), "silhouette network"));
    });
}

/// Frees the GLB and the poster, so that the memory is in the same state before every photo. Any remaining block, such as the
/// capacity that `poster = {}` keeps, would have a different address after each photo and fragment the free memory.
EMSCRIPTEN_KEEPALIVE void web_release() {
    state().glb = {};
    std::vector<std::byte>().swap(state().poster);
}

/// Runs a part of the program, so that the browser compiles and optimizes its code before the first photo; returns 1, or 0 after
/// an error. Parts 0 to 2 together run all stages. Each takes a fraction of a second.
EMSCRIPTEN_KEEPALIVE int web_warm_up(int part) {
    return attempt([part] {
        photo_with_depth scene = scene_for_warm_up();
        if (part == 0)
            for (int i = 0; i < 4; ++i) decode_photo(encode_texture(scene.photo.color, 85), {}, "warm-up");
        if (part == 1) state().depth->disparity(scene.photo.color, {}, state().threads);
        if (part != 2) return;
        encode(make(std::move(scene)), "", false);
        web_release();
    });
}

/// Checks a file's header. Returns 1 if web_open() can decode the file, 2 if the browser must decode it (a format or a color
/// profile for which this program has no library), or 0 after an error.
EMSCRIPTEN_KEEPALIVE int web_inspect(const void* data, std::size_t size, const char* name) {
    int decoder = 1;
    const int is_done = attempt([&] {
        const std::span<const std::byte> file = bytes_of(data, size);
        if (!ldi::detail::is_plain(file)) {
            decoder = 2;
            return;
        }
        const ldi::picture_header header = ldi::detail::read_plain_header(file, name);
        ldi::detail::decoding_budget({}, {}, size).charge(header, name);
        const bool has_profile = header.format == picture_format::png ? !ldi::detail::png_profile(header.profile_chunk).empty()
                                                                      : !ldi::detail::jpeg_profile(header.extensions).empty();
        if (has_profile) decoder = 2;
    });
    return is_done == 0 ? 0 : decoder;
}

/// Sets the error message for a file that the browser cannot decode. Returns 0.
EMSCRIPTEN_KEEPALIVE int web_refuse(const void* data, std::size_t size, const char* name) {
    return attempt([&] {
        const std::span<const std::byte> file = bytes_of(data, size);
        std::string found = ldi::describe_format(file);
        if (ldi::detail::is_heif(file))
            found +=
                ", which this page reads only when opened from a server: open the page from a server, or save the photo as JPEG";
        raise(size == 0 ? error_code::invalid_data : error_code::unsupported, name,
              "a JPEG, PNG, GIF, BMP, WebP or AVIF file, or another format that this browser reads", found);
    });
}

/// Decodes a photo and the depth inside it for web_convert(); returns 1, or 0 after an error.
///
/// rgba  height x width x 4 pixels that the browser has decoded, upright; null: decode the file here
EMSCRIPTEN_KEEPALIVE int web_open(const void* data, std::size_t size, const char* name, const std::uint8_t* rgba,
                                  std::size_t height, std::size_t width) {
    return attempt([&] {
        state().input.reset();
        listener().report("reading photo", 0);
        const std::span<const std::byte> file = bytes_of(data, size);
        state().input = rgba == nullptr ? decode_photo_with_depth(file, {}, name)
                                        : with_depth_inside({rgba, height, width, 4}, file, {}, name);
    });
}

/// Accepts a photo that heic.cpp has decoded, instead of web_open(); returns 1, or 0 after an error.
///
/// color         height x width x 3
/// focal_length  in millimeters on 35 mm film; 0: unknown
/// refused       reason why the depth in the file is not used, or an empty text
EMSCRIPTEN_KEEPALIVE int web_accept(const std::uint8_t* color, std::size_t height, std::size_t width, float focal_length,
                                    const char* refused) {
    return attempt([&] {
        photo_with_depth& input = state().input.emplace();
        input.photo.color = copy_of(color, height, width, 3);
        if (focal_length > 0) input.photo.focal_length_35mm = focal_length;
        input.refused = refused;
    });
}

/// Adds depth to the photo of web_accept(); returns 1, or 0 after an error.
///
/// disparity  height x width
/// source     description of the depth
EMSCRIPTEN_KEEPALIVE int web_add_depth(const float* disparity, std::size_t height, std::size_t width, int is_inverse_depth,
                                       int is_metric, int is_white_near_a_guess, const char* source) {
    return attempt([&] {
        state().input.value().depth = photo_depth{copy_of(disparity, height, width, 1), is_inverse_depth != 0, is_metric != 0,
                                                  is_white_near_a_guess != 0, source};
    });
}

/// Converts the photo of web_open() or web_accept(). Returns 1, or 0 after an error. web_glb() and web_poster() return the
/// results until web_release() frees them.
EMSCRIPTEN_KEEPALIVE int web_convert(const char* name, int is_exact) {
    return attempt([&] {
        photo_with_depth input = std::move(state().input.value());
        state().input.reset();
        complete(input);
        state().depth_source = input.depth ? input.depth->source : input.refused;
        listener().report("reading photo", 1);
        encode(make(std::move(input)), name, is_exact != 0);
    });
}

/// Results of the last call of web_convert(), and the number of threads.
EMSCRIPTEN_KEEPALIVE const void* web_glb() { return state().glb.data(); }
EMSCRIPTEN_KEEPALIVE std::size_t web_glb_size() { return state().glb.size(); }
EMSCRIPTEN_KEEPALIVE const void* web_poster() { return state().poster.data(); }
EMSCRIPTEN_KEEPALIVE std::size_t web_poster_size() { return state().poster.size(); }
EMSCRIPTEN_KEEPALIVE std::size_t web_width() { return state().width; }
EMSCRIPTEN_KEEPALIVE std::size_t web_height() { return state().height; }
EMSCRIPTEN_KEEPALIVE std::size_t web_threads() { return state().threads.concurrency(); }
EMSCRIPTEN_KEEPALIVE int web_is_past_frame() { return state().is_past_frame ? 1 : 0; }
/// Source of the depth in the file, the reason why that depth was not used, or an empty text.
EMSCRIPTEN_KEEPALIVE const char* web_depth_source() { return state().depth_source.c_str(); }
/// Message of the last error.
EMSCRIPTEN_KEEPALIVE const char* web_message() { return state().message.c_str(); }

}  // extern "C"
