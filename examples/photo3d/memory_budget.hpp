// Predicts from a photo file's header, before decoding, how much memory the photo needs, and admits photos while they fit in
// memory.
//
// The figures are measured peaks of whole runs: over 35 photographs processed at 0.15 to 9.4 megapixels, and over a photograph of
// 16 megapixels in every file format, processed at 256 pixels. `bench/batch/run.sh` checks that whole batches stay within their
// bounds.
#pragma once

#include "arguments.hpp"
#include "heap.hpp"
#include "system.hpp"

#include <ldi/base/error.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo_depth.hpp>

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <utility>

namespace ldi::examples {

/// Returns an upper bound of the bytes that are needed to show a photo larger than its layered image: the photo's pixels at that
/// size, one sheet, and the files.
///
/// pixels       number of pixels of the photo
/// shown_share  number of pixels of the shown photo, as a share of `pixels`, (0, 1]
inline std::size_t memory_for_sheets(std::size_t pixels, double shown_share, const arguments& a) {
    // Pictures of noise have files of 0.54 bytes per pixel at quality 85, and 2.7 at 100. Three copies exist at once: textures,
    // GLB, page.
    const double per_shown_pixel = a.quality > 90 ? 12 : 3;
    constexpr std::size_t per_texel = 3, per_texel_compressed = 24;  // measured: 18.3 while WebP is written
    const double shown = static_cast<double>(pixels) * shown_share;
    const std::size_t side = static_cast<std::size_t>(sheet_options().max_side);
    return static_cast<std::size_t>(shown * (per_shown_pixel + (shown_share < 1 ? 3 : 0))) +
           std::min(side * side, 2 * static_cast<std::size_t>(shown)) *
               (a.compression.is_wanted ? per_texel_compressed : per_texel);
}

/// Upper bounds of the bytes for decoding a photo with its depth maps: the map inside the photo, and the map that an option names
/// or that lies beside the photo.
struct decoding_cost {
    std::size_t height = 0, width = 0;  ///< size of the photo
    std::size_t decoding = 0;           ///< bytes for decoding the photo and the maps
    std::size_t maps = 0;               ///< bytes for decoding the maps alone
    std::size_t held_by_maps = 0;       ///< bytes of the decoded maps
    std::size_t in_stages = 0;          ///< bytes of the maps and of the results of the stages that process them

    /// Reads only the headers of the files. Raises the errors of estimate_photo_with_depth() and estimate_depth_map().
    ///
    /// depth  file of the photo's depth map; empty if there is none
    decoding_cost(std::span<const std::byte> photo, std::span<const std::byte> depth, const arguments& a, const std::string& name,
                  const std::string& depth_name) {
        const decoding_estimate stored = estimate_photo(photo, a.reading(), name);
        height = stored.height, width = stored.width;
        decoding = a.uses_depth_of_photo ? estimate_photo_with_depth(photo, a.reading(), name).memory : stored.memory;
        depth_map_options options = a.depth_map;
        options.formats = a.reading().formats;
        if (!depth.empty()) decoding += estimate_depth_map(depth, options, depth_name).memory;
        maps = decoding - stored.memory;
        // Decoding a map needs at least 8 bytes per sample; 4 of them are the map itself; normalize() needs 8 more.
        held_by_maps = maps / 2;
        in_stages = 3 * held_by_maps;
    }
};

/// Returns an upper bound of the bytes that a photo needs, including its files. A photo with far more hidden surfaces than
/// ordinary photographs may need more; metered_memory limits it.
///
/// file_bytes  size of the files of the photo and its depth map
inline std::size_t memory_for(const decoding_cost& cost, std::size_t file_bytes, const arguments& a) {
    constexpr double per_pixel_of_layers = 92;       // measured: at most 90.6
    constexpr double hidden_share = 0.35;            // more than in any photograph with the default motion
    constexpr std::size_t in_any_case = 24'000'000;  // activations of the depth network, textures of small photos, pages
    const std::size_t pixels = cost.width * cost.height;
    const auto shrunk_to = [&](std::size_t long_side) {
        return std::min(1.0, static_cast<double>(long_side) / static_cast<double>(std::max(cost.width, cost.height)));
    };
    const double shown = shrunk_to(a.long_side), shrunk = std::min(shown, shrunk_to(a.geometry_side));
    const double height = static_cast<double>(cost.height) * shrunk, width = static_cast<double>(cost.width) * shrunk;
    const double side = std::max(height, width),
                 grown = a.is_paper ? paper_options().expand.iterations : static_cast<double>(a.motion) * side;
    const double motion = std::max(1.0, grown / (static_cast<double>(expand_options().motion) * side));
    const double margin = a.frame == photo_frame::grow ? 2 + (0.5 + 0.02) * static_cast<double>(a.motion) * side : 0.0;
    const double worked_on = (height + 2 * margin) * (width + 2 * margin);
    const std::size_t converting = 3 * pixels + cost.in_stages +
                                   static_cast<std::size_t>(worked_on * per_pixel_of_layers * (1 + hidden_share * motion)) +
                                   (shrunk < shown ? memory_for_sheets(pixels, shown * shown, a) : 0);
    return in_any_case + file_bytes + std::max(cost.decoding, converting);
}

/// Admits photos while they fit in memory. Memory that the process already uses at construction counts as used.
class memory_budget {
public:
    /// bytes  0: half of available_memory()
    explicit memory_budget(std::size_t bytes) : limit_(bytes != 0 ? bytes : available_memory() / 2), used_(memory_in_use()) {}

