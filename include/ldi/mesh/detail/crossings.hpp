// Finds all points where a polygon's outline crosses or touches itself.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/mesh/polygon.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Finds crossings between the outline edges of a polygon. Compares only edges whose bounding boxes meet. Keep an object to reuse
/// its memory.
class crossing_finder {
public:
    /// Reports three kinds of faults. collision(v, w): the edges v -> next[v] and w -> next[w] meet at a point that is not an end
    /// of both. overlap(v, w): v and w lie at one point, and the interiors at both vertices overlap. spike(v): the outline
    /// doubles back at v, or has an edge of length 0 there. Two edges that coincide in opposite directions, as along a slit, are
    /// not a fault. A fault may be reported more than once.
    template <class Report>
    void find_all(const polygon& shape, Report& report) {
        assign(shape);
        if (events_.empty()) return;
        std::sort(events_.begin(), events_.end());
        start_sweep();
        for (std::size_t i = 0; i < events_.size(); ++i) {
            const std::int32_t v = vertex_of(events_[i]), u = before_[v];
            check_visit(v, report);
            for (std::size_t j = i + 1; j < events_.size() && at_same_point(events_[j], events_[i]); ++j)
                compare_visits(v, vertex_of(events_[j]), report);
            if (!above(point(next(v)), point(v))) enter(make_edge(v), report);
            if (above(point(v), point(u))) enter(make_edge(u), report);
        }
    }

    /// Same as find_all(), but compares each fresh edge (fresh[v] != 0) with all edges, and skips pairs of other edges. The
    /// caller guarantees that there are no faults between the other edges.
    template <class Report>
    void find_fresh(const polygon& shape, const buffer<std::uint8_t>& fresh, Report& report) {
        if (std::count(fresh.begin(), fresh.end(), 0) + max_fresh < fresh.count()) return find_all(shape, report);
        assign(shape);
        const std::int32_t count = shape.outline_count;
        edges_.clear();
        for (std::int32_t v = 0; v < count; ++v) edges_.push_back(make_edge(v));
        for (std::int32_t v = 0; v < count; ++v) {
            if (fresh[v] == 0) continue;
            const edge& e = edges_[v];
            for (const edge& f : edges_)
                if (f.top <= e.bottom && e.top <= f.bottom && f.left <= e.right && e.left <= f.right && f.vertex != v)
                    if (collide(e, f)) report.collision(v, f.vertex);
            for (std::int32_t end : {v, next(v)}) {
                check_visit(end, report);
                for (std::int32_t w = 0; w < count; ++w)
                    if (w != end && at_same_point(events_[w], events_[end])) compare_visits(end, w, report);
            }
        }
    }

    /// Returns the vertex before v on the outline of the last polygon.
    std::int32_t before(std::int32_t v) const { return before_[v]; }

private:
    struct edge {
        lattice_point a, b;
        std::int32_t left, right, top, bottom, vertex;
    };
    /// One passage of the outline through the point `at`: it arrives from `from` and continues to `to`. The interior extends
    /// clockwise from `to` to `from`.
    struct visit {
        lattice_point at, from, to;
    };

    /// Entry of a column's list: an edge that touches the column. Columns are vertical strips of the plane.
    struct entry {
        std::int32_t edge, next;
    };
    /// For at most this many fresh edges, comparing each of them with all edges is faster than a sweep.
    static constexpr std::int32_t max_fresh = 16;
    /// Columns are 2^4 pixels wide. Since an outline stays close to the lattice lines that it follows, few of its edges cross a
    /// row within one column.
    static constexpr int column_shift = 4;

    lattice_point point(std::int32_t v) const { return shape_->points[v]; }
    std::int32_t next(std::int32_t v) const { return shape_->next[v]; }

    void assign(const polygon& shape) {
        shape_ = &shape;
        events_.clear(), before_.resize(shape.points.size());
        for (std::int32_t v = 0; v < shape.outline_count; ++v) {
            events_.push_back(polygon_event(shape.points[v], v));
            before_[shape.next[v]] = v;
        }
    }

    edge make_edge(std::int32_t v) const {
        const lattice_point a = point(v), b = point(next(v));
        return {a, b, (std::min)(a.x, b.x), (std::max)(a.x, b.x), (std::min)(a.y, b.y), (std::max)(a.y, b.y), v};
    }

