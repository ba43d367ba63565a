// Plane-sweep triangulation of polygons with holes and inner polylines (paper, section "Meshing", Figure "meshing" d; de Berg et
// al., Computational Geometry, chapter 3). One sweep from top to bottom divides the polygon into monotone parts and triangulates
// them: each part between two active edges keeps a chain of vertices that wait for their triangles. All decisions use exact
// integer arithmetic, and the same sweep detects whether the polygon crosses or touches itself.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/mesh/detail/waiting_chains.hpp>
#include <ldi/mesh/polygon.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Edges that prevent the triangulation of a polygon: some of them cross or touch where they must not. The first vertex of an
/// edge identifies the edge.
struct polygon_conflict {
    buffer<std::int32_t> edges;
};

/// Triangulates polygons. Use one object for many polygons, so that it allocates memory once.
class triangulator {
public:
    /// Triangulates a polygon. Every vertex is used, every edge of `shape` is an edge of a triangle, and no triangle is
    /// degenerate. If the polygon crosses itself, or touches itself in a way that `polygon` does not allow, returns the
    /// conflict; `result` is then invalid. Raises mismatch for an index that `shape` does not have, and too_large for more than
    /// 2^28 vertices or for coordinates beyond +-2^16.
    std::optional<polygon_conflict> operator()(const polygon& shape, triangulation& result);

private:
    /// An edge that crosses the sweep line, and the part of the interior to its right.
    struct active_edge {
        lattice_point upper, lower;
        std::int32_t upper_vertex, lower_vertex;
        std::int32_t edge;  ///< vertex at which the edge begins in the polygon
        bool interior_left, interior_right;
        detail::waiting_chain part{};  ///< chain of the part to the right; only if interior_right
    };
    /// A point that the sweep has reached. The edges that end there are adjacent in status_.
    struct swept_point {
        lattice_point at;
        std::size_t first_event, last_event;       ///< vertices: events_[first_event .. last_event)
        std::size_t first_ending = 0, ending = 0;  ///< ending edges: status_[first_ending .. first_ending + ending)
        bool interior_left = false, interior_right = false;

        std::size_t last_ending() const { return first_ending + ending; }
    };

    static void check(const polygon& shape);
    static bool is_right_of(lattice_point p, const active_edge& e) { return detail::turn(e.upper, e.lower, p) < 0; }

    void collect_events(const polygon& shape);
    std::optional<polygon_conflict> sweep_point(const polygon& shape, swept_point& p, triangulation& result);

    // Steps of sweep_point. A bool result is false if the polygon is in conflict with itself at this point.
    std::optional<polygon_conflict> collect_edges(const polygon& shape, swept_point& p);
    void start_edge(const polygon& shape, std::int32_t from, std::int32_t to);
    bool find_ending_edges(swept_point& p) const;
    bool interior_alternates(const swept_point& p) const;
    bool end_parts(const swept_point& p, triangulation& result);
    bool continue_parts(const swept_point& p, triangulation& result);
    void replace_edges(const swept_point& p);
    polygon_conflict conflict_at(const polygon& shape, const swept_point& p) const;

    buffer<std::uint64_t> events_;  ///< vertices sorted by y, then x
    buffer<std::int32_t> before_;   ///< predecessor of each vertex in its polygon
    detail::waiting_chains chains_;
    buffer<active_edge> status_;    ///< edges that cross the sweep line, from left to right
    buffer<active_edge> starting_;  ///< edges that begin at the current point, from left to right
};

inline std::optional<polygon_conflict> triangulator::operator()(const polygon& shape, triangulation& result) {
    check(shape);
    collect_events(shape);
    chains_.clear(), status_.clear();
    result.triangles.clear(), result.mates.clear();
    for (std::size_t first = 0; first < events_.size();) {
        swept_point p{shape.points[detail::vertex_of(events_[first])], first, first + 1};
        while (p.last_event < events_.size() && detail::at_same_point(events_[p.last_event], events_[first])) ++p.last_event;
        if (std::optional<polygon_conflict> conflict = sweep_point(shape, p, result)) return conflict;
        first = p.last_event;
    }
    return std::nullopt;
}

