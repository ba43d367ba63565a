// Decodes JPEG files at a half, a quarter or an eighth of their size with libjpeg or libjpeg-turbo, if ldi::io was configured
// with one of them.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/io/detail/jpeg_errors.hpp>
#include <ldi/io/detail/stored_photo.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include <jpeglib.h>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Decodes one file.
class jpeg_decoder {
public:
    jpeg_decoder() {
        state_.err = errors_.start();
        errors_.base.emit_message = [](j_common_ptr state, int level) {
            if (level < 0) state->err->error_exit(state);  // a warning: the file is damaged
        };
    }
    jpeg_decoder(const jpeg_decoder&) = delete;
    jpeg_decoder& operator=(const jpeg_decoder&) = delete;
    ~jpeg_decoder() {
        jpeg_destroy_decompress(&state_);
        std::free(samples_);
    }

    /// Decodes a picture of one scan in gray or YCbCr. Returns a picture without samples for any other JPEG file, for a damaged
    /// file, and if memory runs out. The caller then uses stb_image, which decodes the file or reports the error.
    ///
    /// bytes          less than 2 GB
    /// height, width  as in the file's header, for which a decoding_budget has granted memory
    /// divisor        2, 4 or 8: divides the height and the width, which are rounded up
    decoded_picture<std::uint8_t> decode(std::span<const std::byte> bytes, std::size_t height, std::size_t width,
                                         std::size_t divisor) {
        decoded_picture<std::uint8_t> picture;
        if (!read(bytes, height, width, divisor)) return picture;
        picture.samples.reset(samples_);
        samples_ = nullptr;
        picture.height = state_.output_height, picture.width = state_.output_width;
        picture.channels = static_cast<std::size_t>(state_.output_components);
        return picture;
    }

private:
    /// Decodes a file into samples_; returns false if it cannot.
    bool read(std::span<const std::byte> bytes, std::size_t height, std::size_t width, std::size_t divisor) {
        if (setjmp(errors_.back) != 0) return false;
        jpeg_create_decompress(&state_);
        jpeg_mem_src(&state_, reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<unsigned long>(bytes.size()));
        if (jpeg_read_header(&state_, TRUE) != JPEG_HEADER_OK) return false;
        if (state_.image_height != height || state_.image_width != width) return false;
        if (has_rgb_names()) return false;
        const bool is_gray = state_.jpeg_color_space == JCS_GRAYSCALE;
        if (!is_gray && state_.jpeg_color_space != JCS_YCbCr) return false;
        if (jpeg_has_multiple_scans(&state_) != FALSE || state_.arith_code != FALSE) return false;
        state_.out_color_space = is_gray ? JCS_GRAYSCALE : JCS_RGB;
        state_.scale_num = 1, state_.scale_denom = static_cast<unsigned>(divisor);
        jpeg_start_decompress(&state_);
        const std::size_t row_bytes = std::size_t{state_.output_width} * static_cast<std::size_t>(state_.output_components);
        samples_ = static_cast<std::uint8_t*>(std::malloc(row_bytes * state_.output_height));
        if (samples_ == nullptr) return false;
        while (state_.output_scanline < state_.output_height) {
            JSAMPROW row = samples_ + row_bytes * state_.output_scanline;
            jpeg_read_scanlines(&state_, &row, 1);
        }
        jpeg_finish_decompress(&state_);
        return true;
    }

    /// Whether the channels have the names R, G and B. stb_image then reads them as such, whatever other markers say.
    bool has_rgb_names() const {
        const jpeg_component_info* const channels = state_.comp_info;
        return state_.num_components == 3 && channels[0].component_id == 'R' && channels[1].component_id == 'G' &&
               channels[2].component_id == 'B';
    }

    jpeg_decompress_struct state_ = {};
    jpeg_errors errors_ = {};
    std::uint8_t* samples_ = nullptr;
};

}}}  // namespace ldi::detail
