// Converts one photo to the bytes of its files. Runs over one photo and batches share this code, so both produce the same bytes.
#pragma once

#include "arguments.hpp"
#include "html_page.hpp"
#include "outputs.hpp"
#include "photo_texture.hpp"
#include "report.hpp"

#include <ldi/base/executor.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/io/photo_depth.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/networks/silhouettes.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <ldi/photo3d.hpp>

#include <cstddef>
#include <filesystem>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ldi::examples {

/// A depth network that is read when a photo first needs it: most photos have depth, and reading takes as long as a stage.
class depth_network {
public:
    /// path  empty if there is no network
    explicit depth_network(std::filesystem::path path) : path_(std::move(path)) {}

    explicit operator bool() const { return !path_.empty(); }
    /// Returns the network. The first call, on any thread, reads it and raises the errors of reading weights.
    const tiefenrausch& read() const;

private:
    std::filesystem::path path_;
    mutable std::once_flag is_read_;
    mutable std::optional<tiefenrausch> network_;
};

/// Networks, loaded once for any number of photos.
struct networks {
    depth_network depth;
    std::optional<farbrausch> inpainting;           ///< empty: diffusion
    std::optional<silhouette_network> silhouettes;  ///< empty: aligned_silhouettes
};

/// Loads all networks but the depth network. Raises the errors of reading weights.
networks load_networks(const arguments& a, stage_clock& clock);

/// Names of one photo's inputs and outputs. An empty name means that the file is not requested.
struct photo_files {
    std::filesystem::path photo, depth, glb, html, report;
    bool are_own = false;               ///< default names, not named by the user: they replace only files of this program
    bool are_files = true;              ///< false: only the photo's name is known, and no file lies beside it
    std::filesystem::path poster = {};  ///< small JPEG of the photo, for --embed and --gallery
    std::filesystem::path beside = {};  ///< depth map beside the photo, found by find_map_beside()
};

/// Finds the depth map beside the photo, unless an option names one or excludes it.
inline void find_map_beside(photo_files& names, const arguments& a) {
    if (a.uses_depth_of_photo && names.depth.empty() && names.are_files && !is_standard(names.photo))
        names.beside = depth_map_beside(names.photo);
}

/// File of the depth map, named or found beside the photo; empty if there is none.
inline const std::filesystem::path& map_file(const photo_files& names) {
    return names.depth.empty() ? names.beside : names.depth;
}

/// Content of map_file(). Both members are empty if there is no map.
struct map_content {
    std::vector<std::byte> bytes;
    std::string unreadable;  ///< reason why the map beside the photo can't be read; the photo is then converted without it
};

/// Reads map_file(). If an option names the map, raises the errors of `read`; otherwise only out_of_memory and unavailable.
template <class Read>
map_content read_map(const photo_files& names, Read&& read) {
    if (map_file(names).empty()) return {};
    try {
        return {read(map_file(names)), {}};
    } catch (const error& e) {
        const bool may_succeed_later = e.code() == error_code::unavailable || e.code() == error_code::out_of_memory;
        if (!names.depth.empty() || may_succeed_later) throw;
        return {{}, e.what()};
    }
}

/// Decodes a photo with the depth map that an option names, or otherwise with the depth beside or inside the photo, unless an
/// option excludes that depth. Raises the errors of decoding; invalid_option if there is neither depth nor a depth network.
photo_with_depth decode_input(const arguments& a, const photo_files& names, std::span<const std::byte> photo,
                              const map_content& map, const networks& loaded, thread_pool& threads);

/// A 3D photo, and the method that decided its silhouettes.
struct converted_photo : photo3d {
    bool is_decided_by_network = false;  ///< false: aligned_silhouettes
};

/// Converts a photo. Raises the errors of make_photo3d().
///
/// input  result of decode_input(). Loses its depth map, and its colors unless texture_of() draws sheets from them
converted_photo convert(const arguments& a, photo_with_depth& input, const networks& loaded, stage_clock& clock,
                        thread_pool& threads);

/// Encoded files of a 3D photo.
struct encoded_photo3d {
    texture_files textures;  ///< only if a USDZ file is requested
    std::vector<std::byte> glb;
    texture_figures shown;  ///< textures in the GLB
    glb_options facts;      ///< metadata for all files
};

/// Makes the textures of a converted photo.
///
/// a  same arguments as for convert()
photo_texture texture_of(const photo3d& made, const photo_with_depth& input, const arguments& a, thread_pool& threads);

/// Encodes the textures and the GLB file of a converted photo.
encoded_photo3d encode(const photo3d& made, const photo_texture& texture, const arguments& a, const photo_files& names,
                       stage_clock& clock, thread_pool& threads);

/// Derives default names of outputs from the photo's name. Call it if the user names no output.
///
/// viewer  the viewer's page; if it does not exist, the HTML file gets no name
void name_outputs(photo_files& names, const std::filesystem::path& viewer);

/// Checks the names of a photo's files before the conversion starts, and registers them in `files`. Raises invalid_option,
/// file_access.
void check_names(const photo_files& names, const arguments& a, output_files& files);

/// Collects the figures of a converted photo, and notes on it.
nlohmann::ordered_json report_on(const converted_photo& made, const encoded_photo3d& encoded, const photo_with_depth& input,
                                 const arguments& a, const stage_clock& clock);

inline std::string title_of(const photo_files& names) {
    return is_standard(names.photo) ? "3D photo" : names.photo.stem().string();
}

/// Makes the page that shows a photo. With --embed, the page also offers lines of HTML that show the photo in other pages.
std::string make_page(const viewer_page& viewer, const photo_files& names, const photo3d& made, const encoded_photo3d& encoded,
                      bool is_for_embedding = false);

}  // namespace ldi::examples
