// Runs code with instructions that the processor lacks: each of them raises SIGILL, and a test's handler emulates it. Tests
// can therefore run every instruction of the compiled kernels on any machine.
#pragma once

#include <ldi/kernels/detail/target.hpp>

#if LDI_HAS_X86_KERNELS && defined(__x86_64__) && defined(__linux__)

#include <ucontext.h>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <utility>

namespace ldi::testing {

/// During its lifetime, passes illegal instructions to `emulate`, which must either emulate the instruction and advance the
/// instruction pointer, or return false for an unknown instruction. Only one object may exist at a time.
class trapped_instructions {
public:
    explicit trapped_instructions(std::function<bool(ucontext_t&)> emulate) : emulate_(std::move(emulate)) {
        current() = this;
        struct sigaction action {};
        action.sa_sigaction = handle;
        action.sa_flags = SA_SIGINFO;
        sigaction(SIGILL, &action, &before_);
    }
    ~trapped_instructions() {
        sigaction(SIGILL, &before_, nullptr);
        current() = nullptr;
    }
    trapped_instructions(const trapped_instructions&) = delete;
    trapped_instructions& operator=(const trapped_instructions&) = delete;

private:
    static trapped_instructions*& current() {
        static trapped_instructions* object = nullptr;
        return object;
    }
    static void handle(int, siginfo_t*, void* context) {
        if (!current()->emulate_(*static_cast<ucontext_t*>(context)))
            std::signal(SIGILL, SIG_DFL);  // an unknown instruction raises SIGILL again, which ends the program
    }

    std::function<bool(ucontext_t&)> emulate_;
    struct sigaction before_ {};
};

/// Reads the general-purpose register that has this number in machine code.
inline std::uint64_t read_register(const greg_t* registers, unsigned number) {
    constexpr int places[] = {REG_RAX, REG_RCX, REG_RDX, REG_RBX, REG_RSP, REG_RBP, REG_RSI, REG_RDI,
                              REG_R8,  REG_R9,  REG_R10, REG_R11, REG_R12, REG_R13, REG_R14, REG_R15};
    return static_cast<std::uint64_t>(registers[places[number]]);
}

/// The memory that an instruction reads: at `address` + `index`.
struct memory_operand {
    std::uint64_t address = 0, index = 0;
    std::size_t length = 0;  ///< bytes from ModRM to the end of the displacement
};

inline memory_operand read_operand(const std::uint8_t* modrm, const greg_t* registers, unsigned base_high, unsigned index_high) {
    memory_operand found;
    const unsigned mode = modrm[0] >> 6U;
    unsigned base = modrm[0] & 7U;
    found.length = 1;
    bool has_base = true;
    if (base == 4) {
        const unsigned sib = modrm[1], index = (sib >> 3U & 7U) + index_high;
        found.length = 2;
        if (index != 4) found.index = read_register(registers, index) << (sib >> 6U);
        base = sib & 7U;
        has_base = base != 5 || mode != 0;
    } else if (base == 5 && mode == 0) {
        return {};  // relative to the instruction pointer, which these kernels do not use
    }
    if (has_base) found.address = read_register(registers, base + base_high);
    std::int32_t displacement = 0;
    if (mode == 1) {
        displacement = static_cast<std::int8_t>(modrm[found.length]);
        found.length += 1;
    } else if (mode == 2 || !has_base) {
        std::memcpy(&displacement, modrm + found.length, sizeof displacement);
        found.length += 4;
    }
    found.address += static_cast<std::uint64_t>(std::int64_t{displacement});
    return found;
}

}  // namespace ldi::testing

#endif
