// A real photo and its conversion to a 3D photo at 1152 x 1536, for measurements of stages and networks.
//
// If ../shared is present, this is a phone photo with the published network's depth; otherwise, it is the sample with its own
// depth map.
#pragma once

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/weight_files.hpp>
#include <ldi/photo3d.hpp>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <filesystem>
#include <optional>

namespace ldi_bench {

inline std::optional<ldi::tiefenrausch> published_network() {
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "tiefenrausch/model";
    if (!std::filesystem::exists(folder)) return std::nullopt;
    return ldi::load_tiefenrausch(folder);
}

inline ldi::photo3d converted_photo(const ldi::photo3d_options& options = {}) {
#if defined(__GLIBC__)
    // Keeps freed memory in the process. Stages free and allocate the same tens of megabytes; times do not include what the
    // system needs to provide new pages.
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
    ldi::serial_executor one_thread;
    const std::filesystem::path photo = std::filesystem::path(LDI_SHARED_DIR) / "depth_companions/iphone_mpo_a.jpg";
    const ldi::diffusion_inpainter inpainter;
    if (const auto network = published_network(); network && std::filesystem::exists(photo))
        return ldi::make_photo3d(ldi::load_photo(photo).color, *network, inpainter, options, one_thread);
    const std::filesystem::path sample = std::filesystem::path(LDI_SOURCE_DIR) / "examples/photo3d";
    ldi::photo3d_options sample_options = options;
    sample_options.normalize.is_inverse_depth = false;
    const ldi::given_disparity depth{ldi::fill_invalid(ldi::load_depth_map(sample / "sample_depth.png"))};
    return ldi::make_photo3d(ldi::load_photo(sample / "sample.jpg").color, depth, inpainter, sample_options, one_thread);
}

}  // namespace ldi_bench
