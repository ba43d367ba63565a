// Reads the protocol buffer messages of a Caffe2 network (NetDef, OperatorDef, Argument of caffe2.proto) with protozero. Files
// are untrusted: this code checks every length and type before protozero uses it.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>

#if !LDI_HAS_EXCEPTIONS
#error "ldi reads Caffe2 files with protozero, which throws: enable exceptions for each file that includes this header"
#endif

#include <protozero/pbf_reader.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail { namespace caffe2 {

/// A named argument of an operator. The member whose type matches contains the value; the other members are empty. Strings point
/// into the file.
struct argument {
    std::string_view name;
    std::optional<float> number;
    std::optional<std::int64_t> integer;
    std::optional<std::string_view> bytes;
    buffer<std::int64_t> integers;
};

/// One operator. Its names and arguments point into the file.
struct operator_message {
    std::string_view type;
    std::vector<std::string_view> inputs, outputs;
    buffer<argument> arguments;
};

struct network_message {
    buffer<operator_message> operators;
    std::vector<std::string_view> external_inputs, external_outputs;
};

/// A field of a message. The constructor checks its bounds, and each accessor checks its type.
class field {
public:
    field(protozero::pbf_reader& reader, std::string_view where) : reader_(reader), where_(where) {
        if (reader.wire_type() != protozero::pbf_wire_type::length_delimited) return;
        // protozero keeps only 32 bits of a length, so the check must use all 64.
        const protozero::data_view rest = reader.data();
        const char* position = rest.data();
        const std::uint64_t length = protozero::decode_varint(&position, rest.data() + rest.size());
        const std::uint64_t left = static_cast<std::uint64_t>(rest.data() + rest.size() - position);
        if (length > left)
            raise(error_code::invalid_data, std::string(where), "a field of at most " + std::to_string(left) + " bytes",
                  std::to_string(length) + " bytes");
    }

    std::uint32_t number() const { return static_cast<std::uint32_t>(reader_.tag()); }
    bool is_packed() const { return reader_.wire_type() == protozero::pbf_wire_type::length_delimited; }

    std::string_view bytes() {
        expect(protozero::pbf_wire_type::length_delimited);
        const protozero::data_view view = reader_.get_view();
        return {view.data(), view.size()};
    }
    float real() {
        expect(protozero::pbf_wire_type::fixed32);
        return reader_.get_float();
    }
    std::int64_t integer() {
        expect(protozero::pbf_wire_type::varint);
        return reader_.get_int64();
    }
    void skip() { reader_.skip(); }

private:
    void expect(protozero::pbf_wire_type type) const {
        if (reader_.wire_type() == type) return;
        raise(error_code::invalid_data, std::string(where_),
              "field " + std::to_string(number()) + " of wire type " + std::to_string(static_cast<unsigned>(type)),
              "wire type " + std::to_string(static_cast<unsigned>(reader_.wire_type())));
    }

    protozero::pbf_reader& reader_;
    std::string_view where_;
};

/// Calls `visit(field&)` for every field; `visit` must read or skip the field. Malformed data raises ldi::error.
template <class Visit>
void for_each_field(std::string_view message, std::string_view where, Visit&& visit) {
    try {
        protozero::pbf_reader reader(message.data(), message.size());
        while (reader.next()) {
            field f(reader, where);
            visit(f);
        }
    } catch (const protozero::exception& e) {
        raise(error_code::invalid_data, std::string(where), "a Caffe2 network", e.what());
    }
}

/// Raises invalid_data for an empty name. A message without a name occupies two bytes in the file, but fifty times as much in
/// memory, so a small file could exhaust memory.
inline void check_named(std::string_view name, const char* what, std::string_view where) {
    if (name.empty()) raise(error_code::invalid_data, std::string(where), std::string(what) + " with a name", "no name");
}

inline argument read_argument(std::string_view message, std::string_view where) {
    argument result;
    for_each_field(message, where, [&](field& f) {
        switch (f.number()) {
            case 1: result.name = f.bytes(); break;
            case 2: result.number = f.real(); break;
            case 3: result.integer = f.integer(); break;
            case 4: result.bytes = f.bytes(); break;
            case 6:
                if (f.is_packed()) {
                    const std::string_view packed = f.bytes();
                    for (const char* p = packed.data(); p != packed.data() + packed.size();)
                        result.integers.push_back(
                            static_cast<std::int64_t>(protozero::decode_varint(&p, packed.data() + packed.size())));
                } else {
                    result.integers.push_back(f.integer());
                }
                break;
            default: f.skip();
        }
    });
    check_named(result.name, "an argument", where);
    return result;
}

inline operator_message read_operator(std::string_view message, std::string_view where) {
    operator_message result;
    for_each_field(message, where, [&](field& f) {
        switch (f.number()) {
            case 1: result.inputs.push_back(f.bytes()); break;
            case 2: result.outputs.push_back(f.bytes()); break;
            case 4: result.type = f.bytes(); break;
            case 5: result.arguments.push_back(read_argument(f.bytes(), where)); break;
            default: f.skip();
        }
    });
    check_named(result.type, "an operator", where);
    return result;
}

inline network_message read_network(std::span<const std::uint8_t> file, std::string_view where) {
    network_message result;
    const std::string_view message(reinterpret_cast<const char*>(file.data()), file.size());
    for_each_field(message, where, [&](field& f) {
        switch (f.number()) {
            case 2: result.operators.push_back(read_operator(f.bytes(), where)); break;
            case 7: result.external_inputs.push_back(f.bytes()); break;
            case 8: result.external_outputs.push_back(f.bytes()); break;
            default: f.skip();
        }
    });
    if (result.operators.empty())
        raise(error_code::invalid_data, std::string(where), "a Caffe2 network with operators",
              std::to_string(file.size()) + " bytes without operators");
    return result;
}

}}}}  // namespace ldi::detail::caffe2
