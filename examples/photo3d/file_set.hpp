// A set of files. Either all of them appear under their names, each complete, or none does. The files are written to a
// temporary folder beside their targets, flushed to the disk, and then renamed. Existing targets stay unchanged until all files
// are complete, and are restored if one of the files can't be put in its place.
//
// Symbolic links are followed, and permissions and owner are kept. If renaming would lose hard links, or an owner that can't be
// set on a new file, the old file is overwritten instead. Meanwhile, a folder .ldi-NUMBER.recover beside the file holds the old
// and the new content, in case of a power failure. Devices and pipes, which can't be replaced, are written directly.
//
// A killed process can't remove its temporary files. The next set that writes to the same folder removes them. A process that is
// killed during the renames, which take microseconds, leaves some files new and others old, each of them complete.
#pragma once

#include <ldi/base/error.hpp>
#include "file_system.hpp"
#include "staging_folder.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace ldi::examples {

/// A set of files that appear together. Every function may be called from any thread.
class file_set {
public:
    file_set() = default;
    file_set(const file_set&) = delete;
    file_set& operator=(const file_set&) = delete;
    ~file_set() { discard(); }

    /// Disables the search for files of killed processes, which costs time in folders with many files.
    void leave_abandoned() { removes_abandoned_ = false; }

    /// Registers an input file, which must not be written. Ignores missing files.
    void protect(const std::filesystem::path& input);

    /// Registers a file that will be written, so that problems are reported before the work starts. Raises file_access;
    /// invalid_option for an empty name, and for a file that is already protected or claimed, under any name.
    void claim(const std::filesystem::path& target);

    /// Writes a file, which appears with commit(). Raises unavailable, canceled, and, unless the file was claimed, the errors of
    /// claim().
    void write(const std::filesystem::path& target, std::span<const std::byte> bytes);

    /// Returns a name under which another program can write a file that appears with commit(). Raises the errors of write().
    std::filesystem::path reserve(const std::filesystem::path& target);

    /// Makes a folder and its parents. New folders are removed again unless the set is committed. Raises file_access,
    /// unavailable, canceled.
    void create_folder(const std::filesystem::path& folder);

    /// Puts all files in place, devices and pipes first. Raises file_access, unavailable, canceled. After an error, everything is
    /// as before, except for devices and pipes.
    void commit();

    /// Removes all files that are not in place yet. A thread that waits for signals calls this while another thread writes;
    /// later calls of the other thread raise canceled.
    void discard();

private:
    enum class way { rename, overwrite, direct };
    struct entry {
        std::filesystem::path given, place;  ///< place: `given` with symbolic links resolved
        way put = way::rename;
        std::size_t staging = 0;  ///< index of the folder that contains the file as `name`, and the old file as name + ".old"
        std::string name;
        std::vector<std::byte> bytes;  ///< for way::direct
        bool is_staged = false, is_placed = false, is_old_kept = false;
    };
    static entry inspect(const std::filesystem::path& target);
    static std::vector<std::string> identities(const std::filesystem::path& file);
    entry& add(const std::filesystem::path& target);
    entry& stage(const std::filesystem::path& target);
    std::filesystem::path temporary(const entry& e) const { return stagings_[e.staging].path / e.name; }
    std::filesystem::path old(const entry& e) const { return stagings_[e.staging].path / (e.name + ".old"); }
    void make_ready(entry& e) const;
    std::vector<entry> take_direct();
    int put_in_place(entry& e);
    void take_back(const entry& e);
    [[noreturn]] void give_up(int failure, const std::filesystem::path& at);
    void remove_temporaries();
    void refuse_if_discarded() const {
        if (is_discarded_) raise(error_code::canceled, "file_set", "completion", "a request to stop");
    }
    std::mutex mutex_;
    std::map<std::string, std::filesystem::path> taken_;  // by identities() of the files
    std::vector<entry> entries_;
    std::vector<staging_folder> stagings_;
    std::vector<std::filesystem::path> new_folders_;
    bool is_discarded_ = false, removes_abandoned_ = true;
};

