// Converts many photos in one run: `photo3d --batch`. One thread reads files. One thread per core converts photos. Other
// threads write files, so that no core waits for a disk. The networks are loaded once. If a photo fails, its line of the output
// has the error.
#pragma once

#include "arguments.hpp"
#include "batch_list.hpp"
#include "batch_log.hpp"
#include "channel.hpp"
#include "conversion.hpp"
#include "file_set.hpp"
#include "gallery.hpp"
#include "interruption.hpp"
#include "memory_budget.hpp"
#include "messages.hpp"
#include "output_names.hpp"
#include "outputs.hpp"
#include "report.hpp"
#include "spare_memory.hpp"

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/photo3d.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <thread>
#include <unordered_set>
#include <utility>
#include <vector>

namespace ldi::examples {

/// One photo in the pipeline.
struct batch_job {
    std::size_t index = 0;
    photo_files names;
    output_files files;
    std::vector<std::byte> photo;  ///< content of the photo's file
    map_content map;
    std::vector<std::pair<std::filesystem::path, std::vector<std::byte>>> made;  ///< files to write
    memory_share memory;                                                         ///< its share of the budget
    std::size_t held = 0;   ///< bytes of the share that are in use outside the stages
    bool is_large = false;  ///< has far more hidden surfaces than ordinary photographs
    nlohmann::ordered_json facts = nlohmann::ordered_json::object();
    std::optional<failure> failed;

    void forget_input() { photo = std::vector<std::byte>(), map = {}; }
    void make(const std::filesystem::path& name, std::span<const std::byte> bytes) {
        if (!name.empty()) made.emplace_back(name, std::vector<std::byte>(bytes.begin(), bytes.end()));
    }
};

class batch {
public:
    batch(const arguments& a, const networks& loaded, active_sets& sets, const interruption& signals)
        : arguments_(a),
          networks_(loaded),
          sets_(sets),
          signals_(signals),
          workers_(a.threads != 0 ? a.threads : std::max(std::thread::hardware_concurrency(), 1U)),
          log_(batch_list::count(a), a.quiet),
          ready_(workers_),
          finished_(4 * workers_) {
        std::error_code ignored;
        const bool has_own_names = a.output.empty() && a.html.empty() && a.report.empty();
        if (!a.html.empty() || (has_own_names && std::filesystem::exists(a.viewer, ignored))) viewer_.emplace(a.viewer);
        if (!a.gallery.empty()) gallery_.emplace(a.gallery, a.viewer);
        budget_.emplace(a.memory);  // counts the memory in use, so all objects that live as long as the batch must exist already
    }

    /// Converts all photos; the exit code says whether any failed.
    exit_code run();

private:
    using job_pointer = std::unique_ptr<batch_job>;

    void read(batch_list::item item);
    bool claim_outputs(const photo_files& names);
    void load(batch_job& job);
    void work();
    void work_on(job_pointer job);
    void work_on_large_ones();
    void convert(batch_job& job, const memory& memory);
    void write();
    void finish(batch_job& job, outcome what);
    void stop(const failure& why);

