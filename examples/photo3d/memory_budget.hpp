// How much memory a photo takes, known from its file's header before it is decoded, and who may take it now.
//
// The figures are measured: peaks of whole runs over 35 photographs, 0.15 to 9.4 megapixels worked on, and over one of 16
// megapixels in every kind of file, worked on at 256 pixels. `bench/batch/run.sh` checks that whole batches stay within their
// bounds.
#pragma once

#include "arguments.hpp"

#include <ldi/base/error.hpp>
#include <ldi/formats/detail/picture_format.hpp>

#include <unistd.h>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <span>
#include <string>
#include <utility>

namespace ldi::examples {

/// Bytes of memory that this process has now; 0 where the system does not say.
inline std::size_t memory_in_use() {
    unsigned long all = 0, resident = 0;
    std::FILE* const facts = std::fopen("/proc/self/statm", "r");
    if (facts == nullptr) return 0;
    if (std::fscanf(facts, "%lu %lu", &all, &resident) != 2) resident = 0;
    std::fclose(facts);
    return static_cast<std::size_t>(resident) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// Bytes per stored pixel at most while a file is decoded.
inline std::size_t decoding_bytes_per_pixel(const detail::picture_header& header) {
    if (header.format == picture_format::jpeg) return 12;  // measured: 6.6, progressive 11.1
    return header.bits == 16 ? 18 : 9;                             // measured: 17.0 and 8.8, both with alpha
}

/// Bytes that showing a photo larger than it is worked on takes at most: its pixels at that size, a sheet of them, and files.
inline std::size_t memory_for_sheets(std::size_t pixels, double shown_share, const arguments& a) {
    // Of files: of noise, 0.54 at quality 85 and 2.7 at 100. Three hold it at once: textures, GLB, page.
    const double per_shown_pixel = a.quality > 90 ? 12 : 3;
    constexpr std::size_t per_texel = 3, per_texel_compressed = 24;  // measured: 18.3 while WebP is written
    const double shown = static_cast<double>(pixels) * shown_share;
    const std::size_t side = static_cast<std::size_t>(sheet_options().max_side);
    return static_cast<std::size_t>(shown * (per_shown_pixel + (shown_share < 1 ? 3 : 0))) +
           std::min(side * side, 2 * static_cast<std::size_t>(shown)) *
               (a.compression.is_wanted ? per_texel_compressed : per_texel);
}

/// Bytes that a photo takes at most, its file's own included.
///
/// depth  the file of its depth map, empty for none
/// Raises what reading a header raises.
inline std::size_t memory_for(std::span<const std::byte> photo, std::span<const std::byte> depth, const arguments& a,
                              const std::string& name) {
    constexpr double per_pixel_of_layers = 92;       // measured: at most 90.6
    constexpr double hidden_share = 0.35;            // more than any photograph's with the motion that is the default
    constexpr std::size_t in_any_case = 24'000'000;  // activations of the depth network, textures of small photos, pages
    const detail::picture_header header = detail::read_picture_header(photo, name);
    const std::size_t pixels = header.width * header.height;
    const auto shrunk_to = [&](std::size_t long_side) {
        return std::min(1.0, static_cast<double>(long_side) / static_cast<double>(std::max(header.width, header.height)));
    };
    const double shown = shrunk_to(a.long_side), shrunk = std::min(shown, shrunk_to(a.geometry_side));
    const double motion = std::max(1.0, static_cast<double>(a.motion) / static_cast<double>(expand_options().motion));
    const double worked_on = static_cast<double>(pixels) * shrunk * shrunk;
    const std::size_t converting = 3 * pixels +
                                   static_cast<std::size_t>(worked_on * per_pixel_of_layers * (1 + hidden_share * motion)) +
                                   (shrunk < shown ? memory_for_sheets(pixels, shown * shown, a) : 0);
    std::size_t map = 4 * depth.size();  // NPY and PFM: as large in memory
    if (detail::is_jpeg(depth) || detail::is_png(depth)) {
        const detail::picture_header stored = detail::read_picture_header(depth, name);
        map = stored.width * stored.height * (decoding_bytes_per_pixel(stored) + 8);
    }
    return in_any_case + photo.size() + depth.size() + map + std::max(pixels * decoding_bytes_per_pixel(header), converting);
}

/// Lets photos in as far as they fit. What the process has when this is made counts, too.
class memory_budget {
public:
    /// bytes  0: half of the machine's
    explicit memory_budget(std::size_t bytes) : limit_(bytes != 0 ? bytes : half_of_machine()), used_(memory_in_use()) {}

    /// Raises too_large for what does not even fit alone.
    void check(std::size_t bytes, const std::string& name) const {
        if (base_ + bytes <= limit_) return;
        raise(error_code::too_large, name, "a photo that " + megabytes(limit_) + " of memory hold (--memory)",
              "one that may take " + megabytes(base_ + bytes));
    }

    /// Waits until so much is free. What it is asked for must have been checked, together with what the caller holds already, and
    /// only one thread asks.
    void admit(std::size_t bytes) {
        std::unique_lock lock(mutex_);
        released_.wait(lock, [&] { return used_ + bytes <= limit_; });
        used_ += bytes;
    }

    void release(std::size_t bytes) {
        const std::lock_guard lock(mutex_);
        used_ -= bytes;
        released_.notify_all();
    }

    /// Before work begins that takes so much: what the C library keeps of earlier photos goes back where it would be too much.
    void make_room(std::size_t bytes) const {
#if defined(__GLIBC__)
        if (memory_in_use() + bytes > limit_) malloc_trim(0);
#else
        static_cast<void>(bytes);
#endif
    }

private:
    static std::size_t half_of_machine() {
        return static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) / 2;
    }
    static std::string megabytes(std::size_t bytes) { return std::to_string((bytes + 999'999) / 1'000'000) + " MB"; }

    std::size_t limit_, used_;
    std::size_t base_ = used_;
    std::mutex mutex_;
    std::condition_variable released_;
};

/// What one photo holds of a budget; gives it back at its end.
class memory_share {
public:
    memory_share() = default;
    memory_share(const memory_share&) = delete;
    memory_share& operator=(const memory_share&) = delete;
    ~memory_share() { shrink(0); }

    std::size_t bytes() const { return bytes_; }

    /// Waits for more. Raises as memory_budget::check() does.
    void grow(memory_budget& budget, std::size_t bytes, const std::string& name) {
        if (bytes <= bytes_) return;
        budget.check(bytes, name);
        budget.admit(bytes - bytes_);
        budget_ = &budget, bytes_ = bytes;
    }

    void shrink(std::size_t bytes) {
        if (bytes >= bytes_) return;
        const std::size_t before = std::exchange(bytes_, bytes);
        budget_->release(before - bytes);
    }

private:
    memory_budget* budget_ = nullptr;
    std::size_t bytes_ = 0;
};

}  // namespace ldi::examples
