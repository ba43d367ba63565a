// Reads HEIC photos and the depth inside them with libheif. The pixels are the same as in the program. build.sh compiles it to
// WebAssembly; source/heic.js calls it in a separate Worker, which the page starts for HEIC photos only.

#include <ldi/io/photo_depth.hpp>
#include <ldi/photo3d/options.hpp>

#include <emscripten.h>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

namespace {

ldi::photo_with_depth loaded;
std::string message;

}  // namespace

extern "C" {

/// Decodes a photo and the depth inside it; returns 1, or 0 after an error.
EMSCRIPTEN_KEEPALIVE int heic_decode(const void* data, std::size_t size, const char* name) {
    try {
        ldi::photo_options options;
        options.long_side = ldi::photo3d_options().long_side;  // the size at which the page converts photos
        loaded = ldi::decode_photo_with_depth({static_cast<const std::byte*>(data), size}, options, name);
        return 1;
    } catch (const std::bad_alloc&) {
        message = "not enough memory";
    } catch (const std::length_error&) {
        message = "not enough memory";
    } catch (const std::exception& e) {
        message = e.what();
    }
    return 0;
}

/// Colors of the photo, height x width x 3.
EMSCRIPTEN_KEEPALIVE const void* heic_color() { return loaded.photo.color.data(); }
EMSCRIPTEN_KEEPALIVE std::size_t heic_height() { return loaded.photo.color.height(); }
EMSCRIPTEN_KEEPALIVE std::size_t heic_width() { return loaded.photo.color.width(); }
/// Focal length in millimeters on 35 mm film; 0: unknown.
EMSCRIPTEN_KEEPALIVE float heic_focal_length() { return loaded.photo.focal_length_35mm.value_or(0.0F); }
/// Reason why depth in the file was not used, or an empty text.
EMSCRIPTEN_KEEPALIVE const char* heic_refused() { return loaded.refused.c_str(); }

/// Disparity, height x width floats; null: none.
EMSCRIPTEN_KEEPALIVE const void* heic_disparity() { return loaded.depth ? loaded.depth->disparity.data() : nullptr; }
EMSCRIPTEN_KEEPALIVE std::size_t heic_disparity_height() { return loaded.depth ? loaded.depth->disparity.height() : 0; }
EMSCRIPTEN_KEEPALIVE std::size_t heic_disparity_width() { return loaded.depth ? loaded.depth->disparity.width() : 0; }
EMSCRIPTEN_KEEPALIVE int heic_is_inverse_depth() { return loaded.depth && loaded.depth->is_inverse_depth ? 1 : 0; }
EMSCRIPTEN_KEEPALIVE int heic_is_metric() { return loaded.depth && loaded.depth->is_metric ? 1 : 0; }
EMSCRIPTEN_KEEPALIVE int heic_is_guess() { return loaded.depth && loaded.depth->is_white_near_a_guess ? 1 : 0; }
EMSCRIPTEN_KEEPALIVE const char* heic_depth_source() { return loaded.depth ? loaded.depth->source.c_str() : ""; }

/// Message of the last error.
EMSCRIPTEN_KEEPALIVE const char* heic_message() { return message.c_str(); }

}  // extern "C"