    void start_sweep() {
        std::int32_t right = point(0).x;
        left_ = right;
        for (std::int32_t v = 1; v < shape_->outline_count; ++v)
            left_ = (std::min)(left_, point(v).x), right = (std::max)(right, point(v).x);
        columns_.assign(static_cast<std::size_t>(column_of(right)) + 1, -1);
        entries_.clear(), edges_.clear();
    }

    std::int32_t column_of(std::int32_t x) const { return (x - left_) >> column_shift; }

    /// Compares an edge with all edges that cross the sweep line in the same columns, and adds it to these columns.
    template <class Report>
    void enter(const edge& e, Report& report) {
        const std::int32_t index = edges_.count();
        edges_.push_back(e);
        for (std::int32_t column = column_of(e.left); column <= column_of(e.right); ++column) {
            for (std::int32_t* link = &columns_[column]; *link >= 0;) {
                const edge& f = edges_[entries_[*link].edge];
                if (f.bottom < e.top) {
                    *link = entries_[*link].next;
                    continue;
                }
                // Two edges may share several columns; they are compared only in the first one.
                const bool is_first = column == column_of((std::max)(e.left, f.left));
                if (is_first && f.left <= e.right && e.left <= f.right && collide(e, f)) report.collision(e.vertex, f.vertex);
                link = &entries_[*link].next;
            }
            entries_.push_back({index, columns_[column]});
            columns_[column] = entries_.count() - 1;
        }
    }

    template <class Report>
    void check_visit(std::int32_t v, Report& report) const {
        const std::int32_t u = before_[v];
        if (point(u) == point(next(v)) || point(v) == point(next(v))) report.spike(v);
    }

    template <class Report>
    void compare_visits(std::int32_t v, std::int32_t w, Report& report) const {
        const visit a = visit_of(v), b = visit_of(w);
        if (overlap(a, b) || overlap(b, a)) report.overlap(v, w);
    }
    visit visit_of(std::int32_t v) const { return {point(v), point(before_[v]), point(next(v))}; }

    static std::int64_t dot(lattice_point center, lattice_point a, lattice_point b) {
        return std::int64_t{a.x - center.x} * (b.x - center.x) + std::int64_t{a.y - center.y} * (b.y - center.y);
    }
    /// Whether the direction from v.at to p points into the interior at v, not along its edges.
    static bool inside(const visit& v, lattice_point p) {
        const std::int64_t whole = turn(v.at, v.to, v.from), a = turn(v.at, v.to, p), b = turn(v.at, p, v.from);
        if (whole > 0) return a > 0 && b > 0;
        if (whole < 0) return !(a <= 0 && b <= 0);
        if (dot(v.at, v.to, v.from) < 0) return a > 0;
        return a != 0 || dot(v.at, v.to, p) < 0;
    }
    static bool same_direction(lattice_point center, lattice_point p, lattice_point q) {
        return turn(center, p, q) == 0 && dot(center, p, q) > 0;
    }
    static bool overlap(const visit& v, const visit& w) {
        return inside(v, w.from) || inside(v, w.to) || same_direction(v.at, v.from, w.from) || same_direction(v.at, v.to, w.to);
    }

    static int side(const edge& e, lattice_point p) {
        const std::int64_t t = turn(e.a, e.b, p);
        return t < 0 ? -1 : t > 0 ? 1 : 0;
    }
    static bool in_box(const edge& e, lattice_point p) {
        return e.left <= p.x && p.x <= e.right && e.top <= p.y && p.y <= e.bottom;
    }
    static bool touches(const edge& e, lattice_point p, int side_of_p) {
        return side_of_p == 0 && in_box(e, p) && p != e.a && p != e.b;
    }

    static bool collide(const edge& e, const edge& f) {
        const int a = side(e, f.a), b = side(e, f.b), c = side(f, e.a), d = side(f, e.b);
        if (a * b < 0 && c * d < 0) return true;
        return touches(e, f.a, a) || touches(e, f.b, b) || touches(f, e.a, c) || touches(f, e.b, d);
    }

    const polygon* shape_ = nullptr;
    buffer<std::uint64_t> events_;
    buffer<std::int32_t> before_;
    buffer<edge> edges_;
    std::int32_t left_ = 0;         ///< minimum x over all edges
    buffer<std::int32_t> columns_;  ///< last entry of each column, or -1
    buffer<entry> entries_;
};

}}}  // namespace ldi::detail
