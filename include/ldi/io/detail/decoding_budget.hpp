// Budget of one input file (io/picture_limits.hpp). Every decoder charges the budget before it allocates memory.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/formats/picture_formats.hpp>
#include <ldi/formats/picture_header.hpp>
#include <ldi/io/picture_limits.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Raises too_large if a header states more than `limit` pixels.
///
/// height  above 0
inline void check_pixel_count(std::size_t width, std::size_t height, std::size_t limit, const std::string& where) {
    if (width > limit / height)
        raise(error_code::too_large, where, "at most " + std::to_string(limit) + " pixels",
              std::to_string(width) + " x " + std::to_string(height));
}

class decoding_budget {
public:
    /// file_bytes  length of the input file
    decoding_budget(const picture_limits& limits, picture_formats formats, std::size_t file_bytes)
        : max_pixels_(limits.max_pixels), formats_(formats), samples_(limits.max_scanned_samples), file_bytes_(file_bytes) {
        const double granted =
            nearest_double(limits.max_memory) + nearest_double(limits.max_memory_per_byte) * nearest_double(file_bytes);
        constexpr std::size_t max_memory = (std::numeric_limits<std::size_t>::max)() / 4;
        memory_ = granted < nearest_double(max_memory) ? static_cast<std::size_t>(granted) : max_memory;
    }

    std::size_t max_pixels() const { return max_pixels_; }
    std::size_t charged() const { return charged_; }
    std::size_t left() const { return memory_ - charged_; }

    /// Lowers the maximum number of pixels for all further pictures.
    void lower_max_pixels(std::size_t max_pixels) { max_pixels_ = (std::min)(max_pixels_, max_pixels); }

    /// Raises unsupported if the caller has disabled the format.
    void check_format(picture_format format, const std::string& where) const {
        if (!formats_.contains(format))
            raise(error_code::unsupported, where, "an enabled format: " + formats_.text(),
                  "a " + std::string(to_string(format)) + " file");
    }

    /// Charges memory. Raises too_large.
    ///
    /// what  purpose of the memory, for the error message; for example "metadata of 12 bytes"
    void charge(double bytes, const std::string& where, const std::string& what) {
        if (!(bytes <= nearest_double(left())))
            raise(error_code::too_large, where,
                  "a file that needs at most " + std::to_string(memory_ / 1'000'000) + " MB to decode, of which " +
                      std::to_string(left() / 1'000'000) + " MB are left",
                  what + " in a file of " + std::to_string(file_bytes_) + " bytes");
        charged_ += static_cast<std::size_t>(bytes);
    }
    void charge_samples(double samples, const std::string& where, const std::string& what) {
        if (!(samples <= nearest_double(samples_)))
            raise(error_code::too_large, where, "scans and tiles of at most " + std::to_string(samples_) + " samples", what);
        samples_ -= static_cast<std::uint64_t>(samples);
    }

    /// Charges the cost of decoding a picture. Raises unsupported, too_large.
    void charge(const picture_header& header, const std::string& where) {
        check_format(header.format, where);
        check_pixel_count(header.width, header.height, max_pixels_, where);
        const double pixels = nearest_double(header.width) * nearest_double(header.height);
        const std::string size = std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels";
        charge(pixels * nearest_double(header.memory_per_pixel) + header.more_memory, where, size);
        if (header.scanned_channels == 0) return;
        // A scan of a JPEG file processes whole blocks, which are up to 32 x 32 pixels large.
        const auto padded = [](std::size_t side) { return nearest_double((side + 31) / 32 * 32); };
        charge_samples(nearest_double(header.scanned_channels) * padded(header.width) * padded(header.height), where,
                       size + ", " + std::to_string(header.scanned_channels) + " times");
    }

private:
    std::size_t max_pixels_ = 0, memory_ = 0, charged_ = 0;
    picture_formats formats_;
    std::uint64_t samples_ = 0;
    std::size_t file_bytes_ = 0;
};

}}}  // namespace ldi::detail
