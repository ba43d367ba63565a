// Chains of vertices that wait for their triangles while the sweep (triangulate.hpp) moves down (de Berg et al., Computational
// Geometry, chapter 3). Each monotone part of a polygon has one chain. When a vertex is added at either end of a chain, all
// triangles that the new vertex can form with the chain are cut off.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/mesh/polygon.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A chain of waiting vertices from left to right. The interior lies below the chain. Every inner vertex is straight or reflex,
/// because convex vertices are cut off. head and tail are nodes of `waiting_chains`, or -1 if there is no chain.
struct waiting_chain {
    std::int32_t head = -1, tail = -1;
    std::int32_t lowest = -1;  ///< the last node added: the next vertex below the chain is visible from it
};

/// Stores the vertices and links of all chains. Adds the triangles that are cut off from chains to the caller's triangulation.
/// Keep an object to reuse its memory.
class waiting_chains {
public:
    void clear() { nodes_.clear(), open_sides_.clear(); }

    /// Starts a chain with one vertex.
    waiting_chain begin(std::int32_t vertex, lattice_point at) {
        const std::int32_t only = add_node(vertex, at);
        return {only, only, only};
    }

    /// Adds a link: a placeholder for an inner edge until both of its triangles are known. The polygon's own edges have link
    /// -1.
    std::int32_t add_link() { return add_link(-1); }

    /// Adds a vertex at the right end, connected by the edge `link`, and cuts off all vertices that become convex.
    void append(waiting_chain& chain, std::int32_t vertex, lattice_point at, std::int32_t link, triangulation& result) {
        const std::int32_t p = add_node(vertex, at);
        std::int32_t a = chain.tail;
        while (a != chain.head) {
            const std::int32_t b = nodes_[a].previous;
            if (turn(nodes_[b].at, nodes_[a].at, at) <= 0) break;
            const std::int32_t half_edge = cut_off(b, p, a, result);
            attach(link, half_edge + 1, result);
            attach(nodes_[b].link, half_edge + 2, result);
            link = add_link(half_edge);
            a = b;
        }
        join(a, p, link);
        chain.tail = chain.lowest = p;
    }

    /// Same as append(), but adds the vertex at the left end.
    void prepend(waiting_chain& chain, std::int32_t vertex, lattice_point at, std::int32_t link, triangulation& result) {
        const std::int32_t p = add_node(vertex, at);
        std::int32_t a = chain.head;
        while (a != chain.tail) {
            const std::int32_t b = nodes_[a].next;
            if (turn(at, nodes_[a].at, nodes_[b].at) <= 0) break;
            const std::int32_t half_edge = cut_off(p, b, a, result);
            attach(nodes_[a].link, half_edge + 1, result);
            attach(link, half_edge + 2, result);
            link = add_link(half_edge);
            a = b;
        }
        join(p, a, link);
        chain.head = chain.lowest = p;
    }

    /// Divides a chain at its lowest vertex. This vertex becomes the end of `chain`, and a copy becomes the start of the
    /// returned chain.
    waiting_chain divide(waiting_chain& chain) {
        const std::int32_t last = chain.lowest, end = chain.tail;
        const std::int32_t copy = add_node(nodes_[last].vertex, nodes_[last].at);
        if (last != end) join(copy, nodes_[last].next, nodes_[last].link);
        chain.tail = last;
        return {copy, last == end ? copy : end, copy};
    }

    /// Joins two chains; the last vertex of `left` equals the first vertex of `right`.
    void unite(waiting_chain& left, const waiting_chain& right) {
        join(left.tail, nodes_[right.head].next, nodes_[right.head].link);
        left.tail = right.tail;
    }

    /// Whether only the first and the last vertex of a chain remain.
    bool is_edge(const waiting_chain& chain) const { return nodes_[chain.tail].previous == chain.head; }

private:
    struct node {
        lattice_point at;
        std::int32_t vertex, previous, next;
        std::int32_t link;  ///< link of the edge to the next vertex
    };

    std::int32_t add_node(std::int32_t vertex, lattice_point at) {
        nodes_.push_back({at, vertex, -1, -1, -1});
        return nodes_.count() - 1;
    }
    void join(std::int32_t a, std::int32_t b, std::int32_t link) {
        nodes_[a].next = b, nodes_[b].previous = a, nodes_[a].link = link;
    }
    std::int32_t add_link(std::int32_t half_edge) {
        open_sides_.push_back(half_edge);
        return open_sides_.count() - 1;
    }

    /// Adds a triangle and returns its first half-edge.
    std::int32_t cut_off(std::int32_t a, std::int32_t b, std::int32_t c, triangulation& result) {
        const std::int32_t half_edge = result.triangles.count();
        for (std::int32_t i : {a, b, c}) result.triangles.push_back(static_cast<std::uint32_t>(nodes_[i].vertex));
        result.mates.resize(result.mates.size() + 3, -1);
        return half_edge;
    }

    /// Stores `half_edge` as the first half-edge of a link's edge. If the link has one already, makes the two half-edges mates.
    void attach(std::int32_t link, std::int32_t half_edge, triangulation& result) {
        if (link < 0) return;
        std::int32_t& other = open_sides_[link];
        if (other < 0) {
            other = half_edge;
        } else {
            result.mates[other] = half_edge;
            result.mates[half_edge] = other;
        }
    }

    buffer<node> nodes_;
    buffer<std::int32_t> open_sides_;  ///< per link: the half-edge on its first side, or -1
};

}}}  // namespace ldi::detail
