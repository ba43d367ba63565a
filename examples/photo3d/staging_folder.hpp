// A temporary folder, .ldi-NUMBER.tmp, for files that are not complete yet. The process that makes the folder locks it, so that
// other processes can recognize abandoned folders.
#pragma once

#include "file_system.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace ldi::examples {

struct staging_folder {
    std::filesystem::path beside, path;
    folder_lock lock;

    /// Renames the folder so that no process removes it as abandoned. Returns 0 or an error number.
    int keep() {
        std::error_code failure;
        std::filesystem::path kept = path;
        kept.replace_extension(".recover");
        if (kept == path) return 0;
        std::filesystem::rename(path, kept, failure);
        if (!failure) path = kept;
        return failure.value();
    }

    void remove() const {
        std::error_code ignored;
        // Repeats, because another program may create a file in the folder at the same time.
        for (int tries = 0; tries < 8 && std::filesystem::exists(path, ignored); ++tries)
            std::filesystem::remove_all(path, ignored);
    }
};

/// Removes the staging folders that killed processes left in `folder`.
inline void remove_abandoned(const std::filesystem::path& folder) {
    std::error_code failure;
    for (std::filesystem::directory_iterator item(folder, failure), end; !failure && item != end; item.increment(failure)) {
        const std::filesystem::path path = item->path();
        if (path.filename().string().rfind(".ldi-", 0) != 0 || path.extension() != ".tmp") continue;
        const folder_lock lock(path, false);
        std::error_code ignored;
        if (lock.is_held() && lock.is_own(path)) std::filesystem::remove_all(path, ignored);
    }
}

/// Returns .ldi-NUMBER, with a random number of 64 bits, so that no other file has the name.
inline std::string temporary_name() {
    std::random_device random;
    const std::uint64_t number = (std::uint64_t{random()} << 32) | random();
    std::string name = ".ldi-";
    for (int shift = 60; shift >= 0; shift -= 4) name += "0123456789abcdef"[(number >> shift) & 15];
    return name;
}

/// Makes a staging folder. Raises file_access, unavailable.
inline staging_folder make_staging_folder(const std::filesystem::path& beside, bool removes_abandoned) {
    if (removes_abandoned) remove_abandoned(beside);
    for (;;) {
        staging_folder made;
        made.beside = beside;
        made.path = beside / (temporary_name() + ".tmp");
        std::error_code failure;
        std::filesystem::create_directory(made.path, failure);
        if (failure) raise_system_error(failure.value(), beside, "a folder in which files can be created");
        // Only the owner may read the folder, because its files may replace private ones.
        std::filesystem::permissions(made.path, std::filesystem::perms::group_all | std::filesystem::perms::others_all,
                                     std::filesystem::perm_options::remove, failure);
        // Before this process locks the folder, another one may find it, lock it first, and remove it as abandoned.
        made.lock = folder_lock(made.path, true);
        if (std::filesystem::exists(made.path, failure) && (!made.lock.is_held() || made.lock.is_own(made.path))) return made;
    }
}

/// Excludes other processes that put several files in the same folders, so that the files of one set stay together. Locks each
/// folder once, even if it has several names. All processes lock folders in the same order, so that no deadlock occurs.
inline std::vector<folder_lock> lock_folders(const std::vector<staging_folder>& stagings) {
    std::map<std::string, std::filesystem::path> folders;
    for (const staging_folder& staging : stagings) folders.emplace(file_identity(staging.beside), staging.beside);
    std::vector<folder_lock> locks;
    for (const auto& [identity, folder] : folders) locks.emplace_back(folder, true);
    return locks;
}

}  // namespace ldi::examples
