// Statistics of a run of photo3d, such as stage times and sizes: as a printed table, and as JSON.
#pragma once

#include "messages.hpp"
#include "system.hpp"

#include <ldi/core/runs.hpp>
#include <ldi/photo3d.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

namespace ldi::examples {

/// Duration of a stage, in milliseconds.
struct stage_time {
    std::string stage;
    double elapsed = 0;
    double processor = 0;  ///< processor time of the thread that runs the stages; with one thread, all processor time
};

/// Measures and prints the durations of the stages.
class stage_clock {
public:
    /// quiet  print nothing during the run
    explicit stage_clock(bool quiet) : quiet_(quiet), is_terminal_(is_terminal(stderr)) {}
    ~stage_clock() {
        if (is_running_ && !quiet_ && is_terminal_) std::fputc('\n', stderr);  // ends the progress line
    }
    stage_clock(const stage_clock&) = delete;
    stage_clock& operator=(const stage_clock&) = delete;

    progress_listener listener() {
        progress_listener o;
        o.user = this;
        o.on_progress = [](void* self, std::string_view stage, float fraction) {
            static_cast<stage_clock*>(self)->on_progress(stage, fraction);
        };
        return o;
    }

    /// Starts a stage outside ldi, such as reading the photo. It ends with the next stage, or with finish().
    void begin(std::string_view stage) {
        finish();
        stages_.push_back({std::string(stage)});
        processor_started_ = processor_time_of_thread();
        started_ = clock::now();
        is_running_ = true;
        shown_tens_ = -1;
        show(0);
    }

    void finish() {
        if (!is_running_) return;
        stage_time& last = stages_.back();
        last.elapsed = std::chrono::duration<double, std::milli>(clock::now() - started_).count();
        last.processor = processor_time_of_thread() - processor_started_;
        is_running_ = false;
        if (!quiet_) std::fprintf(stderr, "%s%-26s %8.1f ms\n", is_terminal_ ? "\r" : "", last.stage.c_str(), last.elapsed);
    }

    /// All stages in order.
    const std::vector<stage_time>& stages() const { return stages_; }

private:
    using clock = std::chrono::steady_clock;

    void on_progress(std::string_view stage, float fraction) {
        if (!is_running_ || stages_.back().stage != stage) begin(stage);
        show(static_cast<int>(100.0F * fraction));
    }

    void show(int percent) {
        if (quiet_ || !is_terminal_ || percent / 10 == shown_tens_) return;
        shown_tens_ = percent / 10;
        std::fprintf(stderr, "\r%-26s %7d %%", stages_.back().stage.c_str(), percent);
    }

