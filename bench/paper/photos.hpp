// Photos at the paper's size of 1152 x 1536 pixels, with the disparity of a network.
#pragma once

#include <bench/quality/degraded_depth.hpp>
#include <bench/quality/depth.hpp>

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/photo3d/paper_options.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace ldi_paper {

struct paper_photo {
    std::string name;
    ldi::image<std::uint8_t> photo;
    ldi::given_disparity depth;
    bool is_inverse_depth = true;
    float quantization_step = 1;  ///< ratio of adjacent levels of the network's disparity
};

inline ldi::photo3d_options paper_options_for(const paper_photo& p) {
    ldi::photo3d_options options = ldi::paper_options();
    options.normalize.is_inverse_depth = p.is_inverse_depth;
    options.normalize.relative_step = std::max(options.normalize.relative_step, p.quantization_step - 1);
    return options;
}

/// Crops the middle to 3:4 or 4:3, and resizes it by area averaging.
inline ldi::image<std::uint8_t> at_paper_size(const ldi::image<std::uint8_t>& from) {
    const bool is_upright = from.height() > from.width();
    const std::size_t rows = is_upright ? 1536 : 1152, columns = is_upright ? 1152 : 1536;
    const std::size_t height = std::min(from.height(), from.width() * rows / columns),
                      width = std::min(from.width(), from.height() * columns / rows);
    ldi::image<std::uint8_t> middle(height, width, 3);
    for (std::size_t y = 0; y < height; ++y)
        std::copy_n(from.row((from.height() - height) / 2 + y) + 3 * ((from.width() - width) / 2), 3 * width, middle.row(y));
    ldi::serial_executor one_thread;
    return ldi::area_resize(middle, rows, columns, one_thread);
}

/// The sample with its true depth at a network's resolution: shrunk to 288 x 384, and blurred.
inline paper_photo sample_photo() {
    const std::string file = LDI_SOURCE_DIR "/examples/photo3d/sample";
    const ldi::image<float> map = ldi::fill_invalid(ldi::load_depth_map(file + "_depth.png"));
    return {"sample.jpg", ldi::load_photo(file + ".jpg").color, {ldi_quality::degraded(map, {.sigma = 1, .shift = 0})}, false};
}

/// Returns every fourth of Kodak's 24 photos, with the network's disparity; empty without ../shared.
template <ldi::executor Executor>
std::vector<paper_photo> six_photos(const ldi_quality::named_network& network, Executor& threads) {
    std::vector<paper_photo> result;
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "photos/eval";
    if (!std::filesystem::exists(folder)) {
        std::printf("The sample replaces the paper's six photos: there is no %s.\n", folder.c_str());
        return result;
    }
    std::vector<std::filesystem::path> files;
    for (const auto& file : std::filesystem::directory_iterator(folder)) files.push_back(file.path());
    std::sort(files.begin(), files.end());
    for (std::size_t i = 0; i < files.size(); i += 4) {
        ldi::image<std::uint8_t> photo = at_paper_size(ldi::load_photo(files[i]).color);
        ldi::image<float> disparity = network.second.disparity(photo, {}, threads);
        result.push_back({files[i].filename().string(),
                          std::move(photo),
                          {std::move(disparity)},
                          true,
                          static_cast<float>(network.second.quantization_step())});
    }
    std::printf(
        "Six photos: every fourth of Kodak's 24, cropped to 4:3 and enlarged to 1152 x 1536, since ../shared/photos has none of\n"
        "that size. Enlarging hardly changes times, but the texture files are smaller than those of photos taken at this "
        "size.\n");
    return result;
}

}  // namespace ldi_paper
