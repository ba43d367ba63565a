// What travels through the queues: messages that name photos, and a document per photo that says what became of it.
//
// Three quorum queues, named after one: NAME holds what is to be done, NAME.results what was made, NAME.dead what can't be.
#pragma once

#include "../photo3d/batch_log.hpp"
#include "../photo3d/json_input.hpp"
#include "../photo3d/messages.hpp"

#include <ldi/base/error.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ldi::examples {

/// Photos to be converted, named by their keys in the storage. `job` tells submissions of one key from each other: to send a
/// message of the same job again is to ask for the same again, which is done once.
struct photo_message {
    static constexpr std::size_t max_photos = 64, max_job_bytes = 200;
    static constexpr std::size_t max_bytes = std::size_t{1} << 19;  ///< of its text, with every letter of a key as \uXXXX

    std::string job;
    std::vector<std::string> photos;
};

/// Bytes of a document's text.
inline constexpr std::size_t max_document_bytes = std::size_t{1} << 16;

/// Refuses a key that some storage would not take, or would take for another. Raises invalid_data.
inline void check_key(const std::string& key) {
    constexpr std::size_t max_bytes = 1000;  // S3 has 1024, of which a prefix takes some
    bool is_good = !key.empty() && key.size() <= max_bytes && key == escaped(key);
    for (std::size_t begin = 0; is_good && begin <= key.size();) {  // every name between slashes
        const std::size_t end = std::min(key.find('/', begin), key.size());
        const std::string_view name = std::string_view(key).substr(begin, end - begin);
        is_good = !name.empty() && name != "." && name != "..";
        begin = end + 1;
    }
    if (!is_good)
        raise(error_code::invalid_data, "message", "keys of at most 1000 bytes, like folder/photo.jpg",
              "\"" + key.substr(0, max_bytes + 1) + "\"");
}

/// Names of what a photo becomes. Raises invalid_data where one is no key, though the photo's is.
struct output_keys {
    std::string glb, document;

    explicit output_keys(const std::string& photo) : glb(photo + ".glb"), document(photo + ".json") {
        check_key(glb), check_key(document);
    }
};

/// Raises invalid_data, too_large.
inline photo_message parse_message(const std::string& body) {
    const std::string shown = body.substr(0, 200);
    if (body.size() > photo_message::max_bytes)
        raise(error_code::too_large, "message", "at most " + std::to_string(photo_message::max_bytes) + " bytes",
              "more: " + shown);
    const nlohmann::json value = parse_json(body, "message");
    const auto refuse = [&](const std::string& found) {
        raise(error_code::invalid_data, "message", R"({"job": "NAME", "photos": ["KEY", ...]} with 1 to 64 keys)", found);
    };
    if (!value.is_object()) refuse(shown);
    const auto job = value.find("job"), photos = value.find("photos");
    if (job == value.end() || !job->is_string() || photos == value.end() || !photos->is_array() || photos->empty() ||
        photos->size() > photo_message::max_photos)
        refuse(shown);
    photo_message message{*job, {}};
    if (message.job.empty() || message.job.size() > photo_message::max_job_bytes)
        refuse("the name of a job of " + std::to_string(message.job.size()) + " bytes instead of 1 to " +
               std::to_string(photo_message::max_job_bytes));
    for (const nlohmann::json& key : *photos) {
        if (!key.is_string()) refuse(shown);
        check_key(key.get_ref<const std::string&>());
        message.photos.push_back(key);
    }
    return message;
}

/// A photo's document, from anybody; nothing where it is none.
inline std::optional<nlohmann::ordered_json> parse_document(const std::string& text) {
    if (text.size() > max_document_bytes || is_nested_too_deep(text)) return std::nullopt;
    nlohmann::ordered_json document = nlohmann::ordered_json::parse(text, nullptr, false);
    if (!document.is_object()) return std::nullopt;
    return document;
}

/// Text without what is no UTF-8, of which JSON has none.
inline std::string to_line(const nlohmann::ordered_json& value) {
    return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

inline std::string to_text(const photo_message& message) { return to_line({{"job", message.job}, {"photos", message.photos}}); }

/// The beginning of a photo's document.
inline nlohmann::ordered_json document_of(const std::string& job, const std::string& photo) {
    return {{"job", job}, {"photo", photo}};
}

/// The document of a message that names no photos: its beginning, and why.
inline nlohmann::ordered_json document_of_refused(const std::string& body, const failure& why) {
    constexpr std::size_t shown = 1000;
    return {{"message", escaped(body.substr(0, shown))}, {"error", line_error(why)}};
}

/// By this those who collect documents know that two are of the same photo in the same job.
inline std::string id_of(const nlohmann::ordered_json& document) {
    const bool is_of_photo = document.contains("job") && document.contains("photo");  // also false where it is no object
    return is_of_photo ? to_line({document["job"], document["photo"]}) : to_line(document);
}

struct queue_names {
    explicit queue_names(const std::string& name) : photos(name), results(name + ".results"), dead(name + ".dead") {}

    std::string photos, results, dead;
};

}  // namespace ldi::examples
