#include <examples/service/conversion_job.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

using ldi::error_code;
using ldi::examples::conversion_job;
using ldi::examples::delivery;
using ldi::examples::finished_message;
using ldi::testing::byte_string;
using ldi::testing::bytes_of;
using ldi::testing::raised;

namespace {

/// Objects in memory.
class memory_storage : public ldi::examples::storage {
public:
    std::map<std::string, byte_string> objects;
    std::optional<error_code> failure_of_put;

    void check(const std::string&) const override {}
    std::optional<byte_string> find(const std::string& key, std::size_t) override {
        const auto found = objects.find(key);
        return found == objects.end() ? std::nullopt : std::optional(found->second);
    }
    void put(const std::string& key, std::span<const std::byte> bytes) override {
        if (failure_of_put) ldi::raise(*failure_of_put, key, "no error", "one");
        objects[key].assign(bytes.begin(), bytes.end());
    }
    std::string where(const std::string& key) const override { return key; }
};

/// A job with storage in memory, for small and simple 3D photos.
struct job_in_memory {
    static constexpr std::uint64_t enough = 4'000'000'000;

    memory_storage photos, outputs;
    ldi::examples::worker_metrics metrics;
    std::atomic<bool> is_ending{false}, is_ours{true};
    ldi::examples::arguments options;
    conversion_job job;

    explicit job_in_memory(std::uint64_t memory = enough)
        : options(small(memory)), job(options, photos, outputs, metrics, is_ending) {
        photos.objects["good.jpg"] = ldi::read_file(LDI_SOURCE_DIR "/examples/photo3d/sample.jpg");
        photos.objects["broken.jpg"] = bytes_of("no photo");
    }

    finished_message work_on(const std::string& keys, std::uint64_t earlier = 0) {
        return job.work_on({1, "photos", R"({"job": "j", "photos": [)" + keys + "]}", earlier, {}},
                           [this] { return is_ours.load(); });
    }

private:
    static ldi::examples::arguments small(std::uint64_t memory) {
        ldi::examples::arguments a;
        a.memory = memory;
        a.long_side = a.geometry_side = 96;
        a.inpaint = "diffusion";
        a.depth_model = LDI_SOURCE_DIR "/examples/models/tiefenrausch_small.safetensors";
        return a;
    }
};

std::vector<std::string> codes_of(const std::vector<nlohmann::ordered_json>& documents) {
    std::vector<std::string> codes;
    for (const nlohmann::ordered_json& document : documents) codes.push_back(document["error"]["code"]);
    return codes;
}

}  // namespace

TEST_CASE("a job converts each photo of a message once, and the errors of its photos are separate") {
    job_in_memory memory;
    const finished_message first = memory.work_on(R"("missing.jpg", "good.jpg", "broken.jpg")");
    CHECK(!first.is_given_back);
    CHECK(codes_of(first.dead) == std::vector<std::string>{"file access", "unsupported"});
    REQUIRE(first.results.size() == 1);
    CHECK(first.results[0]["photo"] == "good.jpg");
    CHECK(first.results[0]["bytes"] == memory.outputs.objects["good.jpg.glb"].size());
    CHECK(memory.outputs.objects.size() == 2);
    CHECK(memory.metrics.converted.Value() == 1);
    memory.outputs.objects.erase("good.jpg.glb");
    const finished_message second = memory.work_on(R"("good.jpg")", 1);
    CHECK(second.results == first.results);
    CHECK(!memory.outputs.objects.contains("good.jpg.glb"));
    CHECK(memory.metrics.already_done.Value() == 1);
    CHECK(memory.metrics.failed.Value() == 0);  // the worker counts failures after the acknowledgment
    CHECK_THAT(memory.metrics.text(), Catch::Contains("photo3d_stage_seconds_count{stage=\"getting photo\"} 3") &&
                                          Catch::Contains("photo3d_photo_seconds_count 4") &&
                                          Catch::Contains("photo3d_current_photo_seconds 0"));
}

TEST_CASE("a temporary error returns the message, except at its last delivery") {
    job_in_memory memory;
    memory.outputs.failure_of_put = error_code::unavailable;
    CHECK(memory.work_on(R"("good.jpg")").is_given_back);
    CHECK(memory.metrics.try_again.Value() == 1);
    const finished_message last = memory.work_on(R"("good.jpg")", 4);
    CHECK(!last.is_given_back);
    CHECK(codes_of(last.dead) == std::vector<std::string>{"unavailable for now"});
    CHECK(memory.metrics.converted.Value() == 0);
}

TEST_CASE("after two failed deliveries, a message is split into messages of one photo each") {
    job_in_memory memory;
    const finished_message done = memory.work_on(R"("good.jpg", "broken.jpg")", 2);
    CHECK(done.results.empty());
    REQUIRE(done.parts.size() == 2);
    CHECK(done.parts[1].photos == std::vector<std::string>{"broken.jpg"});
    CHECK(memory.work_on(R"("broken.jpg")", 2).dead.size() == 1);
}

TEST_CASE("a job stops before its next photo when the worker ends or the message belongs to another worker") {
    job_in_memory memory;
    memory.is_ours = false;
    CHECK(memory.work_on(R"("broken.jpg")").is_given_back);
    memory.is_ours = true, memory.is_ending = true;
    CHECK(memory.work_on(R"("broken.jpg")").is_given_back);
    memory.is_ending = false;
    const auto lost_after_first = [&] { return memory.photos.objects.erase("broken.jpg") == 1; };
    const finished_message done =
        memory.job.work_on({1, "photos", R"({"job": "j", "photos": ["missing.jpg", "good.jpg"]})", 0, {}}, lost_after_first);
    CHECK(done.is_given_back);
    CHECK(done.dead.size() == 1);
    CHECK(memory.outputs.objects.empty());
}

TEST_CASE("a job refuses invalid messages, and a memory limit that is too small for every photo") {
    job_in_memory memory;
    const finished_message done = memory.work_on("3");
    CHECK(codes_of(done.dead) == std::vector<std::string>{"invalid data"});
    CHECK(!done.is_given_back);
    CHECK(raised([] { job_in_memory(1'000'000); }) == error_code::invalid_option);
}
