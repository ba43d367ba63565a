// A file of JSON documents, one per line, for `photo3d_queue collect`. It survives a full disk and a killed process: each line in
// it is whole, and none is there twice.
#pragma once

#include "../photo3d/line_reader.hpp"
#include "../photo3d/messages.hpp"
#include "message.hpp"

#include <ldi/base/error.hpp>
#include <ldi/io/system_error.hpp>

#include <nlohmann/json.hpp>

#include <fcntl.h>
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

/// A file to which documents are appended, one per line. Adds the identifiers of those that it already contains to `seen`.
class line_file {
public:
    /// Opens the file. Raises file_access, invalid_data, unavailable.
    line_file(const std::filesystem::path& path, std::unordered_set<std::string>& seen)
        : path_(path), file_(::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666)) {
        if (file_ < 0) fail();
        std::ifstream written(path);
        off_t whole = 0;
        for (line_reader lines(written); lines.next() && lines.has_end(); ++count_) {
            const std::optional<nlohmann::ordered_json> document = parse_document(lines.text());
            if (!document)
                raise(error_code::invalid_data, path.string() + ", line " + std::to_string(lines.number()),
                      "a document that this program has written",
                      "\"" + lines.text().substr(0, 200) + "\" (to start over, name another file)");
            whole += static_cast<off_t>(lines.text().size()) + 1;
            seen.insert(id_of(*document));
        }
        saved_ = whole;
        if (ftruncate(file_, saved_) != 0) fail();  // removes an incomplete last line: its message was not acknowledged
    }
    ~line_file() { ::close(file_); }
    line_file(const line_file&) = delete;
    line_file& operator=(const line_file&) = delete;

    void add(const nlohmann::ordered_json& document) { text_ += to_line(document) + "\n", ++count_; }

    /// Writes all added lines to disk. If that fails, none of them is in the file, and the next call tries again.
    void save() {
        if (text_.empty()) return;
        if (!append(text_) || fdatasync(file_) != 0) {
            const int why = errno;
            if (ftruncate(file_, saved_) != 0) fail();
            fail(why);
        }
        saved_ += static_cast<off_t>(text_.size());
        text_.clear();
    }

    std::size_t count() const { return count_; }

private:
    bool append(std::string_view rest) {
        while (!rest.empty()) {
            const ssize_t written = ::write(file_, rest.data(), rest.size());
            if (written < 0 && errno != EINTR) return false;
            rest.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
        }
        return true;
    }

    [[noreturn]] void fail(int number) const { raise_system_error(number, path_, "a file to write lines to"); }
    [[noreturn]] void fail() const { fail(errno); }

    std::filesystem::path path_;
    int file_;
    off_t saved_ = 0;  ///< bytes of the lines that are on disk
    std::size_t count_ = 0;
    std::string text_;
};

}  // namespace ldi::examples
