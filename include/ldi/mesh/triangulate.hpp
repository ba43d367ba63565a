// Plane-sweep triangulation of polygons with holes and inner polylines (paper, section "Meshing", Figure "meshing" d; de Berg et
// al., Computational Geometry, chapter 3). One sweep from top to bottom both cuts the polygon into monotone parts and
// triangulates them: each part between two active edges keeps the chain of vertices that still wait for triangles. All decisions
// are exact integer arithmetic, and the same sweep finds out whether the polygon crosses or touches itself.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/memory.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

namespace ldi {

struct lattice_point {
    std::int32_t x, y;  ///< within +-2^18
};

/// At most 2^24 vertices in chains. A vertex is followed by `next`, or nothing (-1). Closed chains are outlines: the interior
/// lies to the right (y downwards: outer loops clockwise, holes counter-clockwise). Open chains and single vertices must lie in
/// the interior.
///
/// An outline may touch itself in vertices and along whole edges, from outside; such vertices are there once for each part, as an
/// outline that is walked along the inside has them.
struct polygon {
    buffer<lattice_point> points;
    buffer<std::int32_t> next;
    std::int32_t outline_count = 0;  ///< vertices [0, outline_count) are those of closed chains, the rest those of open ones

    void clear() { points.clear(), next.clear(), outline_count = 0; }
};

/// Why a polygon can't be triangulated: some of these edges, known by the vertices at which they begin, cross or touch where they
/// must not.
struct polygon_conflict {
    buffer<std::int32_t> edges;
};

namespace detail {
/// Vertices of a polygon as numbers that sort by y, then x: y, x and vertex in 20, 20 and 24 bits.
inline std::uint64_t polygon_event(lattice_point p, std::size_t vertex) {
    constexpr std::int32_t offset = 1 << 19;
    return static_cast<std::uint64_t>(p.y + offset) << 44 | static_cast<std::uint64_t>(p.x + offset) << 24 | vertex;
}
}  // namespace detail

/// F triangles. Half-edge 3 f + i runs from vertex i of triangle f to the one after it.
struct triangulation {
    buffer<std::uint32_t> triangles;  ///< F x 3 vertex indices, counter-clockwise on screen
    buffer<std::int32_t> mates;       ///< F x 3: the half-edge on the other side, or -1 where the edge belongs to a chain
};

/// Triangulates polygons. Keep one to reuse its memory.
class triangulator {
public:
    /// Every vertex is used, every edge of a chain is an edge of a triangle, no triangle is degenerate. If the polygon is not
    /// one, says where; `result` is of no use then.
    std::optional<polygon_conflict> operator()(const polygon& shape, triangulation& result);

private:
    /// A vertex of a chain that waits for triangles. From left to right the interior lies below the chain, and every vertex but
    /// the ends is straight or reflex, else it would have been cut off.
    struct node {
        lattice_point at;
        std::int32_t vertex, previous, next;
        std::int32_t link;  ///< of the edge to the next vertex: index into open_sides_, or -1 for an edge of a polygon's chain
    };
    /// An edge that crosses the sweep line, and the part of the interior to its right.
    struct active_edge {
        lattice_point upper, lower;
        std::int32_t upper_vertex, lower_vertex;
        std::int32_t edge;  ///< the vertex at which it begins
        bool interior_left, interior_right;
        std::int32_t head, tail, lowest;  ///< the chain of the part to the right; only if interior_right
    };
    struct chain {
        std::int32_t head, tail, lowest;
    };

    static bool same(lattice_point a, lattice_point b) { return a.x == b.x && a.y == b.y; }
    static bool above(lattice_point a, lattice_point b) { return a.y != b.y ? a.y < b.y : a.x < b.x; }
    /// Positive if a, b, c turn right on screen.
    static std::int64_t turn(lattice_point a, lattice_point b, lattice_point c) {
        return std::int64_t{b.x - a.x} * (c.y - b.y) - std::int64_t{b.y - a.y} * (c.x - b.x);
    }
    static bool is_right_of(lattice_point p, const active_edge& e) { return turn(e.upper, e.lower, p) < 0; }

