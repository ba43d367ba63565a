// Writes videos of a 3D photo: `photo3d --video FILE`. Frames go through a pipe to ffmpeg, or to a folder as PNG files.
#pragma once

#include "key_frames.hpp"
#include "option_checks.hpp"
#include "outputs.hpp"
#include "photo_texture.hpp"
#include "pipe_to_program.hpp"

#include <ldi/io/picture.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/camera_paths.hpp>
#include <ldi/render/motion.hpp>
#include <ldi/render/rasterizer.hpp>
#include <ldi/render/stereo.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace ldi::examples {

struct video_options {
    std::filesystem::path output;     ///< .mp4, .webp, .gif; otherwise a folder. Empty: no video
    std::filesystem::path depth_map;  ///< 16-bit PNG. Empty: none
    std::string path = "swing";       ///< a name in camera_paths(), or a JSON file of key frames
    std::string stereo = "none";      ///< none, side-by-side or anaglyph
    float seconds = 6;
    int frames_per_second = 0, size = 0;  ///< 0: default of the file format

    std::string extension() const { return extension_of(output); }
    bool needs_ffmpeg() const { return extension() == ".mp4" || extension() == ".webp" || extension() == ".gif"; }
    bool is_for_chats() const { return extension() == ".webp" || extension() == ".gif"; }
    int frame_rate() const { return frames_per_second > 0 ? frames_per_second : is_for_chats() ? 20 : 30; }
    std::size_t frame_count() const {
        return static_cast<std::size_t>(std::max(1L, std::lround(seconds * static_cast<float>(frame_rate()))));
    }
    /// The file of a frame in a folder.
    std::filesystem::path frame_file(std::size_t frame) const {
        char name[32];
        std::snprintf(name, sizeof name, "frame_%05zu.png", frame + 1);
        return output / name;
    }
};

inline const std::map<std::string, camera_path>& camera_paths() {
    static const std::map<std::string, camera_path> names{{"circle", camera_path::circle},
                                                          {"swing", camera_path::swing},
                                                          {"zoom-in", camera_path::zoom_in},
                                                          {"dolly-zoom", camera_path::dolly_zoom}};
    return names;
}

inline void describe_video(CLI::App& app, video_options& v) {
    app.option_defaults()->group("Video");
    CLI::Option* video = app.add_option(
        "--video", v.output, "video to write: .mp4, .webp or .gif, which require ffmpeg; any other name: a folder of PNG frames");
    video->type_name("FILE")->check(named());
    app.add_option("--path", v.path, "camera path: swing, circle, zoom-in, dolly-zoom, or a JSON file of key frames")
        ->type_name("NAME")
        ->check(named())
        ->needs(video)
        ->capture_default_str();
    app.add_option("--seconds", v.seconds, "length of the video, in seconds")
        ->type_name("NUMBER")
        ->check(between(0.1, 600))
        ->needs(video)
        ->capture_default_str();
    app.add_option("--fps", v.frames_per_second, "frames per second; default 30, or 20 in .webp and .gif")
        ->type_name("NUMBER")
        ->check(whole_between(1, 120))
        ->needs(video);
    app.add_option("--video-size", v.size, "long side of the video in pixels; default 960, or 480 in .webp and .gif")
        ->type_name("NUMBER")
        ->check(whole_between(16, 8192))
        ->needs(video);
    app.add_option("--stereo", v.stereo, "stereo video: side-by-side, or anaglyph for red-cyan glasses")
        ->check(one_of({"none", "side-by-side", "anaglyph"}))
        ->needs(video);
}

/// Returns the command line of ffmpeg, which reads raw frames and writes a file that loops if the format supports it.
inline std::vector<std::string> ffmpeg_command(const video_options& v, std::size_t columns, std::size_t rows,
                                               int frames_per_second, const std::filesystem::path& file) {
    std::vector<std::string> command{"ffmpeg",   "-v",
                                     "error",    "-y",
                                     "-f",       "rawvideo",
                                     "-pix_fmt", "rgb24",
                                     "-s",       std::to_string(columns) + "x" + std::to_string(rows),
                                     "-r",       std::to_string(frames_per_second),
                                     "-i",       "-"};
    const auto add = [&](std::initializer_list<const char*> words) { command.insert(command.end(), words.begin(), words.end()); };
    if (v.extension() == ".mp4")
        add({"-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"});
    else if (v.extension() == ".webp")
        add({"-c:v", "libwebp_anim", "-quality", "75", "-loop", "0", "-f", "webp"});
    else
        add({"-filter_complex", "[0:v]split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse", "-loop", "0", "-f", "gif"});
    command.push_back("file:" + std::filesystem::absolute(file).string());
    return command;
}

/// Reports missing programs and invalid options before the conversion starts.
inline void check_video(const video_options& v, output_files& files) {
    if (!v.depth_map.empty()) {
        files.claim(v.depth_map);
        check_ending(v.depth_map, {".png"}, "photo3d writes a gray picture of 16 bits");
    }
    if (v.output.empty()) return;
    for (const char* other : {".mov", ".mkv", ".avi", ".webm", ".m4v", ".png", ".jpg", ".apng"})
        if (v.extension() == other)
            raise(error_code::invalid_option, v.output.string(), "a name that ends in .mp4, .webp or .gif, or that of a folder",
                  other);
    if (v.needs_ffmpeg() && !is_standard(v.output))
        files.claim(v.output);
    else
        files.claim_folder(v.output);
#if defined(_WIN32)
    if (v.needs_ffmpeg())
        raise(error_code::invalid_option, v.output.string(), "the name of a folder",
              v.extension() + " (on Windows, photo3d writes PNG frames, because it does not start ffmpeg)");
#endif
    if (v.needs_ffmpeg() && !find_program("ffmpeg"))
        raise(error_code::file_access, v.output.string(), "the program ffmpeg in PATH",
              "none (Debian: apt-get install ffmpeg; if --video names a folder, photo3d writes PNG frames without ffmpeg)");
    const std::filesystem::path next = v.frame_file(v.frame_count());
    if (!v.needs_ffmpeg() && std::filesystem::exists(next))  // the folder would contain frames of two videos
        raise(error_code::invalid_option, v.output.string(), "a folder without frames of a longer video",
              next.filename().string());
    if (camera_paths().count(v.path) == 0) load_key_frames(v.path);
}