    const arguments& arguments_;
    const networks& networks_;
    active_sets& sets_;
    const interruption& signals_;
    std::size_t workers_, next_index_ = 0;
    batch_log log_;
    std::optional<viewer_page> viewer_;
    std::optional<gallery> gallery_;
    std::optional<memory_budget> budget_;
    output_names taken_;
    std::unordered_set<std::string> folders_;  // folders of outputs
    channel<job_pointer> ready_, finished_;
    std::mutex mutex_;  // guards the members below
    std::vector<job_pointer> large_ones_;
    bool has_failed_ = false, may_succeed_later_ = false, is_defect_ = false;
    std::optional<failure> end_;
    std::atomic<bool> is_stopped_{false};
};

inline exit_code batch::run() {
    std::vector<std::thread> workers, writers;
    std::size_t left_out = 0;
    const auto start = [](std::vector<std::thread>& threads, std::size_t count, auto body) {
        try {
            while (threads.size() < count) threads.emplace_back(body);
        } catch (const std::system_error&) {
            if (threads.empty()) throw;  // otherwise the batch continues with fewer threads
        }
    };
    const auto end = [&] {
        ready_.close();
        for (std::thread& worker : workers) worker.join();
        work_on_large_ones();
        finished_.close();
        for (std::thread& writer : writers) writer.join();
    };
    try {
        start(writers, std::max<std::size_t>(workers_, 4), [this] { write(); });  // these mostly wait for the disk
        start(workers, workers_, [this] { work(); });
        batch_list list(arguments_);
        while (!is_stopped_)
            if (std::optional<batch_list::item> item = list.next())
                read(std::move(*item));
            else
                break;
        left_out = list.left_out();
    } catch (...) {
        stop(describe_failure());
    }
    end();
    log_.finish(left_out);
    if (gallery_ && !end_) gallery_->write();
    if (end_) {
        signals_.end_if_signaled();
        say(end_->text);
        return end_->code;
    }
    return is_defect_ ? exit_defect : may_succeed_later_ ? exit_try_again : has_failed_ ? exit_never : exit_done;
}

/// Checks a photo's names, reads its files when enough memory is available, and passes the job to a converting thread.
inline void batch::read(batch_list::item item) {
    job_pointer job = std::make_unique<batch_job>();
    job->index = next_index_++;
    job->names = std::move(item.names);
    job->failed = std::move(item.failed);
    try {
        if (job->failed) return finish(*job, outcome::failed);
        complete_names(job->names, arguments_);
        if (gallery_) gallery_->complete_names(job->names);
        find_map_beside(job->names, arguments_);
        if (claim_outputs(job->names) && arguments_.skip_existing) return finish(*job, outcome::skipped);
        check_names(job->names, arguments_, job->files);
        job->files.files().leave_abandoned();
        load(*job);
        ready_.push(std::move(job));
    } catch (...) {
        job->failed = describe_failure();
        job->forget_input();
        finish(*job, outcome::failed);
    }
}

/// Claims a photo's outputs and returns whether all of them exist already. Raises an error if another photo of the batch has
/// claimed one of them.
inline bool batch::claim_outputs(const photo_files& names) {
    bool are_there = true;
    for (const std::filesystem::path& output : {names.glb, names.html, names.poster, names.report}) {
        if (output.empty()) continue;
        taken_.claim(output);
        are_there = are_there && std::filesystem::is_regular_file(output);
        if (folders_.insert(output.parent_path().string()).second)  // searches each folder once
            remove_abandoned(output.has_parent_path() ? output.parent_path() : ".");
    }
    return are_there;
}

/// Reads a photo's files, and waits until the memory for its conversion is reserved.
inline void batch::load(batch_job& job) {
    const auto reserve = [&](const std::filesystem::path& file) {
        std::error_code unknown;
        const std::filesystem::file_status status = std::filesystem::status(file, unknown);
        if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
            raise(error_code::file_access, file.string(), "a file", "a folder, a pipe or a device");
        const std::uintmax_t size = std::filesystem::file_size(file, unknown);
        // read_file() refuses larger files.
        if (!unknown && size <= max_file_bytes)
            job.memory.grow(*budget_, job.memory.bytes() + static_cast<std::size_t>(size), file.string());
    };
    const std::string name = job.names.photo.string();
    reserve(job.names.photo);
    job.photo = read_file(job.names.photo);
    if (!map_file(job.names).empty()) reserve(map_file(job.names));
    job.map = read_map(job.names, [](const std::filesystem::path& file) { return read_file(file); });
    const auto cost_with = [&](std::span<const std::byte> map) {
        return decoding_cost(job.photo, map, arguments_, name, map_file(job.names).string());
    };
    const decoding_cost cost = [&] {
        try {
            return cost_with(job.map.bytes);
        } catch (const error&) {
            if (!job.names.depth.empty()) throw;
            return cost_with({});  // if the map beside the photo is invalid, the photo is converted without it
        }
    }();
    const std::size_t files = job.photo.size() + job.map.bytes.size();
    job.held = files + 3 * cost.width * cost.height + cost.held_by_maps;
    const std::size_t alone = memory_for(cost, files, arguments_), largest = budget_->for_one();
    // The memory blocks of photos that are converted at the same time have gaps between them (measured: up to 7 %).
    job.memory.grow(*budget_, std::max(alone, std::min(alone + alone / 8, largest)), name);
    if (job.is_large) job.memory.grow(*budget_, largest, name);
}

inline void batch::work() {
    while (std::optional<job_pointer> job = ready_.pop()) work_on(std::move(*job));
}

inline void batch::work_on(job_pointer job) try {
    spare_memory::reserve();
    if (!is_stopped_) {
        metered_memory memory(job->memory, job->held);
        try {
            budget_->make_room(job->memory.bytes());
            convert(*job, memory.source());
        } catch (...) {
            job->made.clear();
            if (memory.was_refused() && !job->is_large) {  // tries again later, alone
                job->is_large = true;
                job->forget_input();
                job->memory.shrink(0);
                const std::lock_guard lock(mutex_);
                return large_ones_.push_back(std::move(job));
            }
            job->failed = describe_failure();
            if (memory.was_refused()) job->failed = failure_of([&] { budget_->refuse(job->names.photo.string()); });
        }
    }
    job->forget_input();
    std::size_t rest = 0;
    for (const auto& [name, bytes] : job->made) rest += bytes.size();
    job->memory.shrink(rest);
    finished_.push(std::move(job));
} catch (...) {
    stop(describe_failure());
}

/// Converts large photos one after the other, each with the whole budget.
inline void batch::work_on_large_ones() {
    for (job_pointer& job : large_ones_) {
        try {
            load(*job);
        } catch (...) {
            job->failed = describe_failure();
            job->forget_input();
            finish(*job, outcome::failed);
            continue;
        }
        work_on(std::move(job));
    }
}

inline void batch::convert(batch_job& job, const memory& memory) {
    stage_clock clock(true);
    thread_pool self(1);
    const photo_files& names = job.names;
    clock.begin("reading photo");
    photo_with_depth input = decode_input(arguments_, names, job.photo, job.map, networks_, self);
    const memory_scope scope(memory);
    const converted_photo made = examples::convert(arguments_, input, networks_, clock, self);
    const photo_texture texture = texture_of(made, input, arguments_, self);
    const encoded_photo3d encoded = encode(made, texture, arguments_, names, clock, self);
    const nlohmann::ordered_json report = report_on(made, encoded, input, arguments_, clock);

    job.make(names.glb, encoded.glb);
    const auto bytes = [](const std::string& text) { return std::as_bytes(std::span(text)); };
    if (!names.html.empty()) job.make(names.html, bytes(make_page(*viewer_, names, made, encoded)));
    if (!names.poster.empty()) job.make(names.poster, encode_poster(made.photo));
    job.make(names.report, bytes(to_text(report)));
    job.facts = line_figures(report);
}

inline void batch::write() {
    while (std::optional<job_pointer> job = finished_.pop()) {
        batch_job& one = **job;
        if (!one.failed && !is_stopped_) {
            sets_.add(one.files.files());
            try {
                for (const auto& [name, bytes] : one.made) one.files.write(name, bytes);
                one.files.commit();
            } catch (...) {
                one.failed = describe_failure();
            }
            sets_.remove(one.files.files());
        }
        if (!is_stopped_) finish(one, one.failed ? outcome::failed : outcome::converted);
    }
}

/// Reports the result of a photo.
inline void batch::finish(batch_job& job, outcome what) {
    if (job.failed) signals_.end_if_signaled();
    if (gallery_) gallery_->add(job.index, job.names, job.failed ? job.failed->text : "");
    nlohmann::ordered_json line{{"index", job.index}, {"photo", job.names.photo.string()}};
    if (job.failed) {
        const bool may_pass = job.failed->code == exit_try_again;
        line["error"] = line_error(*job.failed);
        const std::lock_guard lock(mutex_);
        has_failed_ = true;
        may_succeed_later_ = may_succeed_later_ || may_pass;
        is_defect_ = is_defect_ || job.failed->code == exit_defect;
    } else {
        for (const std::filesystem::path& output : {job.names.glb, job.names.html, job.names.poster, job.names.report})
            if (!output.empty()) line["outputs"].push_back(output.string());
        if (what == outcome::skipped) line["skipped"] = true;
        line.update(job.facts);
    }
    try {
        log_.say_line(what, line);
    } catch (...) {
        stop(describe_failure());
    }
}

/// Ends the batch; later results are not reported.
inline void batch::stop(const failure& why) {
    const std::lock_guard lock(mutex_);
    if (!end_) end_ = why;
    is_stopped_ = true;
}

/// data  folder of the program's data
inline exit_code run_batch(arguments& a, const std::filesystem::path& data) {
    active_sets sets;
    const interruption signals([&sets] { sets.discard(); });
    try {
        check_batch_options(a);
        find_weights(a, data);
        stage_clock clock(true);
        const networks loaded = load_networks(a, clock);
        if (loaded.depth) loaded.depth.read();  // reports invalid weights before the first photo
        return batch(a, loaded, sets, signals).run();
    } catch (...) {
        signals.end_if_signaled();
        return say_failure();
    }
}

}  // namespace ldi::examples
