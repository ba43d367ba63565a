// Where photos lie and outputs go: bytes under keys. Two kinds, a folder and what speaks S3's protocol, and a coat for either
// that tries again.
#pragma once

#include "message.hpp"

#include <ldi/base/error.hpp>
#include <ldi/formats/file.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace ldi::examples {

/// Bytes under keys. Not for several threads at once.
class storage {
public:
    static constexpr std::size_t most_bytes = std::size_t{1} << 30;  ///< of one object

    virtual ~storage() = default;

    /// Raises file_access where there is no such object, too_large, and unavailable for all that is not the object's fault: no
    /// network, no space, wrong credentials.
    virtual std::vector<std::byte> get(const std::string& key) = 0;

    /// Whoever gets it meanwhile gets the old bytes or the new ones. Raises as get() does.
    virtual void put(const std::string& key, std::span<const std::byte> bytes) = 0;
};

/// A folder, which may be of another machine.
class folder_storage : public storage {
public:
    explicit folder_storage(std::filesystem::path folder) : folder_(std::move(folder)) {}

    std::vector<std::byte> get(const std::string& key) override { return read_file(path_of(key), most_bytes); }

    void put(const std::string& key, std::span<const std::byte> bytes) override {
        const std::filesystem::path path = path_of(key);
        std::error_code failed;
        std::filesystem::create_directories(path.parent_path(), failed);
        if (failed) detail::raise_system_error(failed.value(), path.parent_path(), "a folder");
        write_file(path, bytes);
    }

private:
    std::filesystem::path path_of(const std::string& key) const {
        check_key(key);
        std::error_code ignored;
        if (!std::filesystem::is_directory(folder_, ignored))  // not mounted now
            raise(error_code::unavailable, folder_.string(), "a folder", "none");
        return folder_ / key;
    }

    std::filesystem::path folder_;
};

/// Tries again what another storage can't do now.
class patient_storage : public storage {
public:
    using duration = std::chrono::duration<double>;

    /// patience    after which it gives up, 0 to try once
    /// is_ending   ends the trying
    /// on_failure  is told of every failure
    patient_storage(std::unique_ptr<storage> tried, duration patience, const std::atomic<bool>& is_ending,
                    std::function<void(const std::string&)> on_failure)
        : tried_(std::move(tried)), patience_(patience), is_ending_(is_ending), on_failure_(std::move(on_failure)) {}

    std::vector<std::byte> get(const std::string& key) override {
        return patiently([&] { return tried_->get(key); });
    }
    void put(const std::string& key, std::span<const std::byte> bytes) override {
        patiently([&] { return tried_->put(key, bytes), 0; });
    }

    /// Whether the last try succeeded, as far as it was up to the storage. For any thread.
    bool is_there() const { return is_there_; }

private:
    template <class Function>
    std::invoke_result_t<Function> patiently(Function function) {
        const auto begun = std::chrono::steady_clock::now();
        for (duration pause(0.1);; pause = std::min(2 * pause, duration(5))) {
            try {
                std::invoke_result_t<Function> result = function();
                is_there_ = true;
                return result;
            } catch (const error& failed) {
                is_there_ = failed.code() != error_code::unavailable;
                if (is_there_) throw;
                on_failure_(failed.what());
                if (std::chrono::steady_clock::now() - begun + pause > patience_ || is_ending_) throw;
            }
            std::this_thread::sleep_for(pause);
        }
    }

    std::unique_ptr<storage> tried_;
    duration patience_;
    const std::atomic<bool>& is_ending_;
    std::function<void(const std::string&)> on_failure_;
    std::atomic<bool> is_there_{true};
};

}  // namespace ldi::examples
