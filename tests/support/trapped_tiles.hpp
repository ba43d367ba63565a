// AMX for processors without it: its instructions are decoded and do their work on a tile_emulation.
#pragma once

#include <tests/support/emulated_tiles.hpp>
#include <tests/support/trapped_instructions.hpp>

#if LDI_HAS_AMX_KERNELS

#include <ucontext.h>
#include <cstddef>
#include <cstdint>

namespace ldi_test {

/// While it lives, AMX instructions of this thread run on `tiles`. One at a time.
class trapped_tiles {
public:
    tile_emulation tiles;
    std::size_t instructions = 0, products = 0;

    trapped_tiles() : trap_([this](ucontext_t& context) { return emulate(context.uc_mcontext.gregs); }) {}

private:
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

    trapped_instructions trap_;
};

}  // namespace ldi_test

#endif