/// Determines how and where a file can be written. Raises invalid_option, file_access, unavailable.
inline file_set::entry file_set::inspect(const std::filesystem::path& target) {
    if (!target.has_filename())
        raise(error_code::invalid_option, target.empty() ? "output" : target.string(), "the name of a file",
              target.empty() ? "an empty name" : "the name of a folder");
    if (target.native().find('\0') != std::filesystem::path::string_type::npos)
        raise(error_code::invalid_option, target.string(), "the name of a file", "a name with a null character");
    const auto refused = [&](const std::string& found) {
        raise(error_code::file_access, target.string(), "a writable place", found);
    };
    entry e;
    e.given = target;
    std::error_code failure;
    const std::filesystem::file_status there = std::filesystem::status(target, failure);
    if (there.type() == std::filesystem::file_type::none) raise_system_error(failure.value(), target, "a writable place");
    if (std::filesystem::is_directory(there)) raise(error_code::file_access, target.string(), "a writable place", "a folder");
    const bool exists = std::filesystem::exists(there);
    if (const int denied = exists ? check_writable(target) : 0; denied != 0)
        refused("a protected file: " + system_reason(denied));
    const bool is_device = exists && !std::filesystem::is_regular_file(there);
    e.place = is_device ? target : follow_links(target);
    if (is_device) {
        e.put = way::direct;
        return e;
    }
    const std::filesystem::path folder = e.place.parent_path();
    if (!std::filesystem::is_directory(folder, failure)) refused("no folder " + folder.string());
    if (const int denied = check_writable(folder); denied != 0)
        refused("the protected folder " + folder.string() + ": " + system_reason(denied));
    if (exists && std::filesystem::hard_link_count(e.place, failure) > 1) e.put = way::overwrite;
    return e;
}

/// Returns the identities of a file. Two names of the same file have at least one identity in common.
inline std::vector<std::string> file_set::identities(const std::filesystem::path& file) {
    std::vector<std::string> all{follow_links(file).string()};
    if (std::string identity = file_identity(file); !identity.empty()) all.push_back(std::move(identity));
    return all;
}

inline file_set::entry& file_set::add(const std::filesystem::path& target) {
    entry added = inspect(target);
    if (added.put != way::direct) {
        const std::vector<std::string> all = identities(target);
        for (const std::string& identity : all)
            if (const auto other = taken_.find(identity); other != taken_.end())
                raise(error_code::invalid_option, target.string(), "a file that the run does not use for anything else",
                      "the same file as " + other->second.string());
        for (const std::string& identity : all) taken_.emplace(identity, target);
    }
    entries_.push_back(std::move(added));
    return entries_.back();
}

inline void file_set::protect(const std::filesystem::path& input) {
    const std::lock_guard guard(mutex_);
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(input, ignored)) return;
    for (const std::string& identity : identities(input)) taken_.emplace(identity, input);
}

inline void file_set::claim(const std::filesystem::path& target) {
    const std::lock_guard guard(mutex_);
    add(target);
}

inline file_set::entry& file_set::stage(const std::filesystem::path& target) {
    refuse_if_discarded();
    std::size_t index = 0;
    while (index < entries_.size() && (entries_[index].is_staged || entries_[index].given.native() != target.native())) ++index;
    entry& e = index < entries_.size() ? entries_[index] : add(target);
    if (e.put != way::direct) {
        const std::filesystem::path folder = e.place.parent_path();
        e.staging = 0;
        while (e.staging < stagings_.size() && stagings_[e.staging].beside != folder) ++e.staging;
        if (e.staging == stagings_.size()) stagings_.push_back(make_staging_folder(folder, removes_abandoned_));
        e.name = std::to_string(index);
    }
    e.is_staged = true;
    return e;
}

inline void file_set::write(const std::filesystem::path& target, std::span<const std::byte> bytes) {
    const std::lock_guard guard(mutex_);
    entry& e = stage(target);
    if (e.put == way::direct) {
        e.bytes.assign(bytes.begin(), bytes.end());
    } else if (const int failure = ldi::write_bytes(temporary(e), bytes); failure != 0) {
        raise_system_error(failure, target, "a writable place");
    }
}

inline std::filesystem::path file_set::reserve(const std::filesystem::path& target) {
    const std::lock_guard guard(mutex_);
    entry& e = stage(target);
    if (e.put == way::direct) raise(error_code::unsupported, target.string(), "a file", "a device or a pipe");
    return temporary(e);
}

inline void file_set::create_folder(const std::filesystem::path& folder) {
    const std::lock_guard guard(mutex_);
    refuse_if_discarded();
    std::vector<std::filesystem::path> missing;
    std::error_code failure;
    for (std::filesystem::path p = folder; !p.empty() && !std::filesystem::exists(p, failure); p = p.parent_path())
        if (p.has_filename()) missing.push_back(p);
    for (; !missing.empty(); missing.pop_back()) {
        if (std::filesystem::create_directory(missing.back(), failure)) new_folders_.push_back(missing.back());
        if (failure) raise_system_error(failure.value(), folder, "a folder that can be created");
    }
    if (!std::filesystem::is_directory(folder, failure)) raise(error_code::file_access, folder.string(), "a folder", "a file");
}

