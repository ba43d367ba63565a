// A file of JSON documents, one per line, for `photo3d_queue collect`. Even after a full disk or a killed process, each line of
// the file is complete and unique.
#pragma once

#include "../photo3d/line_reader.hpp"
#include "../photo3d/messages.hpp"
#include "message.hpp"

#include <ldi/base/error.hpp>
#include <ldi/io/system_error.hpp>

#include <nlohmann/json.hpp>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_set>

namespace ldi::examples {

/// A file to which documents are appended, one per line. Knows the identifiers of all documents in it.
class line_file {
public:
    /// Opens and locks the file. Raises invalid_option if it is in use. Raises invalid_data, and leaves the file as it is, if
    /// another program wrote it. Raises file_access, unavailable.
    explicit line_file(const std::filesystem::path& path)
        : path_(path), file_{::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666)} {
        if (file_.number < 0) fail();
        if (::flock(file_.number, LOCK_EX | LOCK_NB) != 0)  // two processes would remove each other's lines
            raise(error_code::invalid_option, path.string(), "a file that no other process uses", "a file in use");
        std::ifstream written(path);
        bool has_end = true;
        for (line_reader lines(written); has_end && lines.next();) {
            has_end = lines.has_end();
            const std::optional<nlohmann::ordered_json> document = parse_document(lines.text());
            if (document && is_document(*document)) {
                saved_ += static_cast<off_t>(lines.text().size()) + (has_end ? 1 : 0);
                ids_.insert(id_of(*document));
                if (!has_end) text_ = "\n";  // an editor removed the line's end
            } else if (has_end || document || !may_be_incomplete(lines.text())) {
                raise(error_code::invalid_data, path.string() + ", line " + std::to_string(lines.number()),
                      "a document that this program has written",
                      "\"" + lines.text().substr(0, 200) + "\" (to start over, name another file)");
            }
        }
        // Removes an incomplete last line, which remains if a process is killed while it writes. The message with this line was
        // not acknowledged, so the broker delivers it again.
        if (ftruncate(file_.number, saved_) != 0) fail();
    }
    line_file(const line_file&) = delete;
    line_file& operator=(const line_file&) = delete;

    /// Returns false, and does nothing, if the file has a document with the same identifier.
    bool add(const nlohmann::ordered_json& document) {
        if (!ids_.insert(id_of(document)).second) return false;
        text_ += to_line(document) + "\n";
        return true;
    }

    /// Writes all added lines to disk. Raises file_access, unavailable. After an error, the next call removes what it finds
    /// of these lines, and tries again.
    void save() {
        if (text_.empty()) return;
        if (ftruncate(file_.number, saved_) != 0) fail();  // if the last call could not remove its lines
        if (!append(text_) || fdatasync(file_.number) != 0) {
            const int why = errno;
            if (ftruncate(file_.number, saved_) != 0) fail();
            fail(why);
        }
        saved_ += static_cast<off_t>(text_.size());
        text_.clear();
    }

    const std::unordered_set<std::string>& ids() const { return ids_; }

private:
    /// Whether a line may be the beginning of a document that this program wrote.
    static bool may_be_incomplete(const std::string& line) {
        const auto begins_alike = [&](std::string_view start) {
            const std::size_t common = std::min(line.size(), start.size());
            return std::string_view(line).substr(0, common) == start.substr(0, common);
        };
        return line.size() <= max_document_bytes && (begins_alike(R"({"job":")") || begins_alike(R"({"message":")"));
    }

    bool append(std::string_view rest) {
        while (!rest.empty()) {
            const ssize_t written = ::write(file_.number, rest.data(), rest.size());
            if (written < 0 && errno != EINTR) return false;
            rest.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
        }
        return true;
    }

    [[noreturn]] void fail(int number) const { raise_system_error(number, path_, "a file to write lines to"); }
    [[noreturn]] void fail() const { fail(errno); }

    std::filesystem::path path_;
    struct descriptor {
        int number;
        ~descriptor() {
            if (number >= 0) ::close(number);
        }
    };
    descriptor file_;
    off_t saved_ = 0;  ///< bytes of the lines that are on disk
    std::unordered_set<std::string> ids_;
    std::string text_;
};

}  // namespace ldi::examples