    bool quiet_, is_terminal_;  // if stderr is not a terminal, each stage's line is printed at its end
    bool is_running_ = false;
    int shown_tens_ = -1;  // tens of percent; -1: nothing yet
    clock::time_point started_;
    double processor_started_ = 0;
    std::vector<stage_time> stages_;
};

/// Maximum number of pixels at one position.
inline std::size_t layer_count(const graph_view& g) {
    // Per position, how many more runs begin than end there. 16 bits, because there may be up to 1000 surfaces at one position.
    buffer<std::int16_t> begins(g.position_count() + 1);
    for_each_run(g, [&](pixel_run r) {
        const std::size_t first = g.position_of(r.first);
        ++begins[first], --begins[first + static_cast<std::size_t>(r.size())];
    });
    std::int32_t here = 0, most = 0;
    for (const std::int16_t more : begins) most = std::max(most, here += more);
    return static_cast<std::size_t>(most);
}

/// Counts the pixels outside the photo.
inline std::size_t pixels_past_frame(const photo3d& result) {
    const graph& g = result.layers.topology();
    const std::int32_t margin = result.facts.margin;
    std::size_t count = 0;
    for_each_run(g, [&](pixel_run r) {
        const std::int32_t x = g.x()[r.first], y = g.y()[r.first];
        const bool is_in_photo_row = y >= margin && y < g.height() - margin;
        const std::int32_t inside = std::min(x + r.size(), g.width() - margin) - std::max<std::int32_t>(x, margin);
        count += static_cast<std::size_t>(r.size() - (is_in_photo_row ? std::max(inside, 0) : 0));
    });
    return count;
}

/// Textures of a photo: size of the shown photo, and number and bytes of the pictures.
struct texture_figures {
    std::size_t width = 0, height = 0, count = 1, bytes = 0;
};

/// Collects the figures of the result; file sizes in bytes. `width` and `height` are the size of the layered image.
/// `texture_width` and `texture_height` are the size of the shown photo, and `textures` is the number of its texture pictures.
///
/// depth, silhouettes, inpainting  sources: paths of files, or the name of a method
/// texture, grain                  strengths on inpainted pixels
inline nlohmann::ordered_json make_report(const photo3d& result, const stage_clock& clock, const std::string& depth,
                                          const std::string& silhouettes, const std::string& inpainting, float texture,
                                          float grain, std::size_t glb_bytes, const texture_figures& shown) {
    nlohmann::ordered_json report;
    double total = 0.0;
    for (const stage_time& time : clock.stages()) {
        report["milliseconds"][time.stage] = time.elapsed;
        total += time.elapsed;
    }
    report["milliseconds"]["total"] = total;
    for (const stage_time& time : clock.stages()) report["processor_milliseconds"][time.stage] = time.processor;
    report["width"] = result.photo.width();
    report["height"] = result.photo.height();
    report["texture_width"] = shown.width;
    report["texture_height"] = shown.height;
    report["textures"] = shown.count;
    report["pixels"] = result.layers.size();
    const std::size_t past_frame = pixels_past_frame(result);
    report["hidden_pixels"] = result.layers.size() - result.photo.size() / 3 - past_frame;
    report["pixels_past_frame"] = past_frame;
    report["depth"] = depth;
    report["silhouettes"] = silhouettes;
    report["inpainting"] = inpainting;
    report["texture"] = texture;
    report["grain"] = grain;
    report["layers"] = layer_count(result.layers.topology());
    report["curves"] = result.curves.size();
    report["dropped_sides"] = result.dropped_sides;
    report["motion"] = result.facts.motion;
    report["charts"] = result.charts.charts.size();
    report["atlas_width"] = result.atlas.color.width();
    report["atlas_height"] = result.atlas.color.height();
    report["atlas_fill"] = result.atlas.fill;
    report["vertices"] = result.mesh.vertex_count();
    report["triangles"] = result.mesh.triangle_count();
    report["texture_bytes"] = shown.bytes;
    report["glb_bytes"] = glb_bytes;
    report["peak_memory_bytes"] = peak_memory();
    return report;
}

/// Writes the figures as JSON. Replaces bytes that are not UTF-8 in names of files, because JSON requires UTF-8.
inline std::string to_text(const nlohmann::ordered_json& report) {
    return report.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

/// Replaces bytes that are not UTF-8.
inline std::string as_utf8(const std::string& text) {
    return nlohmann::json::parse(nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace))
        .get<std::string>();
}

/// Writes the figures as lines of text, without the durations of the stages, which stage_clock prints during the run.
inline std::string to_table(const nlohmann::ordered_json& report) {
    std::string table;
    const auto line = [&](const std::string& name, const std::string& value) {
        table += name + std::string(name.size() < 16 ? 16 - name.size() : 1, ' ') + value + "\n";
    };
    char total[32];
    std::snprintf(total, sizeof total, "%.1f ms", report["milliseconds"]["total"].get<double>());
    line("total", total);
    const auto number = [&](const char* key) { return std::to_string(report[key].get<std::size_t>()); };
    line("photo", number("width") + " x " + number("height"));
    if (report["textures"] != 1)
        line("texture", number("texture_width") + " x " + number("texture_height") + ", on " + number("textures") + " pictures");
    line("pixels", number("pixels") + ", " + number("hidden_pixels") + " of them hidden and " + number("pixels_past_frame") +
                       " past the frame, in up to " + number("layers") + " layers");
    char fill[32];
    std::snprintf(fill, sizeof fill, "%.0f %% full", 100.0 * report["atlas_fill"].get<double>());
    line("charts", number("charts") + ", in an atlas of " + number("atlas_width") + " x " + number("atlas_height") + ", " + fill);
    line("depth from", escaped(report["depth"].get<std::string>()));
    line("silhouettes by", escaped(report["silhouettes"].get<std::string>()));
    line("inpainting by", escaped(report["inpainting"].get<std::string>()));
    line("triangles", number("triangles") + ", " + number("vertices") + " vertices");
    line("bytes", number("glb_bytes") + ", " + number("texture_bytes") + " of them texture");
    line("peak memory", std::to_string(report["peak_memory_bytes"].get<std::size_t>() / 1'000'000) + " MB");
    return table;
}

}  // namespace ldi::examples