/// Copies ownership and permissions of the old file to the temporary file, and flushes the temporary file to the disk.
inline void file_set::make_ready(entry& e) const {
    std::error_code ignored;
    if (e.put == way::rename && std::filesystem::exists(e.place, ignored) && copy_ownership(e.place, temporary(e)) != 0)
        e.put = way::overwrite;
    if (const int failure = synchronize(temporary(e)); failure != 0)
        raise_system_error(failure, e.given, "a file that can be flushed to the disk");
}

inline int file_set::put_in_place(entry& e) {
    std::error_code failure;
    if (e.put == way::overwrite) {
        const file_lock lock(e.place);
        std::filesystem::copy_file(e.place, old(e), failure);
        if (failure) return failure.value();
        if (const int unsafe = synchronize(old(e)); unsafe != 0) return unsafe;
        if (const int unsafe = stagings_[e.staging].keep(); unsafe != 0) return unsafe;
        e.is_old_kept = e.is_placed = true;  // true even if overwrite() fails halfway, so that take_back() restores the file
        return overwrite(e.place, temporary(e));
    }
    if (entries_.size() > 1 && std::filesystem::exists(e.place, failure)) {
        std::filesystem::create_hard_link(e.place, old(e), failure);
        if (failure) std::filesystem::copy_file(e.place, old(e), failure);  // FAT has no links
        if (failure) return failure.value();
        e.is_old_kept = true;
    }
    std::filesystem::rename(temporary(e), e.place, failure);
    e.is_placed = !failure;
    return failure.value();
}

inline void file_set::take_back(const entry& e) {
    std::error_code ignored;
    if (!e.is_placed) return;
    if (!e.is_old_kept) {
        std::filesystem::remove(e.place, ignored);
    } else if (e.put == way::rename) {
        std::filesystem::rename(old(e), e.place, ignored);
    } else if (overwrite(e.place, old(e)) != 0) {
        stagings_[e.staging].path.clear();  // keeps this folder, which has the only copy of the old content
    }
}

/// Prepares all regular files to be put in place. Removes the devices and pipes from the set, and returns those with content.
inline std::vector<file_set::entry> file_set::take_direct() {
    const std::lock_guard guard(mutex_);
    refuse_if_discarded();
    for (entry& e : entries_)
        if (e.is_staged && e.put != way::direct) make_ready(e);
    const auto first =
        std::stable_partition(entries_.begin(), entries_.end(), [](const entry& e) { return e.put != way::direct; });
    std::vector<entry> direct;
    std::copy_if(std::make_move_iterator(first), std::make_move_iterator(entries_.end()), std::back_inserter(direct),
                 [](const entry& e) { return e.is_staged; });
    entries_.erase(first, entries_.end());
    return direct;
}

/// Undoes commit(): restores all old files, removes new and temporary files, and raises the given error.
///
/// failure  the system's error number
/// at       file that could not be put in place
inline void file_set::give_up(int failure, const std::filesystem::path& at) {
    const std::filesystem::path given = at;
    for (const entry& placed : entries_) take_back(placed);
    remove_temporaries();
    raise_system_error(failure, given, "a writable place");
}

inline void file_set::commit() {
    for (const entry& e : take_direct()) {
        const int failure = ldi::write_bytes(e.place, e.bytes);  // without the mutex, because a pipe may wait for its reader
        if (failure == 0) continue;
        const std::lock_guard guard(mutex_);
        give_up(failure, e.given);
    }
    const std::lock_guard guard(mutex_);
    refuse_if_discarded();
    const std::vector<folder_lock> locks = entries_.size() > 1 ? lock_folders(stagings_) : std::vector<folder_lock>();
    // Steps that can fail for lack of space come before mere renames.
    for (const way put : {way::overwrite, way::rename})
        for (entry& e : entries_) {
            if (!e.is_staged || e.put != put) continue;
            if (const int failure = put_in_place(e); failure != 0) give_up(failure, e.given);
        }
    for (const staging_folder& staging : stagings_) synchronize(staging.beside);
    new_folders_.clear();
    remove_temporaries();
}

inline void file_set::remove_temporaries() {
    std::error_code ignored;
    for (const staging_folder& staging : stagings_) staging.remove();
    for (; !new_folders_.empty(); new_folders_.pop_back()) std::filesystem::remove(new_folders_.back(), ignored);  // if empty
    stagings_.clear();
    entries_.clear();
}

inline void file_set::discard() {
    const std::lock_guard guard(mutex_);
    is_discarded_ = true;
    remove_temporaries();
}

}  // namespace ldi::examples
