#include <examples/service/photo_watch.hpp>

#include <catch2/catch.hpp>

#include <chrono>
#include <thread>

using ldi::examples::photo_watch;

TEST_CASE("a watch measures the current photo, and excuses only the time limit") {
    photo_watch watch;
    CHECK(!watch.current());
    watch.begin("job", "a.jpg");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    watch.excuse();
    const auto photo = watch.current();
    REQUIRE(photo);
    CHECK(photo->job == "job");
    CHECK(photo->photo == "a.jpg");
    CHECK(photo->seconds >= 0.02);
    CHECK(photo->silent <= photo->seconds - 0.02);
    watch.end();
    CHECK(!watch.current());
}
