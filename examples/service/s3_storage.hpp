// Storage with the protocol of S3: Amazon's, MinIO, Ceph and others. libcurl sends the requests and signs them with AWS
// Signature 4. The signature includes the SHA-256 of the body, so that the server rejects any other body.
#pragma once

#include "storage.hpp"

#include <ldi/base/error.hpp>

#include <curl/curl.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi::examples {

/// Objects of one bucket below a prefix. The environment variables that Amazon's tools use set the server and the credentials:
/// AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_SESSION_TOKEN (for temporary credentials only), AWS_REGION (default
/// us-east-1), AWS_ENDPOINT_URL (default: Amazon's server in the region).
class s3_storage : public storage {
public:
    static constexpr std::string_view scheme = "s3://";

    using duration = std::chrono::duration<double>;

    /// url        s3://BUCKET/PREFIX
    /// is_ending  nullptr, or a flag: a transfer fails if it takes longer than `grace` after the flag becomes true
    ///
    /// Raises invalid_option, invalid_data.
    explicit s3_storage(const std::string& url, const std::atomic<bool>* is_ending = nullptr,
                        duration grace = std::chrono::seconds(10))
        : curl_(curl_easy_init()), is_ending_(is_ending), grace_(grace) {
        const std::string place = url.substr(scheme.size()), bucket = place.substr(0, place.find('/'));
        if (bucket.empty()) raise(error_code::invalid_option, url, "s3://BUCKET/PREFIX", "no bucket");
        prefix_ = place.substr(std::min(bucket.size() + 1, place.size()));
        while (!prefix_.empty() && prefix_.back() == '/') prefix_.pop_back();
        if (!prefix_.empty()) check_key(prefix_), prefix_ += '/';
        region_ = variable("AWS_REGION", "us-east-1");
        user_ = variable("AWS_ACCESS_KEY_ID", nullptr), secret_ = variable("AWS_SECRET_ACCESS_KEY", nullptr);
        token_ = variable("AWS_SESSION_TOKEN", "");
        endpoint_ = variable("AWS_ENDPOINT_URL", ("https://s3." + region_ + ".amazonaws.com").c_str());
        while (!endpoint_.empty() && endpoint_.back() == '/') endpoint_.pop_back();
        endpoint_ += "/" + bucket + "/";
    }

