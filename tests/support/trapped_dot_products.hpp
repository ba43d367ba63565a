// Emulates AVX-VNNI on processors without it: decodes the instruction vpdpbusd and executes it lane by lane.
#pragma once

#include <tests/support/trapped_instructions.hpp>

#if LDI_HAS_X86_KERNELS && defined(__x86_64__) && defined(__linux__)

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi::testing {

class trapped_dot_products {
public:
    std::size_t instructions = 0;

    trapped_dot_products() : trap_([this](ucontext_t& context) { return emulate(context.uc_mcontext); }) {}

private:
    using vector = std::array<std::uint8_t, 32>;

    /// The 256-bit registers as the kernel saves them for a signal handler: lower halves with the SSE registers, upper halves in
    /// a separate part.
    struct saved_vectors {
        static constexpr std::size_t lower = 160, present = 512, upper = 576;
        static constexpr std::uint64_t upper_is_present = 4;
        std::uint8_t* area;

        vector read(std::size_t number) const {
            vector value{};
            std::memcpy(value.data(), area + lower + 16 * number, 16);
            if ((presence() & upper_is_present) != 0) std::memcpy(value.data() + 16, area + upper + 16 * number, 16);
            return value;
        }
        void write(std::size_t number, const vector& value) const {
            if ((presence() & upper_is_present) == 0) {  // all upper halves are zero
                std::memset(area + upper, 0, 256);
                const std::uint64_t with_upper = presence() | upper_is_present;
                std::memcpy(area + present, &with_upper, sizeof with_upper);
            }
            std::memcpy(area + lower + 16 * number, value.data(), 16);
            std::memcpy(area + upper + 16 * number, value.data() + 16, 16);
        }

    private:
        std::uint64_t presence() const {
            std::uint64_t bits = 0;
            std::memcpy(&bits, area + present, sizeof bits);
            return bits;
        }
    };

    /// Adds four products of an unsigned and a signed byte to each 32-bit sum, with wraparound.
    static vector dot_products(const vector& sums, const vector& unsigned_bytes, const vector& signed_bytes) {
        vector result{};
        for (std::size_t lane = 0; lane < 32; lane += 4) {
            std::uint32_t sum = 0;
            std::memcpy(&sum, sums.data() + lane, 4);
            for (std::size_t i = lane; i < lane + 4; ++i)
                sum += static_cast<std::uint32_t>(unsigned_bytes[i] * static_cast<std::int8_t>(signed_bytes[i]));
            std::memcpy(result.data() + lane, &sum, 4);
        }
        return result;
    }

    bool emulate(mcontext_t& machine) {
        greg_t* const registers = machine.gregs;
        const auto* const code = reinterpret_cast<const std::uint8_t*>(registers[REG_RIP]);
        // Checks the three-byte VEX prefix and the opcode. Byte 0 is C4. Byte 1 has R, X and B, inverted, and the opcode map
        // 0F38. Byte 2 has W, vvvv, inverted, L = 1 for 256 bits, and the prefix 66.
        if (code[0] != 0xC4 || (code[1] & 0x1FU) != 2 || (code[2] & 0x87U) != 5 || code[3] != 0x50) return false;
        const unsigned reg_high = (code[1] & 0x80U) != 0 ? 0 : 8, index_high = (code[1] & 0x40U) != 0 ? 0 : 8;
        const unsigned base_high = (code[1] & 0x20U) != 0 ? 0 : 8;
        const std::uint8_t* const modrm = code + 4;
        const std::size_t sums = (modrm[0] >> 3U & 7U) + reg_high, inputs = (code[2] >> 3U & 15U) ^ 15U;
        const saved_vectors vectors{reinterpret_cast<std::uint8_t*>(machine.fpregs)};
        vector weights{};
        std::size_t length = 5;
        if (modrm[0] >> 6U == 3) {
            weights = vectors.read((modrm[0] & 7U) + base_high);
        } else {
            const memory_operand memory = read_operand(modrm, registers, base_high, index_high);
            if (memory.length == 0) return false;
            std::memcpy(weights.data(), reinterpret_cast<const void*>(memory.address + memory.index), sizeof weights);
            length = 4 + memory.length;
        }
        vectors.write(sums, dot_products(vectors.read(sums), vectors.read(inputs), weights));
        ++instructions;
        registers[REG_RIP] += static_cast<greg_t>(length);
        return true;
    }

    trapped_instructions trap_;
};

}  // namespace ldi::testing

#endif
