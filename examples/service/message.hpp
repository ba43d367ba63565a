// What travels through the queues: messages that name photos, and a document per photo that says what became of it.
//
// Three quorum queues, named after one: NAME holds what is to be done, NAME.results what was made, NAME.dead what can't be.
#pragma once

#include "../photo3d/batch_log.hpp"
#include "../photo3d/messages.hpp"

#include <ldi/base/error.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace ldi::examples {

/// Photos to be converted, named by their keys in the storage. `job` tells submissions of one key from each other: to send a
/// message of the same job again is to ask for the same again, which is done once.
struct photo_message {
    static constexpr std::size_t most_photos = 64;

    std::string job;
    std::vector<std::string> photos;
};

/// Refuses a key that some storage would not take, or would take for another. Raises invalid_data.
inline void check_key(const std::string& key) {
    constexpr std::size_t longest = 1000;  // S3 has 1024 bytes, and outputs are named after it
    bool is_good = !key.empty() && key.size() <= longest && key == escaped(key);
    for (std::size_t begin = 0; is_good && begin <= key.size();) {  // every name between slashes
        const std::size_t end = std::min(key.find('/', begin), key.size());
        const std::string_view name = std::string_view(key).substr(begin, end - begin);
        is_good = !name.empty() && name != "." && name != "..";
        begin = end + 1;
    }
    if (!is_good)
        raise(error_code::invalid_data, "message", "keys of at most 1000 bytes, like folder/photo.jpg", "\"" + key + "\"");
}

/// Raises invalid_data.
inline photo_message parse_message(const std::string& body) {
    const nlohmann::json value = nlohmann::json::parse(body, nullptr, false);
    const auto has = [&](const char* key, bool (nlohmann::json::*is_kind)() const noexcept) {
        return value.is_object() && value.contains(key) && (value[key].*is_kind)();
    };
    const char* const expected = R"({"job": "NAME", "photos": ["KEY", ...]} with 1 to 64 keys)";
    if (!has("job", &nlohmann::json::is_string) || !has("photos", &nlohmann::json::is_array) || value["photos"].empty() ||
        value["photos"].size() > photo_message::most_photos)
        raise(error_code::invalid_data, "message", expected, body.substr(0, 200));
    photo_message message{value["job"], {}};
    for (const nlohmann::json& key : value["photos"]) {
        if (!key.is_string()) raise(error_code::invalid_data, "message", expected, body.substr(0, 200));
        check_key(key.get_ref<const std::string&>());
        message.photos.push_back(key);
    }
    return message;
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

/// By this those who collect documents know that two are of the same photo in the same job.
inline std::string id_of(const nlohmann::ordered_json& document) {
    return document.contains("photo") ? to_line({document["job"], document["photo"]}) : to_line(document);
}

struct queue_names {
    explicit queue_names(const std::string& name) : photos(name), results(name + ".results"), dead(name + ".dead") {}

    std::string photos, results, dead;
};

}  // namespace ldi::examples
