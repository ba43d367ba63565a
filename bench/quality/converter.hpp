// Converts photos as the program does: the silhouette network decides silhouettes where depth is coarser than the photo.
#pragma once

#include <ldi/depth/network_decider.hpp>
#include <ldi/io/weight_files.hpp>
#include <ldi/networks/silhouettes.hpp>
#include <ldi/photo3d.hpp>

#include <CLI/CLI.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

namespace ldi_quality {

/// The option --silhouette-model of the quality programs.
class silhouette_option {
public:
    explicit silhouette_option(CLI::App& app) {
        app.add_option("--silhouette-model", path_,
                       "weights of the network that decides silhouettes; none: align silhouettes, without a network")
            ->capture_default_str();
    }

    std::optional<ldi::silhouette_network> load() const {
        if (path_ == "none") return std::nullopt;
        return ldi::load_silhouettes(path_);
    }

private:
    std::filesystem::path path_ = LDI_SOURCE_DIR "/examples/models/silhouettes.safetensors";
};

/// Calls make_photo3d() with the options of the program.
class converter {
public:
    /// silhouettes  the network that decides silhouettes; empty: align them
    explicit converter(std::optional<ldi::silhouette_network> silhouettes) : silhouettes_(std::move(silhouettes)) {}

    template <ldi::depth_estimator Estimator, ldi::color_inpainter Inpainter, ldi::executor Executor>
    ldi::photo3d operator()(ldi::image_view<const std::uint8_t> photo, Estimator&& depth, const Inpainter& inpainter,
                            ldi::photo3d_options options, Executor&& threads) const {
        if (silhouettes_) options.level = ldi::level_options();
        return ldi::make_photo3d(photo, std::forward<Estimator>(depth),
                                 ldi::network_decider(silhouettes_ ? &*silhouettes_ : nullptr), inpainter, options, threads);
    }

private:
    std::optional<ldi::silhouette_network> silhouettes_;
};

}  // namespace ldi_quality