    std::int32_t add_node(std::int32_t vertex, lattice_point at) {
        nodes_.push_back({at, vertex, -1, -1, -1});
        return static_cast<std::int32_t>(nodes_.size()) - 1;
    }
    node& at(std::int32_t i) { return nodes_[i]; }
    void join(std::int32_t a, std::int32_t b, std::int32_t link) { at(a).next = b, at(b).previous = a, at(a).link = link; }
    std::int32_t add_link(std::int32_t half_edge) {
        open_sides_.push_back(half_edge);
        return static_cast<std::int32_t>(open_sides_.size()) - 1;
    }
    /// Says that `half_edge` lies along an edge, for the second triangle there to find.
    void attach(std::int32_t link, std::int32_t half_edge, triangulation& result);

    /// Appends `p` to the right end of a chain, over an edge known by `link`, and cuts off what became convex.
    void append(chain& c, std::int32_t p, std::int32_t link, triangulation& result);
    /// Puts `p` before the left end.
    void prepend(chain& c, std::int32_t p, std::int32_t link, triangulation& result);

    void collect_events(const polygon& shape);
    std::optional<polygon_conflict> sweep_point(const polygon& shape, std::size_t first, std::size_t last, triangulation& result);
    polygon_conflict conflict_at(const polygon& shape, std::size_t first, std::size_t last, std::size_t place) const;
    void start_edge(const polygon& shape, std::int32_t from, std::int32_t to);

