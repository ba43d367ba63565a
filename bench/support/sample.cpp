#include "bench/support/sample.hpp"

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/photo3d.hpp>

#include <utility>

namespace ldi_bench {

namespace {

/// Keeps every fourth row and column.
ldi::image<float> every_fourth(const ldi::image<float>& from) {
    ldi::image<float> result(from.height() / 4, from.width() / 4);
    for (std::size_t y = 0; y < result.height(); ++y)
        for (std::size_t x = 0; x < result.width(); ++x) result(y, x) = from(4 * y + 2, 4 * x + 2);
    return result;
}

sample_stages make_sample() {
    const ldi::serial_executor one_thread;
    ldi::photo3d_options options;
    options.normalize.is_inverse_depth = false;
    sample_stages s;
    s.photo = ldi::load_photo(sample_file("sample.jpg")).color;
    s.depth_map = ldi::fill_invalid(ldi::load_depth_map(sample_file("sample_depth.png")));
    s.estimate = ldi::normalize(every_fourth(s.depth_map), options.normalize).disparity;
    s.filtered = ldi::weighted_median(ldi::resample_estimate(s.estimate, s.photo, options, one_thread), options.surface,
                                      options.median, one_thread);
    ldi::cleaned_photo cleaned = ldi::clean_depth(s.photo, ldi::given_disparity{s.depth_map}, options);
    s.facts = {ldi::pinhole_camera{1152, 1536, ldi::focal_length_from_35mm(options.focal_length_35mm, 1152, 1536)}, cleaned.range,
               options.surface};
    s.lifted = ldi::lift(cleaned.photo, cleaned.disparity, s.facts);
    s.prepared = ldi::lift_photo(cleaned, options);
    auto grown = ldi::expand(s.prepared.layer, options.surface, s.prepared.curves, options.expand);
    s.facts.motion = grown.motion;
    s.uncolored = std::move(grown.layers);
    s.colored = s.uncolored;
    ldi::diffusion_inpainter().inpaint(s.colored);
    ldi::working_layers<> finished = s.uncolored;
    ldi::inpaint_hidden(finished, s.prepared.rims, ldi::diffusion_inpainter(), options);
    s.layers = ldi::photo_layers(std::move(finished));
    s.facts.margin = ldi::grow_past_frame(s.layers, s.facts);
    s.charts = ldi::make_charts(s.layers, options.surface, options.charts);
    s.atlas = ldi::make_atlas(s.layers, s.charts, options.atlas);
    s.mesh = ldi::build_mesh(s.layers, s.facts, s.charts, s.atlas, options.mesh);
    return s;
}

}  // namespace

std::string sample_file(const std::string& name) { return LDI_SOURCE_DIR "/examples/photo3d/" + name; }
std::string model_file(const std::string& name) { return LDI_SOURCE_DIR "/examples/models/" + name; }

const sample_stages& sample() {
    static const sample_stages made = make_sample();
    return made;
}

const ldi::graph& sample_graph() { return sample().uncolored.topology(); }

const ldi::graph& image_graph() {
    static const ldi::graph made = ldi::make_grid(1152, sample_graph().count() / 1152);
    return made;
}

}  // namespace ldi_bench
