// A graph that a test modifies between uses.
#pragma once

#include <ldi/core/graph_builder.hpp>

namespace ldi::testing {

struct sketched_graph : graph_builder {
    using graph_builder::graph_builder;

    operator graph_view() const { return graph_view(width(), height(), x(), y(), up(), down(), left(), right()); }
    explicit operator graph() const { return graph_builder(*this).build(); }
};

}  // namespace ldi::testing
