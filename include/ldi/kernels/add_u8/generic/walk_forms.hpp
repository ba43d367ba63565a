// add_u8 with float_adder or integer_adder. Instruction sets with both forms include this file after walk.hpp.

inline void add_u8(const add_u8_data& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                   std::uint8_t* result) {
    sum.is_float ? add_with<float_adder>(sum, a, b, count, result) : add_with<integer_adder>(sum, a, b, count, result);
}
