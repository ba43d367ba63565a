// Lets code that uses AMX run on a processor without it: each of its instructions raises SIGILL there, and the handler decodes it
// and does its work on a tile_emulation. So what compilers make of kernels/gemm_u8_amx.hpp is tested to the last instruction.
#pragma once

#include <tests/support/emulated_tiles.hpp>

#if LDI_HAS_AMX_KERNELS

#include <ucontext.h>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi_test {

/// While it lives, AMX instructions of this thread run on `tiles`. One at a time.
class trapped_tiles {
public:
    tile_emulation tiles;
    std::size_t instructions = 0, products = 0;

    trapped_tiles() {
        current() = this;
        struct sigaction action {};
        action.sa_sigaction = handle;
        action.sa_flags = SA_SIGINFO;
        sigaction(SIGILL, &action, &before_);
    }
    ~trapped_tiles() {
        sigaction(SIGILL, &before_, nullptr);
        current() = nullptr;
    }
    trapped_tiles(const trapped_tiles&) = delete;
    trapped_tiles& operator=(const trapped_tiles&) = delete;

private:
    static trapped_tiles*& current() {
        static trapped_tiles* object = nullptr;
        return object;
    }

    static void handle(int, siginfo_t*, void* context) {
        if (!current()->emulate(static_cast<ucontext_t*>(context)->uc_mcontext.gregs)) {
            std::signal(SIGILL, SIG_DFL);  // none of ours: it is raised again, and ends the program
        }
    }

    /// The general register that instructions know by this number.
    static std::uint64_t read_register(const greg_t* registers, unsigned number) {
        constexpr int places[] = {REG_RAX, REG_RCX, REG_RDX, REG_RBX, REG_RSP, REG_RBP, REG_RSI, REG_RDI,
                                  REG_R8,  REG_R9,  REG_R10, REG_R11, REG_R12, REG_R13, REG_R14, REG_R15};
        return static_cast<std::uint64_t>(registers[places[number]]);
    }

    /// Where an instruction's memory is: for tiles the address of the first row, and the index register, which holds the bytes
    /// between rows.
    struct memory_operand {
        std::uint64_t address = 0, index = 0;
        bool has_index = false;
        std::size_t length = 0;  ///< bytes of the instruction from ModRM on
    };

    static memory_operand read_operand(const std::uint8_t* modrm, const greg_t* registers, unsigned base_high,
                                       unsigned index_high) {
        memory_operand found;
        const unsigned mode = modrm[0] >> 6U;
        unsigned base = modrm[0] & 7U;
        found.length = 1;
        bool has_base = true;
        if (base == 4) {
            const unsigned sib = modrm[1], index = (sib >> 3U & 7U) + index_high;
            found.length = 2;
            found.has_index = index != 4;
            if (found.has_index) found.index = read_register(registers, index) << (sib >> 6U);
            base = sib & 7U;
            has_base = base != 5 || mode != 0;
        } else if (base == 5 && mode == 0) {
            return {};  // relative to the instruction: compilers have no use for it here
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

    bool emulate(greg_t* registers) {
        const auto* const code = reinterpret_cast<const std::uint8_t*>(registers[REG_RIP]);
        // VEX of three bytes: C4; R X B inverted and the map 0F38; W, vvvv inverted, L, the mandatory prefix.
        if (code[0] != 0xC4 || (code[1] & 0x1FU) != 2 || (code[2] & 0x84U) != 0) return false;
        enum : unsigned { none, prefix_66, prefix_f3, prefix_f2 };
        const unsigned prefix = code[2] & 3U, third = (code[2] >> 3U & 15U) ^ 15U, opcode = code[3];
        const unsigned base_high = (code[1] & 0x20U) != 0 ? 0 : 8, index_high = (code[1] & 0x40U) != 0 ? 0 : 8;
        const std::uint8_t* const modrm = code + 4;
        const unsigned mode = modrm[0] >> 6U, tile = modrm[0] >> 3U & 7U, second = modrm[0] & 7U;
        std::size_t length = 5;
        if (opcode == 0x49 && prefix == none && modrm[0] == 0xC0) {
            tiles.release_tiles();
        } else if (opcode == 0x5E && prefix == prefix_66 && mode == 3) {
            tiles.multiply_bytes(tile, second, third);
            ++products;
        } else {
            const memory_operand memory = read_operand(modrm, registers, base_high, index_high);
            if (mode == 3 || memory.length == 0) return false;
            length = 4 + memory.length;
            auto* const address = reinterpret_cast<std::uint8_t*>(memory.address);
            if (opcode == 0x49 && prefix == none && tile == 0)
                tiles.load_configuration(address + memory.index);
            else if (opcode == 0x4B && prefix == prefix_f2 && second == 4)
                tiles.load_rows(tile, address, memory.has_index ? memory.index : 0);
            else if (opcode == 0x4B && prefix == prefix_f3 && second == 4)
                tiles.store_rows(tile, address, memory.has_index ? memory.index : 0);
            else
                return false;
        }
        ++instructions;
        registers[REG_RIP] += static_cast<greg_t>(length);
        return true;
    }

    struct sigaction before_ {};
};

}  // namespace ldi_test

#endif
