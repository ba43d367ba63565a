// A separate program, compiled with -fno-exceptions -fno-rtti. An error calls the error handler with the error's four details,
// and the handler ends the program. Exit code 0 means success. Any other code, or an abort, means failure.

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/components.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/core/window.hpp>

#include <atomic>
#include <cstdio>
#include <cstdlib>

static_assert(LDI_HAS_EXCEPTIONS == 0, "compile this file with -fno-exceptions");

namespace {
[[noreturn]] void fail(const char* what) {
    std::fprintf(stderr, "%s\n", what);
    std::exit(1);
}

void check_and_end(const ldi::error_details& details) {
    if (details.code != ldi::error_code::canceled || details.where != "coarsen")
        fail("expected code canceled at coarsen, found other details");
    if (ldi::to_string(details) != "coarsen: expected completion, found a request to stop (canceled)")
        fail("the error has the wrong message");
    std::exit(0);
}
}  // namespace

int main() {
    if (ldi::set_error_handler(check_and_end) != nullptr) fail("expected no error handler, found one before the first call");

    ldi::thread_pool pool(3);
    std::atomic<std::size_t> covered{0};
    ldi::parallel_for(pool, 1000, 1, [&](std::size_t first, std::size_t last) { covered += last - first; });
    if (covered != 1000) fail("the pool skipped an index or ran it twice");
    const ldi::graph grid = ldi::make_grid(9, 9);
    const ldi::coarsened coarse = ldi::coarsen(grid, ldi::orphan_rule::adopt_nearest);
    if (ldi::connected_components(coarse.topology).size.front() != 25) fail("the coarse graph does not have 25 pixels");

    ldi::progress_listener stop;
    stop.is_canceled = [](void*) { return true; };
    stop.report("coarsen", 1.0F);
    fail("report() returned after a cancellation");
}