    void check(const std::string& key) const override {
        constexpr std::size_t max_bytes = 1024;
        check_key(key);
        if (prefix_.size() + key.size() > max_bytes)
            raise(error_code::invalid_data, "message", "a key of at most 1024 bytes with its prefix", key);
    }
    std::optional<std::vector<std::byte>> find(const std::string& key, std::size_t max_bytes) override {
        return perform(key, nullptr, max_bytes);
    }
    void put(const std::string& key, std::span<const std::byte> bytes) override {
        constexpr std::size_t max_answer_bytes = 65536;
        if (!perform(key, &bytes, max_answer_bytes)) raise(error_code::unavailable, where(key), "an object", "HTTP status 404");
    }
    std::string where(const std::string& key) const override { return endpoint_ + encoded(prefix_ + key); }

private:
    using header_list = std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)>;

    struct answer {
        CURL* curl;
        std::size_t max_bytes;
        std::vector<std::byte> bytes = {};
        bool is_too_large = false, is_out_of_memory = false;
    };

    /// Time limit of a transfer that begins to count when the worker should end.
    struct end_limit {
        const std::atomic<bool>* is_ending;
        duration grace;
        std::optional<std::chrono::steady_clock::time_point> noticed = {};
    };

    /// Called by libcurl about once per second. Returns 1 to cancel the transfer.
    static int check_end(void* of, curl_off_t, curl_off_t, curl_off_t, curl_off_t) noexcept {
        end_limit& limit = *static_cast<end_limit*>(of);
        if (limit.is_ending == nullptr || !*limit.is_ending) return 0;
        const auto now = std::chrono::steady_clock::now();
        if (!limit.noticed) limit.noticed = now;
        return now - *limit.noticed > limit.grace ? 1 : 0;
    }

    static std::string variable(const char* name, const char* otherwise) {
        const char* const value = std::getenv(name);
        if (value != nullptr && *value != '\0') return value;
        if (otherwise == nullptr) raise(error_code::invalid_option, name, "an environment variable for S3", "none");
        return otherwise;
    }

    static std::size_t take(const char* data, std::size_t, std::size_t count, void* to) noexcept {
        answer& into = *static_cast<answer*>(to);
        into.is_too_large = count > into.max_bytes - into.bytes.size();
        if (into.is_too_large) return 0;  // ends the transfer
        const std::byte* const bytes = reinterpret_cast<const std::byte*>(data);
        try {
            if (into.bytes.empty()) {
                curl_off_t announced = 0;  // -1 if the server does not say it
                curl_easy_getinfo(into.curl, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &announced);
                if (announced > 0) into.bytes.reserve(std::min(static_cast<std::size_t>(announced), into.max_bytes));
            }
            into.bytes.insert(into.bytes.end(), bytes, bytes + count);
        } catch (const std::exception&) {
            into.is_out_of_memory = true;
            return 0;
        }
        return count;
    }

    /// Returns a key as part of a URL: percent-encoded except for slashes.
    std::string encoded(std::string_view key) const {
        const std::string_view name = key.substr(0, key.find('/'));
        const std::unique_ptr<char, decltype(&curl_free)> text(
            curl_easy_escape(curl_.get(), name.data(), static_cast<int>(name.size())), curl_free);
        if (text == nullptr) throw std::bad_alloc();
        return name.size() == key.size() ? text.get() : text.get() + ("/" + encoded(key.substr(name.size() + 1)));
    }

    static std::string sha256(std::span<const std::byte> bytes) {
        std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
        unsigned length = 0;
        if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &length, EVP_sha256(), nullptr) != 1) throw std::bad_alloc();
        std::string text;
        for (unsigned i = 0; i < length; ++i) {
            char code[3];
            std::snprintf(code, sizeof code, "%02x", static_cast<unsigned>(digest[i]));
            text += code;
        }
        return text;
    }

    header_list headers_for(const std::span<const std::byte>* body) const {
        header_list headers(nullptr, curl_slist_free_all);
        const auto add = [&](const std::string& line) {
            curl_slist* const all = curl_slist_append(headers.get(), line.c_str());
            if (all == nullptr) throw std::bad_alloc();
            static_cast<void>(headers.release());
            headers.reset(all);
        };
        add("x-amz-content-sha256: " + sha256(body == nullptr ? std::span<const std::byte>() : *body));
        if (!token_.empty()) add("x-amz-security-token: " + token_);
        if (body != nullptr) {
            add("Content-Type: application/octet-stream");
            add("Expect:");  // saves the round trip before the body
        }
        return headers;
    }

    /// Sends one request, and returns the body of the response, or nothing if there is no such object. Raises the errors of
    /// find() and put().
    ///
    /// body  bytes to put; nullptr to get the object
    std::optional<std::vector<std::byte>> perform(const std::string& key, const std::span<const std::byte>* body,
                                                  std::size_t max_bytes) {
        check(key);
        CURL* const curl = curl_.get();
        const std::string url = where(key), signer = "aws:amz:" + region_ + ":s3";
        answer answered{curl, max_bytes};
        curl_easy_reset(curl);  // keeps connections open
        curl_easy_setopt(curl, CURLOPT_URL, url.c_str());
        curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
        curl_easy_setopt(curl, CURLOPT_AWS_SIGV4, signer.c_str());
        curl_easy_setopt(curl, CURLOPT_USERNAME, user_.c_str());
        curl_easy_setopt(curl, CURLOPT_PASSWORD, secret_.c_str());
        curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
        curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, 10L);
        curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);  // cancels a transfer that stalls for 10 seconds
        curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, 10L);
        curl_easy_setopt(curl, CURLOPT_TIMEOUT, 900L);  // in seconds, for a server that sends a few bytes at a time
        curl_easy_setopt(curl, CURLOPT_MAXFILESIZE_LARGE, static_cast<curl_off_t>(max_bytes));  // if the server says the size
        end_limit limit{is_ending_, grace_};
        curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
        curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, &s3_storage::check_end);
        curl_easy_setopt(curl, CURLOPT_XFERINFODATA, &limit);
        curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, &s3_storage::take);
        curl_easy_setopt(curl, CURLOPT_WRITEDATA, &answered);
        const header_list headers = headers_for(body);
        curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers.get());
        if (body != nullptr) {
            curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body->size()));
            curl_easy_setopt(curl, CURLOPT_POSTFIELDS, reinterpret_cast<const char*>(body->data()));
            curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, "PUT");
        }
        const CURLcode done = curl_easy_perform(curl);
        if (done == CURLE_FILESIZE_EXCEEDED) answered.is_too_large = true;
        if (!has_object(url, done, answered)) return std::nullopt;
        return std::move(answered.bytes);
    }

    /// Returns false if there is no such object. Raises the errors of find() and put().
    bool has_object(const std::string& url, CURLcode done, const answer& answered) const {
        if (answered.is_out_of_memory) throw std::bad_alloc();
        if (done != CURLE_OK && !answered.is_too_large)
            raise(error_code::unavailable, url, "a response",
                  done == CURLE_ABORTED_BY_CALLBACK ? "none before the worker's end" : curl_easy_strerror(done));
        long status = 0;
        curl_easy_getinfo(curl_.get(), CURLINFO_RESPONSE_CODE, &status);
        if (status < 200 || status >= 300) {  // judged before the size, which is that of an error page
            const std::string_view text(reinterpret_cast<const char*>(answered.bytes.data()), answered.bytes.size());
            if (status == 404 && text.find("NoSuchKey") != std::string_view::npos) return false;  // also 404: no such bucket
            raise(error_code::unavailable, url, "an object",
                  "HTTP status " + std::to_string(status) + ": " + std::string(text.substr(0, 200)));
        }
        if (answered.is_too_large)
            raise(error_code::too_large, url, "at most " + std::to_string(answered.max_bytes) + " bytes", "more");
        return true;
    }

    struct clean_up {
        void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
    };
    std::unique_ptr<CURL, clean_up> curl_;
    const std::atomic<bool>* is_ending_;
    duration grace_;
    std::string endpoint_, prefix_, region_, user_, secret_, token_;
};

/// Opens a storage.
///
/// place      a folder, or s3://BUCKET/PREFIX
/// is_ending  nullptr, or a flag that ends transfers soon after it becomes true
inline std::unique_ptr<storage> open_storage(const std::string& place, const std::atomic<bool>* is_ending = nullptr) {
    if (place.starts_with(s3_storage::scheme)) return std::make_unique<s3_storage>(place, is_ending);
    return std::make_unique<folder_storage>(place);
}

}  // namespace ldi::examples
