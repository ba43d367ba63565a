#include <ldi/kernels/isa.hpp>

#include <catch2/catch.hpp>

#include <cstdlib>
#include <set>
#include <string>
#include <string_view>

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

TEST_CASE("scalar code and the best instruction set are available") {
    CHECK(ldi::is_available(ldi::isa::scalar));
    CHECK(ldi::is_available(ldi::best_isa()));
}

TEST_CASE("LDI_ISA selects any available instruction set, raises an error for others, and selects the best if empty") {
    for (const ldi::instruction_set& set : ldi::instruction_sets) {
        INFO(set.name);
        const forced_isa forced(std::string(set.name).c_str());
        if (ldi::is_available(set.id))
            CHECK(ldi::best_isa() == set.id);
        else
            CHECK_THROWS_AS(ldi::best_isa(), ldi::error);
    }
    const forced_isa none("");
    for (const ldi::instruction_set& set : ldi::instruction_sets)
        CHECK((!ldi::is_available(set.id) || set.id <= ldi::best_isa()));
}

TEST_CASE("every instruction set has a unique name, and a slower fallback that is available on the same processors") {
    std::set<std::string_view> names;
    for (const ldi::instruction_set& set : ldi::instruction_sets) {
        INFO(set.name);
        CHECK(&ldi::find_instruction_set(set.id) == &set);
        CHECK(names.insert(set.name).second);
        CHECK((set.otherwise < set.id || set.id == ldi::isa::scalar));
        if (ldi::is_available(set.id)) CHECK(ldi::is_available(set.otherwise));
    }
}

TEST_CASE("find_kernel() returns the kernel of the fallback if a family has none for an instruction set") {
    struct kernel {
        ldi::isa set;
    };
    constexpr kernel some[] = {{ldi::isa::avx2}, {ldi::isa::avx512vnni}, {ldi::isa::scalar}};
    CHECK(ldi::find_kernel(some, ldi::isa::avx512vnni).set == ldi::isa::avx512vnni);
    CHECK(ldi::find_kernel(some, ldi::isa::avx_vnni).set == ldi::isa::avx2);
    CHECK(ldi::find_kernel(some, ldi::isa::neon_dot_product).set == ldi::isa::scalar);
}

TEST_CASE("an unknown name in LDI_ISA raises an error that lists the known names") {
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
