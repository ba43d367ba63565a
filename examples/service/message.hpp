// Contents of the queues: messages that name photos, and one document per photo with its result.
//
// There are three quorum queues. NAME contains the messages to be processed, NAME.results the documents of converted photos, and
// NAME.dead the documents of failed photos and the messages that no worker completed.
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

/// Photos to be converted, named by their keys in the storage. `job` distinguishes submissions of the same key. A message with
/// the same job and photos may be sent again: workers convert its photos only once.
struct photo_message {
    static constexpr std::size_t max_photos = 64, max_job_bytes = 200;
    /// Maximum size of the text of a message in bytes, even if every character of every key is written as \uXXXX.
    static constexpr std::size_t max_bytes = std::size_t{1} << 19;

    std::string job;
    std::vector<std::string> photos;
};

/// Maximum size of the text of a document, in bytes.
inline constexpr std::size_t max_document_bytes = std::size_t{1} << 16;

inline constexpr std::size_t max_key_bytes = 1000;  // S3 allows 1024, including a prefix

/// Raises invalid_data for a key that some storage would not accept or would confuse with another key.
///
/// where  source of the key, for messages
inline void check_key(const std::string& key, const std::string& where = "message", std::size_t max_bytes = max_key_bytes) {
    bool is_good = !key.empty() && key.size() <= max_bytes && key == escaped(key);
    for (std::size_t begin = 0; is_good && begin <= key.size();) {  // for every name between slashes
        const std::size_t end = std::min(key.find('/', begin), key.size());
        const std::string_view name = std::string_view(key).substr(begin, end - begin);
        is_good = !name.empty() && name != "." && name != "..";
        begin = end + 1;
    }
    if (!is_good)
        raise(
            error_code::invalid_data, where,
            "keys of at most " + std::to_string(max_bytes) + " bytes of UTF-8 without control characters, like folder/photo.jpg",
            "\"" + key.substr(0, max_bytes + 1) + "\"");
}

/// Raises invalid_data for a key of a photo that check_key() refuses, or whose outputs would have too long keys.
inline void check_photo_key(const std::string& photo, const std::string& where = "message") {
    check_key(photo, where, max_key_bytes - std::string_view(".json").size());
}

/// Keys of the outputs of a photo. Raises the errors of check_photo_key().
struct output_keys {
    std::string glb, document;

    explicit output_keys(const std::string& photo) : glb(photo + ".glb"), document(photo + ".json") { check_photo_key(photo); }
};

/// Parses a message. Raises invalid_data, too_large.
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
        refuse("a job name of " + std::to_string(message.job.size()) + " bytes, outside the range 1 to " +
               std::to_string(photo_message::max_job_bytes));
    for (const nlohmann::json& key : *photos) {
        if (!key.is_string()) refuse(shown);
        check_photo_key(key.get_ref<const std::string&>());
        message.photos.push_back(key);
    }
    return message;
}

/// Parses the document of a photo, from any source; empty if it is not a document.
inline std::optional<nlohmann::ordered_json> parse_document(const std::string& text) {
    if (text.size() > max_document_bytes || is_nested_too_deep(text)) return std::nullopt;
    nlohmann::ordered_json document = nlohmann::ordered_json::parse(text, nullptr, false);
    if (!document.is_object()) return std::nullopt;
    return document;
}

/// Returns JSON on one line. Replaces bytes that are not UTF-8, which JSON does not allow.
inline std::string to_line(const nlohmann::ordered_json& value) {
    return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

inline std::string to_text(const photo_message& message) { return to_line({{"job", message.job}, {"photos", message.photos}}); }

/// Whether JSON is a document of this program that line_file can read again after it was written.
inline bool is_document(const nlohmann::ordered_json& value) {
    const bool is_of_photo = value.contains("job") && value.contains("photo");
    return (is_of_photo || value.contains("message")) && to_line(value).size() <= max_document_bytes;
}

/// Returns the first members of a photo's document.
inline nlohmann::ordered_json document_of(const std::string& job, const std::string& photo) {
    return {{"job", job}, {"photo", photo}};
}

/// Returns the document of an invalid message: the beginning of the message, and the error.
inline nlohmann::ordered_json document_of_refused(const std::string& body, const failure& why) {
    constexpr std::size_t shown = 1000;
    return {{"message", escaped(body.substr(0, shown))}, {"error", line_error(why)}};
}

/// Returns equal texts for two documents of the same photo in the same job.
inline std::string id_of(const nlohmann::ordered_json& document) {
    const bool is_of_photo = document.contains("job") && document.contains("photo");  // also false if it is not an object
    return is_of_photo ? to_line({document["job"], document["photo"]}) : to_line(document);
}

struct queue_names {
    explicit queue_names(const std::string& name) : photos(name), results(name + ".results"), dead(name + ".dead") {}

    std::string photos, results, dead;
};

}  // namespace ldi::examples