    /// Raises too_large for a request that exceeds the whole budget.
    void check(std::size_t bytes, const std::string& name) const {
        if (bytes > for_one()) raise(error_code::too_large, name, expected(), "one that may take " + megabytes(base_ + bytes));
    }

    /// Raises too_large for a photo whose stages need more than for_one().
    [[noreturn]] void refuse(const std::string& name) const {
        raise(error_code::too_large, name, expected(), "one that needs more, because its depth hides large areas");
    }

    /// Waits until `bytes` are free. check() must have accepted the sum of this request and the caller's share. Only one thread
    /// may call this function.
    void admit(std::size_t bytes) {
        std::unique_lock lock(mutex_);
        released_.wait(lock, [&] { return used_ + bytes <= limit_; });
        used_ += bytes;
    }

    /// Same as admit(), but does not wait. Any thread may call it.
    bool try_admit(std::size_t bytes) {
        const std::lock_guard lock(mutex_);
        if (bytes > limit_ || used_ > limit_ - bytes) return false;
        used_ += bytes;
        return true;
    }

    /// Number of bytes that a single photo can use if it has the whole budget.
    std::size_t for_one() const { return limit_ > base_ ? limit_ - base_ : 0; }

    void release(std::size_t bytes) {
        const std::lock_guard lock(mutex_);
        used_ -= bytes;
        released_.notify_all();
    }

    /// Makes room for work that needs `bytes`: if necessary, returns to the system the memory that the C library has kept from
    /// earlier photos.
    void make_room(std::size_t bytes) const {
        if (memory_in_use() + bytes > limit_) trim_heap();
    }

private:
    std::string expected() const { return "a photo that " + megabytes(limit_) + " of memory can hold (--memory)"; }
    static std::string megabytes(std::size_t bytes) { return std::to_string((bytes + 999'999) / 1'000'000) + " MB"; }

    std::size_t limit_, used_;
    std::size_t base_ = used_;
    std::mutex mutex_;
    std::condition_variable released_;
};

/// One photo's share of a budget, returned at destruction.
class memory_share {
public:
    memory_share() = default;
    memory_share(const memory_share&) = delete;
    memory_share& operator=(const memory_share&) = delete;
    ~memory_share() { shrink(0); }

    std::size_t bytes() const { return bytes_; }

    /// Enlarges the share to `bytes` in total, unless it is that large already. Waits until the budget has enough free memory.
    /// Raises the errors of memory_budget::check().
    void grow(memory_budget& budget, std::size_t bytes, const std::string& name) {
        if (bytes <= bytes_) return;
        budget.check(bytes, name);
        budget.admit(bytes - bytes_);
        budget_ = &budget, bytes_ = bytes;
    }

    /// Adds to the share if the memory is free now.
    bool try_add(std::size_t bytes) {
        if (budget_ == nullptr || !budget_->try_admit(bytes)) return false;
        bytes_ += bytes;
        return true;
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

/// Memory for the stages of one photo: the unused part of its share, and more while the budget has free memory. The limit
/// therefore holds even for depth maps with many times more hidden surfaces than ordinary photographs.
class metered_memory {
public:
    /// held  bytes of the share in use outside the stages: files, the photo, depth maps
    metered_memory(memory_share& share, std::size_t held) : share_(share), used_(held) {}
    metered_memory(const metered_memory&) = delete;
    metered_memory& operator=(const metered_memory&) = delete;

    const memory& source() const { return source_; }
    bool was_refused() const { return was_refused_; }

private:
    void* allocate(std::size_t bytes, std::size_t alignment) {
        const std::lock_guard lock(mutex_);
        const std::size_t needed = used_ + charge(bytes);
        if (needed > share_.bytes() && !share_.try_add(needed - share_.bytes())) {
            was_refused_ = true;
            return nullptr;
        }
        void* const block = below_.allocate(below_.context, bytes, alignment);
        used_ += block == nullptr ? 0 : charge(bytes);
        return block;
    }
    void release(void* block, std::size_t bytes) {
        below_.release(below_.context, block, bytes);
        const std::lock_guard lock(mutex_);
        used_ -= charge(bytes);
    }
    /// Adds a quarter, for gaps between blocks and for allocations elsewhere, such as files being encoded (measured: 16 %).
    static std::size_t charge(std::size_t bytes) { return bytes + bytes / 4; }

    const memory& below_ = program_memory();
    memory_share& share_;
    std::size_t used_;
    bool was_refused_ = false;
    std::mutex mutex_;
    memory source_{this,
                   [](void* self, std::size_t bytes, std::size_t alignment) {
                       return static_cast<metered_memory*>(self)->allocate(bytes, alignment);
                   },
                   [](void* self, void* block, std::size_t bytes) { static_cast<metered_memory*>(self)->release(block, bytes); }};
};

}  // namespace ldi::examples
