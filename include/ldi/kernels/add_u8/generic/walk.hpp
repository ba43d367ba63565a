// Loop of add_u8 over values. Each instruction set includes this file inside its namespace and target region. An Adder has these
// members:
//
//     width              bytes per step
//     add(a, b, result)  adds `width` bytes

template <class Adder>
inline void add_with(const add_u8_data& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                     std::uint8_t* result) {
    const Adder step(sum);
    std::size_t i = 0;
    for (; i + Adder::width <= count; i += Adder::width) step.add(a + i, b + i, result + i);
    if (i == count) return;
    std::uint8_t rest[3][Adder::width] = {};
    std::memcpy(rest[0], a + i, count - i);
    std::memcpy(rest[1], b + i, count - i);
    step.add(rest[0], rest[1], rest[2]);
    std::memcpy(result + i, rest[2], count - i);
}
