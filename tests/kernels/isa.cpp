#include <ldi/kernels/isa.hpp>

#include <catch2/catch.hpp>

#include <cstdlib>
#include <string>

namespace {

struct forced_isa {
    std::string before;
    bool was_set;

    explicit forced_isa(const char* name) {
        const char* const value = std::getenv("LDI_ISA");
        was_set = value != nullptr;
        if (was_set) before = value;
        setenv("LDI_ISA", name, 1);
    }
    ~forced_isa() { was_set ? setenv("LDI_ISA", before.c_str(), 1) : unsetenv("LDI_ISA"); }
};

}  // namespace

TEST_CASE("portable code is always available, and the best instruction set is") {
    CHECK(ldi::is_available(ldi::isa::scalar));
    CHECK(ldi::is_available(ldi::best_isa()));
}

TEST_CASE("LDI_ISA forces any instruction set that is available, and empty forces none") {
    for (ldi::isa set : ldi::all_isas) {
        const forced_isa forced(std::string(to_string(set)).c_str());
        if (ldi::is_available(set))
            CHECK(ldi::best_isa() == set);
        else
            CHECK_THROWS_AS(ldi::best_isa(), ldi::error);
    }
    const forced_isa none("");
    for (ldi::isa set : ldi::all_isas) CHECK((!ldi::is_available(set) || set <= ldi::best_isa()));
}

TEST_CASE("AMX is a choice on top of AVX-512 VNNI, and asking for it again gives the same answer") {
    const bool available = ldi::is_available(ldi::isa::amx_int8);
    CHECK((!available || ldi::is_available(ldi::isa::avx512vnni)));
    CHECK(ldi::is_available(ldi::isa::amx_int8) == available);
    for (ldi::isa set : ldi::all_isas) CHECK(ldi::without_tiles(set) == (set == ldi::isa::amx_int8 ? ldi::isa::avx512vnni : set));
}

TEST_CASE("LDI_ISA with an unknown name is an error that lists the names") {
    const forced_isa forced("AVX2");
    try {
        ldi::best_isa();
        FAIL("accepted");
    } catch (const ldi::error& e) {
        CHECK(e.code() == ldi::error_code::invalid_option);
        CHECK(e.details().found == "AVX2");
        CHECK(e.details().expected.find("scalar") != std::string::npos);
    }
}