inline void triangulator::check(const polygon& shape) {
    const std::size_t count = shape.points.size();
    if (count > static_cast<std::size_t>(detail::max_polygon_vertices))
        raise(error_code::too_large, "triangulator", "at most 2^28 vertices", std::to_string(count));
    const auto is_inside = [](const lattice_point& p) {
        constexpr std::int32_t limit = 1 << 16;
        return p.x >= -limit && p.x <= limit && p.y >= -limit && p.y <= limit;
    };
    if (!std::all_of(shape.points.begin(), shape.points.end(), is_inside))
        raise(error_code::too_large, "triangulator", "coordinates of at most 2^16 in size", "larger coordinates");
    const auto is_index = [&](std::int32_t next) { return next >= -1 && next < static_cast<std::int32_t>(count); };
    if (shape.next.size() != count || shape.outline_count < 0 || static_cast<std::size_t>(shape.outline_count) > count ||
        !std::all_of(shape.next.begin(), shape.next.end(), is_index))
        raise(error_code::mismatch, "triangulator", "`next` and outline_count for " + std::to_string(count) + " vertices",
              "another size of `next`, or an index out of range");
}

inline void triangulator::collect_events(const polygon& shape) {
    const std::int32_t count = shape.points.count();
    events_.clear(), before_.assign(shape.points.size(), -1);
    for (std::int32_t v = 0; v < count; ++v) {
        events_.push_back(detail::polygon_event(shape.points[v], v));
        if (shape.next[v] >= 0) before_[shape.next[v]] = v;
    }
    std::sort(events_.begin(), events_.end());
}

inline std::optional<polygon_conflict> triangulator::sweep_point(const polygon& shape, swept_point& p, triangulation& result) {
    if (std::optional<polygon_conflict> conflict = collect_edges(shape, p)) return conflict;
    if (!find_ending_edges(p) || !interior_alternates(p) || !end_parts(p, result) || !continue_parts(p, result))
        return conflict_at(shape, p);
    replace_edges(p);
    return std::nullopt;
}

/// Counts the edges that end at the point and records those that begin there.
inline std::optional<polygon_conflict> triangulator::collect_edges(const polygon& shape, swept_point& p) {
    starting_.clear();
    for (std::size_t event = p.first_event; event < p.last_event; ++event) {
        const std::int32_t v = detail::vertex_of(events_[event]);
        bool has_edge = false;
        for (const auto& [from, to] : {std::pair{v, shape.next[v]}, std::pair{before_[v], v}}) {
            if (from < 0 || to < 0) continue;
            has_edge = true;
            const lattice_point other = shape.points[from == v ? to : from];
            if (p.at == other) return polygon_conflict{{from}};
            if (detail::above(other, p.at))
                ++p.ending;
            else
                start_edge(shape, from, to);
        }
        if (!has_edge && p.last_event - p.first_event > 1) return conflict_at(shape, p);
    }
    return std::nullopt;
}

/// Inserts the edge `from` -> `to` into starting_, which stays sorted from left to right.
inline void triangulator::start_edge(const polygon& shape, std::int32_t from, std::int32_t to) {
    const lattice_point a = shape.points[from], b = shape.points[to];
    const bool downwards = detail::above(a, b), inner = from >= shape.outline_count;
    const active_edge e{downwards ? a : b,  downwards ? b : a,  downwards ? from : to, downwards ? to : from, from,
                        inner || downwards, inner || !downwards};
    // If two collinear edges overlap, the one with the interior on its left sorts first, so that the empty gap between them
    // counts as exterior.
    const auto left_of = [](const active_edge& f, const active_edge& g) {
        const std::int64_t t = detail::turn(f.lower, f.upper, g.lower);
        return t != 0 ? t > 0 : f.interior_left && !g.interior_left;
    };
    std::size_t place = starting_.size();
    while (place > 0 && left_of(e, starting_[place - 1])) --place;
    starting_.insert(starting_.begin() + place, e);
}

/// Finds the edges that end at this point. Returns false if they are not adjacent in status_, or if the next edge does not lie
/// strictly to the right of the point. In both cases, edges cross or touch.
inline bool triangulator::find_ending_edges(swept_point& p) const {
    const active_edge* const first =
        std::partition_point(status_.begin(), status_.end(), [&](const active_edge& e) { return is_right_of(p.at, e); });
    p.first_ending = static_cast<std::size_t>(first - status_.begin());
    std::size_t right = p.first_ending;
    while (right < status_.size() && status_[right].lower == p.at) ++right;
    if (right != p.last_ending()) return false;
    if (right < status_.size() && detail::turn(status_[right].upper, status_[right].lower, p.at) <= 0) return false;
    p.interior_left = p.first_ending > 0 && status_[p.first_ending - 1].interior_right;
    p.interior_right = right < status_.size() && status_[right].interior_left;
    return true;
}