/// Computes the views of all frames at the video's size, cropped so that no frame shows the end of the photo's surfaces. Returns
/// one view per frame, or two for a stereo video, the left eye's view first.
///
/// camera  camera that took the photo
inline std::vector<view> frame_views(const photo3d& result, const pinhole_camera& camera, const video_options& v,
                                     std::size_t frames) {
    const bool is_named = camera_paths().count(v.path) > 0;
    const depth_range& range = result.facts.range;
    // The eyes get at most half of the motion; the path gets the rest.
    const float half_eyes = v.stereo == "none" ? 0.0F : 0.5F * eye_distance(camera, range);
    const float eyes = 2.0F * within_motion({half_eyes, 0, 0}, camera, range, 0.5F * result.facts.motion)[0];
    path_options options;
    options.motion = result.facts.motion - motion_of({0.5F * eyes, 0, 0}, camera, range);
    std::vector<key_frame> keys = is_named ? std::vector<key_frame>() : load_key_frames(v.path);
    for (key_frame& key : keys) key.position = within_motion(key.position, camera, range, options.motion);
    const bool loops = v.path == "swing" || v.path == "circle";  // the first frame follows the last
    std::vector<view> views;
    for (std::size_t i = 0; i < frames; ++i) {
        const float time = static_cast<float>(i) / static_cast<float>(std::max<std::size_t>(loops ? frames : frames - 1, 1));
        view from = is_named ? view_on_path(camera_paths().at(v.path), camera, range, time, options)
                             : view_between(keys, camera, keys.front().time + time * (keys.back().time - keys.front().time));
        // a curve may leave the motion budget between its key frames
        from.position = within_motion(from.position, camera, range, options.motion);
        for (const float side : {-0.5F, 0.5F}) {
            if (v.stereo == "none" && side > 0) break;
            views.push_back(eyes > 0 ? beside(from, side * eyes, range.depth(options.focus_disparity) + from.position[2]) : from);
            views.back().position = within_motion(views.back().position, camera, range, result.facts.motion);
        }
    }
    // If hiding the end of the surfaces would crop frames to less than half, frames are not cropped, and the end becomes visible.
    const float frame = frame_within(views, camera, range, result.facts.margin > 0 ? result.facts.motion : 0.0F);
    const int size = v.size > 0 ? v.size : v.is_for_chats() ? 480 : 960;
    const float scale = std::min(1.0F, static_cast<float>(size) / static_cast<float>(std::max(camera.width, camera.height)));
    const auto even = [&](std::int32_t length) {
        return std::max(2 * static_cast<std::int32_t>(std::lround(0.5F * scale * static_cast<float>(length))), 2);
    };
    for (view& from : views) {
        from = framed(from, frame > 0.5F ? frame : 1.0F);
        from.camera.focal_length *= scale;
        for (float& shift : from.lens_shift) shift *= scale;
        from.camera.width = even(camera.width), from.camera.height = even(camera.height);
    }
    return views;
}

/// Writes the depth map and the video, if requested. Raises the errors of file_set::write() and pipe_to_program.
template <executor Executor>
void save_video(const photo3d& result, photo_texture& texture, const video_options& v, output_files& files, Executor& threads) {
    raster_options raster;
    raster.z_near = 0.01F * result.facts.range.z_near;
    if (!v.depth_map.empty()) {
        view own;
        own.camera = result.facts.camera;
        const rendering seen = rasterize(result.mesh, result.atlas.color, own, raster, threads);
        files.write(v.depth_map, encode_png(disparity_map(seen.depth, result.facts.range)));
    }
    if (v.output.empty()) return;
    const std::size_t frames = v.frame_count();
    const std::vector<view> views = frame_views(result, texture.camera(), v, frames);
    raster.samples = 2;
    const auto draw = [&](std::size_t i) { return texture.draw(views[i], raster, threads).color; };
    const auto frame = [&](std::size_t i) {
        if (views.size() == frames) return draw(i);
        return v.stereo == "anaglyph" ? anaglyph(draw(2 * i), draw(2 * i + 1)) : side_by_side(draw(2 * i), draw(2 * i + 1));
    };
    if (!v.needs_ffmpeg()) {
        files.create_folder(v.output);
        for (std::size_t i = 0; i < frames; ++i) files.write(v.frame_file(i), encode_png(frame(i)));
        return;
    }
    const image<std::uint8_t> first = frame(0);
    pipe_to_program ffmpeg(ffmpeg_command(v, first.width(), first.height(), v.frame_rate(), files.reserve(v.output)));
    ffmpeg.write(first);
    for (std::size_t i = 1; i < frames; ++i) ffmpeg.write(frame(i));
    ffmpeg.finish();
}

}  // namespace ldi::examples
