#include <ldi/base/progress.hpp>

#include <catch2/catch.hpp>

#include <string>
#include <string_view>
#include <thread>

using namespace ldi;

TEST_CASE("a listener without functions accepts every report and does not cancel") {
    CHECK_NOTHROW(progress_listener{}.report("expand", 0.5F));
}

TEST_CASE("a listener is called on the reporting thread, with stage and fraction") {
    struct heard {
        std::string stage;
        float fraction = -1;
        std::thread::id thread;
    } last;
    const progress_listener watching{&last,
                                     [](void* user, std::string_view stage, float fraction) {
                                         *static_cast<heard*>(user) = {std::string(stage), fraction, std::this_thread::get_id()};
                                     },
                                     nullptr};
    watching.report("expand", 0.25F);
    CHECK(last.stage == "expand");
    CHECK(last.fraction == 0.25F);
    CHECK(last.thread == std::this_thread::get_id());
}

TEST_CASE("cancellation stops the work with an error of code `canceled` that names the stage") {
    int asked = 0;
    const progress_listener impatient{&asked, nullptr, [](void* user) { return ++*static_cast<int*>(user) == 3; }};
    int done = 0;
    const auto work = [&] {
        for (; done < 10; ++done) impatient.report("inpaint", static_cast<float>(done) / 10.0F);
    };
    try {
        work();
        FAIL("was not canceled");
    } catch (const ldi::error& e) {
        CHECK(e.code() == error_code::canceled);
        CHECK(e.details().where == "inpaint");
    }
    CHECK(done == 2);
}
