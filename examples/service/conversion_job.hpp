// Processes a message: reads each of its photos from one storage, converts it, and writes the GLB file and a document to another
// storage. If the message is delivered again, these documents show which photos are done.
#pragma once

#include "../photo3d/arguments.hpp"
#include "../photo3d/batch_log.hpp"
#include "../photo3d/conversion.hpp"
#include "../photo3d/memory_budget.hpp"
#include "../photo3d/messages.hpp"
#include "../photo3d/report.hpp"
#include "../photo3d/system.hpp"
#include "broker.hpp"
#include "message.hpp"
#include "operations.hpp"
#include "storage.hpp"

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ldi::examples {

/// Data to publish before a message is acknowledged.
struct finished_message {
    bool is_given_back = false;  ///< publish nothing, and return the message to the queue
    std::vector<nlohmann::ordered_json> results, dead;
    std::vector<photo_message> parts;  ///< the message's photos, one new message for each
};

/// Processes one message at a time.
class conversion_job {
public:
    /// is_ending  stops the job after the current photo when it becomes true
    ///
    /// Raises invalid_option for a memory limit that is too small for every photo, and the errors of load_networks().
    conversion_job(const arguments& a, storage& photos, storage& outputs, worker_metrics& metrics,
                   const std::atomic<bool>& is_ending)
        : arguments_(a),
          photos_(photos),
          outputs_(outputs),
          metrics_(metrics),
          is_ending_(is_ending),
          networks_(load_networks(a, reading_)),
          budget_(a.memory) {
        if (networks_.depth) networks_.depth.read();  // reports invalid weights before the first message
        check_memory();
    }

    /// Converts the photos of a message and writes their outputs. Returns the documents to publish. A photo's error becomes its
    /// document.
    ///
    /// is_ours  returns false once the broker delivers the message again, which ends the work on it after the current photo
    finished_message work_on(const delivery& message, const std::function<bool()>& is_ours) {
        constexpr std::uint64_t suspicious = 2;
        finished_message done;
        photo_message names;
        try {
            names = parse_message(message.body);
        } catch (const error&) {
            done.dead.push_back(document_of_refused(message.body, describe_failure()));
            return done;
        }
        log_event(
            "info", "message",
            {{"job", names.job}, {"photos", names.photos.size()}, {"first", names.photos.front()}, {"earlier", message.earlier}});
        // one of the photos may crash workers; the others must not fail with it
        if (message.earlier >= suspicious && names.photos.size() > 1) {
            for (const std::string& photo : names.photos) done.parts.push_back({names.job, {photo}});
            return done;
        }
        const bool is_last = message.earlier + 1 >= broker_connection::delivery_limit;
        for (const std::string& photo : names.photos) {
            nlohmann::ordered_json document =
                is_ending_ || !is_ours() ? nullptr : watched_document_for(names.job, photo, is_last);
            done.is_given_back = document.is_null();
            if (done.is_given_back) break;
            (document.contains("error") ? done.dead : done.results).push_back(std::move(document));
        }
        return done;
    }

private:
    void check_memory() const {
        constexpr std::size_t small_photo = 32'000'000, step = 10'000'000;
        if (budget_.for_one() >= small_photo) return;
        const std::size_t limit = arguments_.memory != 0 ? arguments_.memory : available_memory() / 2,
                          min_limit = ((memory_in_use() + small_photo) / step + 1) * step;
        raise(error_code::invalid_option, "--memory",
              "at least " + std::to_string(min_limit / 1'000'000) + "MB, which the worker and a small photo need",
              std::to_string(limit / 1'000'000) + "MB");
    }

    /// Same as document_for(), and reports the current photo to metrics_.watch.
    nlohmann::ordered_json watched_document_for(const std::string& job, const std::string& photo, bool is_last) {
        metrics_.watch.begin(job, photo);
        nlohmann::ordered_json document = document_for(job, photo, is_last);
        if (const auto done = metrics_.watch.current()) metrics_.observe_photo(done->seconds);
        metrics_.watch.end();
        return document;
    }

    /// Returns the document of a photo, or null if another delivery may succeed.
    ///
    /// is_last  no other delivery follows, so a temporary error is final
    nlohmann::ordered_json document_for(const std::string& job, const std::string& photo, bool is_last) {
        nlohmann::ordered_json document = document_of(job, photo);
        try {
            const output_keys outputs(photo);  // checked first, because a later failure would waste the conversion
            outputs_.check(outputs.glb), outputs_.check(outputs.document);
            if (std::optional<nlohmann::ordered_json> earlier = find_record(outputs.document, document)) {
                metrics_.already_done.Increment();
                log_event("info", "already done", document);
                return *earlier;
            }
            document = convert_or_fail(document, outputs.glb);
            if (document.contains("error")) return document;  // writes no document, so that a later request tries again
            const std::string text = to_line(document);
            outputs_.put(outputs.document, std::as_bytes(std::span(text)));
            metrics_.converted.Increment();
        } catch (...) {
            const failure what = describe_failure();
            document["error"] = line_error(what);
            const bool may_pass = what.code == exit_try_again;
            log_event("warning", may_pass && !is_last ? "try again" : "given up", document);
            if (!may_pass || is_last) return document;
            metrics_.try_again.Increment();
            return nullptr;
        }
        return document;
    }

    /// Returns the document beside the GLB file, if it belongs to this job and photo. Raises file_access if something else has
    /// the document's name: a file of another program, which the document would replace, or a folder.
    std::optional<nlohmann::ordered_json> find_record(const std::string& record, const nlohmann::ordered_json& wanted) {
        std::optional<nlohmann::ordered_json> document;
        try {
            const std::optional<std::vector<std::byte>> bytes = outputs_.find(record, max_document_bytes);
            if (!bytes) return std::nullopt;
            document = parse_document(std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
        } catch (const error& failed) {
            if (failed.code() != error_code::too_large) throw;
        }
        if (!document || !document->contains("job") || !document->contains("photo"))
            raise(error_code::file_access, record, "no file, or a document of this program", "another file");
        return id_of(*document) == id_of(wanted) ? document : std::nullopt;
    }

    /// Converts a photo, and returns its document. The document contains the error if the conversion failed permanently. Raises
    /// temporary errors, after which another delivery may succeed.
    nlohmann::ordered_json convert_or_fail(nlohmann::ordered_json document, const std::string& output) {
        stage_clock storing(true), clock(true);
        try {
            document.update(convert(document["photo"], output, storing, clock));
            observe(storing, clock);
            log_event("info", "photo", document);
        } catch (...) {
            const failure what = describe_failure();
            observe(storing, clock);
            if (what.code == exit_try_again) throw;
            document["error"] = line_error(what);
            log_event("error", "photo", document);
        }
        return document;
    }

    /// Adds the times of all stages to the metrics, including the stage that failed.
    void observe(stage_clock& storing, stage_clock& clock) {
        for (stage_clock* const stages : {&storing, &clock}) {
            stages->finish();
            for (const stage_time& time : stages->stages()) metrics_.observe_stage(time.stage, time.elapsed / 1000);
        }
    }

    /// Reads a photo from one storage, converts it, and writes the GLB file to the other.
    nlohmann::ordered_json convert(const std::string& key, const std::string& output, stage_clock& storing, stage_clock& clock) {
        storing.begin("getting photo");
        const std::vector<std::byte> photo = photos_.get(key, std::min(storage::max_object_bytes, budget_.for_one()));
        storing.finish();
        const decoding_cost cost(photo, {}, arguments_, key, {});
        const std::size_t bytes = memory_for(cost, photo.size(), arguments_);
        memory_share all;
        all.grow(budget_, std::max(bytes, budget_.for_one()), key);  // reserves the memory of one photo at a time
        budget_.make_room(bytes);
        metered_memory memory(all, photo.size() + 3 * cost.width * cost.height + cost.held_by_maps);
        nlohmann::ordered_json facts;
        try {
            const std::vector<std::byte> glb = glb_of(key, photo, memory.source(), clock, facts);
            storing.begin("putting GLB");
            outputs_.put(output, glb);
            storing.finish();
            metrics_.bytes_written.Increment(static_cast<double>(glb.size()));
        } catch (const std::bad_alloc&) {
            if (memory.was_refused()) budget_.refuse(key);
            throw;
        }
        metrics_.bytes_read.Increment(static_cast<double>(photo.size()));
        nlohmann::ordered_json result{{"output", output}};
        result.update(facts);
        return result;
    }

    /// Converts a photo to a GLB file. Adds the figures of the report to `facts`.
    std::vector<std::byte> glb_of(const std::string& key, std::span<const std::byte> photo, const memory& memory,
                                  stage_clock& clock, nlohmann::ordered_json& facts) {
        thread_pool self(1);
        photo_files names;
        names.photo = key, names.are_files = false;
        clock.begin("reading photo");
        photo_with_depth input = decode_input(arguments_, names, photo, {}, networks_, self);
        const memory_scope scope(memory);
        const examples::converted_photo made = examples::convert(arguments_, input, networks_, clock, self);
        const photo_texture texture = texture_of(made, input, arguments_, self);
        encoded_photo3d encoded = encode(made, texture, arguments_, names, clock, self);
        facts["bytes"] = encoded.glb.size();
        facts.update(line_figures(report_on(made, encoded, input, arguments_, clock)));
        return std::move(encoded.glb);
    }

    const arguments& arguments_;
    storage &photos_, &outputs_;
    worker_metrics& metrics_;
    const std::atomic<bool>& is_ending_;
    stage_clock reading_{true};
    networks networks_;
    memory_budget budget_;
};

}  // namespace ldi::examples