    buffer<std::uint64_t> events_;  ///< vertices by y, then x
    buffer<std::int32_t> before_;   ///< the vertex whose next is this one
    buffer<node> nodes_;
    buffer<std::int32_t> open_sides_;  ///< for each inner edge the half-edge on its first side, or -1
    buffer<active_edge> status_;       ///< edges that cross the sweep line, from left to right
    buffer<active_edge> starting_;     ///< edges that begin at the point being swept, from left to right
};

inline std::optional<polygon_conflict> triangulator::operator()(const polygon& shape, triangulation& result) {
    LDI_ASSERT(shape.next.size() == shape.points.size());
    collect_events(shape);
    nodes_.clear(), open_sides_.clear(), status_.clear();
    result.triangles.clear(), result.mates.clear();
    for (std::size_t first = 0; first < events_.size();) {
        std::size_t last = first + 1;
        while (last < events_.size() && (events_[last] >> 24) == (events_[first] >> 24)) ++last;
        if (std::optional<polygon_conflict> conflict = sweep_point(shape, first, last, result)) return conflict;
        first = last;
    }
    return std::nullopt;
}

inline void triangulator::attach(std::int32_t link, std::int32_t half_edge, triangulation& result) {
    if (link < 0) return;
    std::int32_t& other = open_sides_[link];
    if (other < 0) {
        other = half_edge;
    } else {
        result.mates[other] = half_edge;
        result.mates[half_edge] = other;
    }
}

inline void triangulator::append(chain& c, std::int32_t p, std::int32_t link, triangulation& result) {
    std::int32_t a = c.tail;
    while (a != c.head) {
        const std::int32_t b = at(a).previous;
        if (turn(at(b).at, at(a).at, at(p).at) <= 0) break;
        const std::int32_t half_edge = static_cast<std::int32_t>(result.triangles.size());
        for (std::int32_t i : {b, p, a}) result.triangles.push_back(static_cast<std::uint32_t>(at(i).vertex));
        result.mates.resize(result.mates.size() + 3, -1);
        attach(link, half_edge + 1, result);
        attach(at(b).link, half_edge + 2, result);
        link = add_link(half_edge);
        a = b;
    }
    join(a, p, link);
    c.tail = c.lowest = p;
}

inline void triangulator::prepend(chain& c, std::int32_t p, std::int32_t link, triangulation& result) {
    std::int32_t a = c.head;
    while (a != c.tail) {
        const std::int32_t b = at(a).next;
        if (turn(at(p).at, at(a).at, at(b).at) <= 0) break;
        const std::int32_t half_edge = static_cast<std::int32_t>(result.triangles.size());
        for (std::int32_t i : {p, b, a}) result.triangles.push_back(static_cast<std::uint32_t>(at(i).vertex));
        result.mates.resize(result.mates.size() + 3, -1);
        attach(at(a).link, half_edge + 1, result);
        attach(link, half_edge + 2, result);
        link = add_link(half_edge);
        a = b;
    }
    join(p, a, link);
    c.head = c.lowest = p;
}

inline void triangulator::collect_events(const polygon& shape) {
    const std::size_t count = shape.points.size();
    LDI_ASSERT(count <= std::size_t{1} << 24);
    events_.resize(count), before_.assign(count, -1);
    for (std::size_t v = 0; v < count; ++v) {
        events_[v] = detail::polygon_event(shape.points[v], v);
        if (shape.next[v] >= 0) before_[shape.next[v]] = static_cast<std::int32_t>(v);
    }
    std::sort(events_.begin(), events_.end());
}

/// Files the edge from -> to under the edges that begin here if `from` or `to` is its upper end.
inline void triangulator::start_edge(const polygon& shape, std::int32_t from, std::int32_t to) {
    const lattice_point a = shape.points[from], b = shape.points[to];
    const bool downwards = above(a, b), inner = from >= shape.outline_count;
    active_edge e{downwards ? a : b,
                  downwards ? b : a,
                  downwards ? from : to,
                  downwards ? to : from,
                  from,
                  inner || downwards,
                  inner || !downwards,
                  -1,
                  -1,
                  -1};
    // Of two edges that lie on each other, the one with the interior on its left goes left: the part between them is empty
    // outside.
    const auto left_of = [](const active_edge& f, const active_edge& g) {
        const std::int64_t t = turn(f.lower, f.upper, g.lower);
        return t != 0 ? t > 0 : f.interior_left && !g.interior_left;
    };
    std::size_t place = starting_.size();
    while (place > 0 && left_of(e, starting_[place - 1])) --place;
    starting_.insert(starting_.begin() + static_cast<std::ptrdiff_t>(place), e);
}

/// All edges that meet at a point, those that pass it next to `place` in the status, and those next to where its edges really
/// are.
inline polygon_conflict triangulator::conflict_at(const polygon& shape, std::size_t first, std::size_t last,
                                                  std::size_t place) const {
    polygon_conflict conflict;
    const auto add = [&](std::int32_t vertex) {
        if (vertex >= 0 && shape.next[vertex] >= 0) conflict.edges.push_back(vertex);
    };
    const lattice_point p = shape.points[events_[first] & 0xFFFFFF];
    for (std::size_t event = first; event < last; ++event) {
        const std::int32_t v = static_cast<std::int32_t>(events_[event] & 0xFFFFFF);
        add(v), add(before_[v]);
    }
    for (std::size_t i = 0; i < status_.size(); ++i)
        if (i == place || i + 1 == place || same(status_[i].lower, p) || (i > 0 && same(status_[i - 1].lower, p)) ||
            (i + 1 < status_.size() && same(status_[i + 1].lower, p)))
            add(status_[i].edge);
    return conflict;
}

inline std::optional<polygon_conflict> triangulator::sweep_point(const polygon& shape, std::size_t first_event,
                                                                 std::size_t last_event, triangulation& result) {
    const auto vertex_of = [&](std::size_t event) { return static_cast<std::int32_t>(events_[event] & 0xFFFFFF); };
    const lattice_point p = shape.points[vertex_of(first_event)];

    std::size_t ending = 0;
    starting_.clear();
    for (std::size_t event = first_event; event < last_event; ++event) {
        const std::int32_t v = vertex_of(event);
        bool has_edge = false;
        for (const auto& [from, to] : {std::pair{v, shape.next[v]}, std::pair{before_[v], v}}) {
            if (from < 0 || to < 0) continue;
            has_edge = true;
            const lattice_point other = shape.points[from == v ? to : from];
            if (same(p, other)) return polygon_conflict{{from}};
            if (above(other, p))
                ++ending;
            else
                start_edge(shape, from, to);
        }
        if (!has_edge && last_event - first_event > 1) return conflict_at(shape, first_event, last_event, 0);
    }

    // The edges that end here stand side by side in the status, between one that passes on the left and one on the right.
    const std::size_t s = static_cast<std::size_t>(
        std::partition_point(status_.begin(), status_.end(), [&](const active_edge& e) { return is_right_of(p, e); }) -
        status_.begin());
    std::size_t t = s;
    while (t < status_.size() && same(status_[t].lower, p)) ++t;
    const auto conflict_here = [&] { return conflict_at(shape, first_event, last_event, s); };
    if (t - s != ending || (t < status_.size() && turn(status_[t].upper, status_[t].lower, p) <= 0)) return conflict_here();

    // Interior and exterior must alternate across the new edges as they did across the old ones, and what is one part of the
    // interior at this point must be one vertex.
    const bool interior_left = s > 0 && status_[s - 1].interior_right;
    const bool interior_right = t < status_.size() && status_[t].interior_left;
    bool interior = interior_left;
    for (const active_edge& e : starting_) {
        if (e.interior_left != interior) return conflict_here();
        interior = e.interior_right;
    }
    if (interior != interior_right) return conflict_here();
    for (std::size_t i = 1; i < starting_.size(); ++i) {
        const active_edge &a = starting_[i - 1], &b = starting_[i];
        if (a.interior_right && (a.upper_vertex != b.upper_vertex || turn(a.lower, a.upper, b.lower) == 0))
            return conflict_here();
        if (!a.interior_right && turn(a.lower, a.upper, b.lower) == 0 && !same(a.lower, b.lower)) return conflict_here();
    }

    // The parts that end here.
    for (std::size_t i = s; i + 1 < t; ++i) {
        if (!status_[i].interior_right) continue;
        if (status_[i].lower_vertex != status_[i + 1].lower_vertex) return conflict_here();
        chain c{status_[i].head, status_[i].tail, status_[i].lowest};
        append(c, add_node(status_[i].lower_vertex, p), -1, result);
        if (at(c.tail).previous != c.head) return conflict_here();
    }

    // The parts to the left and right, which go on below or, where no edge begins, become one.
    const std::int32_t left_vertex = t > s               ? status_[s].lower_vertex
                                     : starting_.empty() ? vertex_of(first_event)
                                                         : starting_.front().upper_vertex;
    const std::int32_t right_vertex = t > s               ? status_[t - 1].lower_vertex
                                      : starting_.empty() ? left_vertex
                                                          : starting_.back().upper_vertex;
    chain left{-1, -1, -1}, right{-1, -1, -1};
    std::int32_t diagonal = -1;
    if (s == t) {
        if (interior_left) {
            // Inside a part: the last vertex that was added to its chain sees this one.
            if (left_vertex != right_vertex) return conflict_here();
            const active_edge& e = status_[s - 1];
            const std::int32_t seen = e.lowest, copy = add_node(at(seen).vertex, at(seen).at);
            left = {e.head, seen, seen};
            right = {copy, seen == e.tail ? copy : e.tail, copy};
            if (seen != e.tail) join(copy, at(seen).next, at(seen).link);
            diagonal = add_link(-1);
        } else if (starting_.empty()) {
            return conflict_here();
        }
    } else {
        if (interior_left) left = {status_[s - 1].head, status_[s - 1].tail, status_[s - 1].lowest};
        if (interior_right) right = {status_[t - 1].head, status_[t - 1].tail, status_[t - 1].lowest};
    }
    if (interior_left) {
        if (!starting_.empty() && starting_.front().upper_vertex != left_vertex) return conflict_here();
        append(left, add_node(left_vertex, p), diagonal, result);
    }
    if (interior_right) {
        if (!starting_.empty() && starting_.back().upper_vertex != right_vertex) return conflict_here();
        prepend(right, add_node(right_vertex, p), diagonal, result);
    }
    if (starting_.empty()) {
        if (interior_left) {
            if (left_vertex != right_vertex) return conflict_here();
            // One vertex ends the left chain and begins the right one.
            join(left.tail, at(right.head).next, at(right.head).link);
            left.tail = right.tail;
        }
    } else {
        for (std::size_t i = 0; i + 1 < starting_.size(); ++i) {
            active_edge& e = starting_[i];
            if (e.interior_right) e.head = e.tail = e.lowest = add_node(e.upper_vertex, p);
        }
        active_edge& e = starting_.back();
        if (interior_right) e.head = right.head, e.tail = right.tail, e.lowest = right.lowest;
    }
    if (interior_left) {
        active_edge& e = status_[s - 1];
        e.head = left.head, e.tail = left.tail, e.lowest = left.lowest;
    }

    const std::size_t replaced = (std::min)(t - s, starting_.size());
    std::copy(starting_.begin(), starting_.begin() + static_cast<std::ptrdiff_t>(replaced),
              status_.begin() + static_cast<std::ptrdiff_t>(s));
    const auto place = status_.begin() + static_cast<std::ptrdiff_t>(s + replaced);
    if (t - s > replaced)
        status_.erase(place, status_.begin() + static_cast<std::ptrdiff_t>(t));
    else
        status_.insert(place, starting_.begin() + static_cast<std::ptrdiff_t>(replaced), starting_.end());
    return std::nullopt;
}

}  // namespace ldi
