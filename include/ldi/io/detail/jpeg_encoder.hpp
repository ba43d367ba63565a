// Writes JPEG files with libjpeg or libjpeg-turbo, if ldi::io was configured with one of them. libjpeg-turbo is about seven times
// as fast as stb_image_write and uses the same quantization and Huffman tables.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>
#include <ldi/io/detail/jpeg_errors.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <jpeglib.h>

#include <jerror.h>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Encodes one file.
class jpeg_encoder {
public:
    jpeg_encoder() {
        state_.err = errors_.start();
        file_.base.init_destination = file_.base.term_destination = [](j_compress_ptr) {};
        file_.base.empty_output_buffer = [](j_compress_ptr state) {
            if (!reinterpret_cast<file*>(state->dest)->grow()) state->err->msg_code = JERR_OUT_OF_MEMORY, fail(state);
            return static_cast<boolean>(TRUE);
        };
    }
    jpeg_encoder(const jpeg_encoder&) = delete;
    jpeg_encoder& operator=(const jpeg_encoder&) = delete;
    ~jpeg_encoder() {
        jpeg_destroy_compress(&state_);
        std::free(file_.bytes);
    }

    /// Encodes a picture. Raises out_of_memory, or too_large if libjpeg rejects the picture for any other reason.
    ///
    /// quality  1 to 100
    std::vector<std::byte> encode(image_view<const std::uint8_t> picture, int quality) {
        if (!write(picture, quality)) {
            if (errors_.base.msg_code == JERR_OUT_OF_MEMORY) out_of_memory();
            char reason[JMSG_LENGTH_MAX] = {};
            errors_.base.format_message(reinterpret_cast<j_common_ptr>(&state_), reason);
            raise(error_code::too_large, "encode_jpeg", "a picture that libjpeg can encode", reason);
        }
        return {file_.bytes, file_.bytes + (file_.capacity - file_.base.free_in_buffer)};
    }

private:
    struct file {
        jpeg_destination_mgr base;  // first, so that a pointer to it can be cast to a pointer to `file`
        std::byte* bytes;
        std::size_t capacity;

        /// Doubles the buffer, which is full; returns false if there is no memory.
        bool grow() {
            const std::size_t used = capacity, larger = 2 * capacity + 4096;
            void* const place = std::realloc(bytes, larger);
            if (place == nullptr) return false;
            bytes = static_cast<std::byte*>(place), capacity = larger;
            base.next_output_byte = reinterpret_cast<JOCTET*>(bytes + used), base.free_in_buffer = larger - used;
            return true;
        }
    };

    static void fail(j_compress_ptr state) { state->err->error_exit(reinterpret_cast<j_common_ptr>(state)); }

    /// Encodes a picture into file_; returns false after an error.
    bool write(image_view<const std::uint8_t> picture, int quality) {
        if (setjmp(errors_.back) != 0) return false;
        jpeg_create_compress(&state_);
        state_.dest = &file_.base;
        if (!file_.grow()) state_.err->msg_code = JERR_OUT_OF_MEMORY, fail(&state_);
        state_.image_width = static_cast<JDIMENSION>(picture.width());
        state_.image_height = static_cast<JDIMENSION>(picture.height());
        state_.input_components = static_cast<int>(picture.channels());
        state_.in_color_space = picture.channels() == 3 ? JCS_RGB : JCS_GRAYSCALE;
        jpeg_set_defaults(&state_);
        jpeg_set_quality(&state_, quality, TRUE);
        const int sampling = picture.channels() == 3 && quality <= 90 ? 2 : 1;
        state_.comp_info[0].h_samp_factor = state_.comp_info[0].v_samp_factor = sampling;
        jpeg_start_compress(&state_, TRUE);
        while (state_.next_scanline < state_.image_height) {
            JSAMPROW row = const_cast<JSAMPROW>(picture.row(state_.next_scanline));
            jpeg_write_scanlines(&state_, &row, 1);
        }
        jpeg_finish_compress(&state_);
        return true;
    }

    jpeg_compress_struct state_ = {};
    jpeg_errors errors_ = {};
    file file_ = {};
};

}}}  // namespace ldi::detail