/// Checks that interior and exterior alternate across the edges that begin here, and match the outer sides of the edges that end
/// here. Also checks that edges with interior between them start at the same vertex and do not overlap. Other overlapping edges
/// must end at the same point.
inline bool triangulator::interior_alternates(const swept_point& p) const {
    bool interior = p.interior_left;
    for (const active_edge& e : starting_) {
        if (e.interior_left != interior) return false;
        interior = e.interior_right;
    }
    if (interior != p.interior_right) return false;
    for (std::size_t i = 1; i < starting_.size(); ++i) {
        const active_edge &a = starting_[i - 1], &b = starting_[i];
        const bool lie_on_each_other = detail::turn(a.lower, a.upper, b.lower) == 0;
        if (a.interior_right && (a.upper_vertex != b.upper_vertex || lie_on_each_other)) return false;
        if (!a.interior_right && lie_on_each_other && a.lower != b.lower) return false;
    }
    return true;
}

/// Completes the triangles of the parts between two edges that end here.
inline bool triangulator::end_parts(const swept_point& p, triangulation& result) {
    for (std::size_t i = p.first_ending; i + 1 < p.last_ending(); ++i) {
        if (!status_[i].interior_right) continue;
        if (status_[i].lower_vertex != status_[i + 1].lower_vertex) return false;
        detail::waiting_chain part = status_[i].part;
        chains_.append(part, status_[i].lower_vertex, p.at, -1, result);
        if (!chains_.is_edge(part)) return false;
    }
    return true;
}

/// Continues the parts to the left and right below this point. If no edge begins, both parts become one. If no edge ends, the
/// part that contains the point is divided.
inline bool triangulator::continue_parts(const swept_point& p, triangulation& result) {
    const bool ends = p.ending > 0, begins = !starting_.empty();
    if (!ends && !begins && !p.interior_left) return false;
    const std::int32_t left_vertex = ends     ? status_[p.first_ending].lower_vertex
                                     : begins ? starting_.front().upper_vertex
                                              : detail::vertex_of(events_[p.first_event]);
    const std::int32_t right_vertex = ends     ? status_[p.last_ending() - 1].lower_vertex
                                      : begins ? starting_.back().upper_vertex
                                               : left_vertex;
    // If no edge ends or none begins here, the interior on the left and on the right of the point is one part, so both sides have
    // the same vertex.
    if (p.interior_left && (!ends || !begins) && left_vertex != right_vertex) return false;
    if (p.interior_left && begins && starting_.front().upper_vertex != left_vertex) return false;
    if (p.interior_right && begins && starting_.back().upper_vertex != right_vertex) return false;

    detail::waiting_chain left, right;
    if (p.interior_left) left = status_[p.first_ending - 1].part;
    if (p.interior_right && ends) right = status_[p.last_ending() - 1].part;
    std::int32_t diagonal = -1;
    if (p.interior_left && !ends) {
        // The point lies inside a part. The last vertex added to the part's chain is visible from the point.
        right = chains_.divide(left);
        diagonal = chains_.add_link();
    }
    if (p.interior_left) chains_.append(left, left_vertex, p.at, diagonal, result);
    if (p.interior_right) chains_.prepend(right, right_vertex, p.at, diagonal, result);
    if (p.interior_left && !begins) chains_.unite(left, right);

    for (std::size_t i = 0; i + 1 < starting_.size(); ++i) {
        active_edge& e = starting_[i];
        if (e.interior_right) e.part = chains_.begin(e.upper_vertex, p.at);
    }
    if (begins && p.interior_right) starting_.back().part = right;
    if (p.interior_left) status_[p.first_ending - 1].part = left;
    return true;
}

/// Replaces the edges that end at this point with the edges that begin here.
inline void triangulator::replace_edges(const swept_point& p) {
    const std::size_t replaced = (std::min)(p.ending, starting_.size());
    active_edge* const place = status_.begin() + p.first_ending;
    std::copy(starting_.begin(), starting_.begin() + replaced, place);
    if (p.ending > replaced)
        status_.erase(place + replaced, place + p.ending);
    else
        status_.insert(place + replaced, starting_.begin() + replaced, starting_.end());
}

/// Collects the polygon's edges that meet at a point, and the edges next to them in status_.
inline polygon_conflict triangulator::conflict_at(const polygon& shape, const swept_point& p) const {
    polygon_conflict conflict;
    const auto add = [&](std::int32_t vertex) {
        if (vertex >= 0 && shape.next[vertex] >= 0) conflict.edges.push_back(vertex);
    };
    for (std::size_t event = p.first_event; event < p.last_event; ++event) {
        const std::int32_t v = detail::vertex_of(events_[event]);
        add(v), add(before_[v]);
    }
    const auto ends_here = [&](std::size_t i) { return i < status_.size() && status_[i].lower == p.at; };
    for (std::size_t i = 0; i < status_.size(); ++i)
        if (i == p.first_ending || i + 1 == p.first_ending || ends_here(i) || (i > 0 && ends_here(i - 1)) || ends_here(i + 1))
            add(status_[i].edge);
    return conflict;
}

}}  // namespace ldi
