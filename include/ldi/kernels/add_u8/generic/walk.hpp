// Loop of add_u8 over a row. Each instruction set includes this file inside its namespace and target region, after its `adder`
// with these members:
//
//     width              bytes per step
//     add(a, b, result)  adds `width` bytes

inline void add_u8(const add_u8_constants& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                   std::uint8_t* result) {
    const adder step(sum);
    std::size_t i = 0;
    for (; i + adder::width <= count; i += adder::width) step.add(a + i, b + i, result + i);
    if (i == count) return;
    std::uint8_t rest[3][adder::width] = {};
    std::memcpy(rest[0], a + i, count - i);
    std::memcpy(rest[1], b + i, count - i);
    step.add(rest[0], rest[1], rest[2]);
    std::memcpy(result + i, rest[2], count - i);
}
