// Makes training pictures with exact depth: rooms and public squares, rendered by this project's ray caster, with photographs
// as textures.
//
//   scenes PHOTOS COUNT FOLDER
//
// PHOTOS is a folder of photographs. Writes COUNT pictures FOLDER/scene_N.jpg, their depth scene_N_depth.png (16 bits: 1 + 65534
// * depth of the nearest pixel / depth), and manifest.json, which prepare.py --depth reads.

#include <examples/scenes/scene.hpp>

#include <ldi/io/file.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/picture.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace ldi::scenes;

class stage_builder {
public:
    stage_builder(const std::vector<std::filesystem::path>& photos, std::uint32_t seed) : photos_(photos), generator_(seed) {}

    scene build() {
        const bool is_upright = chance(0.5);
        const std::int32_t width = is_upright ? 288 : 384, height = is_upright ? 384 : 288;
        s_.camera = {width, height, ldi::focal_length_from_field_of_view(static_cast<float>(between(45, 75)), width, height)};
        const double far = between(4, 14);
        floor_ = -between(0.5, 1.6);
        // Floor and back wall, sometimes side walls and a ceiling. Axes: x to the right, y up, z toward the camera.
        s_.add(make_rectangle({{0, floor_, -far / 2}, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, 40, far + 4),
               photograph(between(0.7, 3)));
        s_.add(make_rectangle(turned({0, 0, -far}, between(-0.4, 0.4)), 60, 40), photograph(far * between(0.5, 1.5)));
        for (const double side : {-1.0, 1.0})
            if (chance(0.35)) {
                const double at = side * between(1, 3);
                s_.add(make_rectangle(turned({at, 0, -far / 2}, -side * 1.5707963), far + 4, 12), photograph(between(1, 4)));
            }
        if (chance(0.25))
            s_.add(make_rectangle({{0, floor_ + between(2, 3), -far / 2}, {1, 0, 0}, {0, 0, 1}, {0, -1, 0}}, 40, far + 4),
                   photograph(between(1, 3)));
        const int things = 2 + static_cast<int>(generator_() % 8);
        for (int i = 0; i < things; ++i) add_thing(far);
        s_.light.to_sun = normalized({between(-1, 1), between(0.3, 1), between(0.1, 1)});
        const double sun = between(0.1, 0.8), sky = between(0.3, 0.8);
        s_.light.sun = {sun, sun, 0.95 * sun};
        s_.light.sky = {sky, sky, sky}, s_.light.ground = {0.6 * sky, 0.6 * sky, 0.6 * sky};
        fit_depth_range(s_);
        return std::move(s_);
    }

private:
    double between(double low, double high) { return low + (high - low) * (static_cast<double>(generator_()) * 0x1.0p-32); }
    bool chance(double share) { return between(0, 1) < share; }

    /// Returns a random photograph as a texture that is `size` scene units wide and repeats by reflection.
    texture photograph(double size) {
        const auto photo =
            std::make_shared<const ldi::image<std::uint8_t>>(ldi::load_photo(photos_[generator_() % photos_.size()]).color);
        const double rows = static_cast<double>(photo->height()), columns = static_cast<double>(photo->width());
        const double shift_u = between(0, 1), shift_v = between(0, 1), pixels = columns / size;
        return [=](const surface_point& p) {
            const auto mirrored = [](double at, double length) {
                const double turn = at / length - 2 * std::floor(at / length / 2);
                return std::clamp((turn < 1 ? turn : 2 - turn) * length - 0.5, 0.0, length - 1.001);
            };
            const double x = mirrored(p.u * pixels + shift_u * columns, columns);
            const double y = mirrored(-p.v * pixels + shift_v * rows, rows);
            const std::size_t left = static_cast<std::size_t>(x), top = static_cast<std::size_t>(y);
            const auto at = [&](std::size_t v, std::size_t u) {
                return from_srgb((*photo)(v, u, 0), (*photo)(v, u, 1), (*photo)(v, u, 2));
            };
            const double across = x - std::floor(x), down = y - std::floor(y);
            return mix(mix(at(top, left), at(top, left + 1), across), mix(at(top + 1, left), at(top + 1, left + 1), across),
                       down);
        };
    }

    /// Adds an object that stands on the floor, or a sign that hangs in the air, in front of the back wall at distance `far`.
    void add_thing(double far) {
        const double depth = 0.7 * std::exp(between(0, std::log(0.8 * far / 0.7)));
        const double x = between(-0.6, 0.6) * depth, size = between(0.08, 0.4) * depth, tall = size * between(0.5, 3);
        const texture surface = photograph(size * between(1, 4));
        switch (generator_() % 5) {
            case 0: s_.add(make_sphere(turned({x, floor_ + 0.5 * size, -depth}, between(-3, 3)), 0.5 * size), surface); break;
            case 1:
                s_.add(make_box(turned({x, floor_ + 0.5 * tall, -depth}, between(-1.5, 1.5)), size, tall, size * between(0.3, 1)),
                       surface);
                break;
            case 2:
                s_.add(make_rod({x, floor_, -depth}, {x, floor_ + 2 * tall, -depth}, size * between(0.05, 0.4)), surface);
                break;
            case 3:
                s_.add(make_rod({x, floor_, -depth}, {x + between(-1, 1) * size, floor_ + tall, -depth - between(0, 1) * size},
                                size * between(0.02, 0.1)),
                       surface);
                break;
            default:
                s_.add(make_rectangle(turned({x, between(-0.4, 0.5) * depth, -depth}, between(-0.9, 0.9), between(-0.3, 0.3)),
                                      size, tall),
                       surface);
        }
    }

    const std::vector<std::filesystem::path>& photos_;
    std::mt19937 generator_;
    scene s_;
    double floor_ = -1;
};

void write_scene(const scene& s, const std::string& name, const std::filesystem::path& folder) {
    ldi::view from;
    from.camera = s.camera;
    picture_options options;
    options.samples = 2;
    const picture made = render(s, from, options);
    const float nearest = *std::min_element(made.depth.begin(), made.depth.end());
    ldi::image<std::uint16_t> stored(made.depth.height(), made.depth.width());
    std::transform(made.depth.begin(), made.depth.end(), stored.begin(),
                   [&](float depth) { return static_cast<std::uint16_t>(1 + std::lround(65534 * nearest / depth)); });
    ldi::save_jpeg(folder / (name + ".jpg"), made.color, 92);
    ldi::save_png(folder / (name + "_depth.png"), stored);
}

void run(const std::filesystem::path& photo_folder, std::uint32_t count, const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> photos;
    for (const auto& file : std::filesystem::directory_iterator(photo_folder)) photos.push_back(file.path());
    std::sort(photos.begin(), photos.end());
    std::filesystem::create_directories(folder);
    nlohmann::ordered_json manifest = nlohmann::ordered_json::array();
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::string name = "scene_" + std::to_string(i);
        write_scene(stage_builder(photos, i).build(), name, folder);
        manifest.push_back({{"name", name},
                            {"image", name + ".jpg"},
                            {"map", name + "_depth.png"},
                            {"kind", "disparity"},
                            {"scale", 65534},
                            {"invalid", 0},
                            {"note", "ray-cast, with photographs as textures"}});
    }
    const std::string text = manifest.dump(1) + "\n";
    ldi::write_file(folder / "manifest.json", std::as_bytes(std::span(text)));
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 4) {
        std::fputs("scenes PHOTOS COUNT FOLDER\n", stderr);
        return 2;
    }
    try {
        run(arguments[1], static_cast<std::uint32_t>(std::strtoul(arguments[2], nullptr, 10)), arguments[3]);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
