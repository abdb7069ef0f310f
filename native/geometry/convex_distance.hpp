// Distance between two convex hulls: the GJK algorithm (Gilbert, Johnson, Keerthi 1988) with a certified lower bound.
//
// For every direction, the gap between the two hulls' projections is a lower bound of their distance. The bound
// therefore holds whether the iteration has converged or not, and rounding costs at most kHullRounding.
#pragma once

#include "geometry/convex_hull.hpp"

namespace mmp {

namespace gjk {
inline constexpr double kConverged = 1e-9;  // [m]
inline constexpr int kMaxIterations = 64;
}  // namespace gjk

// Returns whether a vector has a direction in spite of rounding.
inline bool long_enough(const Point& v) { return dot(v, v) > gjk::kConverged * gjk::kConverged; }

struct PosedHull {
  const ConvexHull* hull;
  RigidPose pose;

  Point center() const { return pose.apply(hull->center); }
  // Returns the ends of the axis of the capsule that contains the hull.
  Segment axis() const { return {pose.apply(hull->axis.from), pose.apply(hull->axis.to)}; }
  // Returns the farthest point along a direction, relative to the origin of the hull's frame.
  Point support(const Point& d) const { return pose.turn(hull->support(pose.turn_back(d))); }
};

struct ConvexDistance {
  double lower;     // certified [m]; minus infinity for hulls that overlap
  double upper;     // of two points that were found [m]
  Point between{};  // vector from the second of these points to the first, without the hulls' radii
};

namespace gjk {

// Simplex in the Minkowski difference, and its point closest to the origin.
class Simplex {
 public:
  bool has(const Point& w) const {
    for (int k = 0; k < count_; ++k)
      if (points_[k].x == w.x && points_[k].y == w.y && points_[k].z == w.z) return true;
    return false;
  }

  // Adds a vertex and keeps the smallest face that holds the closest point. Returns false when the origin is inside.
  bool add(const Point& w, Point& closest) {
    points_[count_++] = w;
    switch (count_) {
      case 1:
        closest = w;
        return true;
      case 2:
        closest = on_segment({0, 1});
        break;
      case 3:
        closest = on_triangle({0, 1, 2});
        break;
      default:
        if (!on_tetrahedron(closest)) return false;
    }
    std::array<Point, 4> kept;
    for (int k = 0; k < face_.count; ++k) kept[k] = points_[face_.at[k]];
    points_ = kept;
    count_ = face_.count;
    return true;
  }

 private:
  struct Face {
    std::array<int, 3> at;
    int count;
  };

  Point on_segment(std::array<int, 2> k) {
    const Point a = points_[k[0]], b = points_[k[1]], ab = b - a;
    const double t = -dot(a, ab), length2 = dot(ab, ab);
    if (t <= 0) return face_ = {{k[0], 0, 0}, 1}, a;
    if (t >= length2) return face_ = {{k[1], 0, 0}, 1}, b;
    face_ = {{k[0], k[1], 0}, 2};
    return a + ab * (t / length2);
  }

  // Voronoi regions of a triangle (Ericson, Real-Time Collision Detection, 5.1.5), for the origin.
  Point on_triangle(std::array<int, 3> k) {
    const Point a = points_[k[0]], b = points_[k[1]], c = points_[k[2]];
    const Point ab = b - a, ac = c - a;
    const double d1 = -dot(ab, a), d2 = -dot(ac, a);
    if (d1 <= 0 && d2 <= 0) return face_ = {{k[0], 0, 0}, 1}, a;
    const double d3 = -dot(ab, b), d4 = -dot(ac, b);
    if (d3 >= 0 && d4 <= d3) return face_ = {{k[1], 0, 0}, 1}, b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return on_segment({k[0], k[1]});
    const double d5 = -dot(ab, c), d6 = -dot(ac, c);
    if (d6 >= 0 && d5 <= d6) return face_ = {{k[2], 0, 0}, 1}, c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return on_segment({k[0], k[2]});
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) return on_segment({k[1], k[2]});
    face_ = {k, 3};
    const Point n = cross(ab, ac);
    const double length2 = dot(n, n);
    return length2 > 0 ? n * (dot(n, a) / length2) : a;
  }

  bool on_tetrahedron(Point& closest) {
    double best = std::numeric_limits<double>::infinity();
    Face face{};
    static constexpr int faces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
    for (const auto& f : faces) {
      const Point a = points_[f[0]], n = cross(points_[f[1]] - a, points_[f[2]] - a);
      const double opposite = dot(n, points_[f[3]] - a), origin = -dot(n, a);
      // Only faces that separate the origin from the fourth vertex; a flat tetrahedron has no inside.
      if (origin * opposite > 0) continue;
      const Point point = on_triangle({f[0], f[1], f[2]});
      const double distance2 = dot(point, point);
      if (distance2 < best) best = distance2, closest = point, face = face_;
    }
    face_ = face;
    return face.count > 0;
  }

  std::array<Point, 4> points_{};
  int count_ = 0;
  Face face_{};
};

}  // namespace gjk

// Distances [m] that end a query: it only asks whether the true distance is below `close`, between the two, or at least
// `wide`.
struct Limits {
  double close, wide;
  bool between = true;  // whether it ends between the two; otherwise the distance is measured there

  // Returns the limits of a query that measures distances below `wide`.
  static Limits measure(double wide) { return {-std::numeric_limits<double>::infinity(), wide, false}; }

  bool answered(const ConvexDistance& d) const {
    return d.upper < close || d.lower >= wide || (between && d.lower >= close && d.upper < wide);
  }
};

// Returns bounds of the distance from the origin to a convex set. `support` returns its farthest point along a
// direction. Unless the limits end it, the iteration runs until both bounds agree. `radii` is taken off both bounds.
template <class Support>
inline ConvexDistance distance_from_origin(const Support& support, Point direction, double radii,
                                           const Limits& limits) {
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  ConvexDistance out{kNone, std::numeric_limits<double>::infinity()};
  gjk::Simplex simplex;
  Point& closest = out.between;
  closest = long_enough(direction) ? direction : Point{1, 0, 0};
  for (int k = 0; k < gjk::kMaxIterations; ++k) {
    if (!long_enough(closest)) return {kNone, 0};
    const double length = std::sqrt(dot(closest, closest));
    const Point w = support(closest * -1.0);
    out.lower = std::max(out.lower, dot(closest, w) / length - kHullRounding - radii);
    if (k > 0) out.upper = std::min(out.upper, length - radii);
    if (limits.answered(out) || out.upper - out.lower < gjk::kConverged || simplex.has(w)) return out;
    Point next = closest;
    if (!simplex.add(w, next)) return {kNone, 0};
    if (k > 0 && dot(next, next) >= length * length) return out;  // rounding ends the progress
    closest = next;
  }
  return out;
}

// Returns the shortest vector from a point of segment `b` to a point of segment `a`, up to rounding (Ericson, Real-Time
// Collision Detection, 5.1.9).
inline Point between_segments(const Segment& a, const Segment& b) {
  const auto part = [](double along, double length2) {
    return length2 > 0 ? std::min(std::max(along / length2, 0.0), 1.0) : 0.0;
  };
  const Point u = a.to - a.from, v = b.to - b.from, r = a.from - b.from;
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ur = dot(u, r), vr = dot(v, r);
  const double t = part(vr + part(uv * vr - ur * vv, uu * vv - uv * uv) * uv, vv);
  return r + u * part(t * uv - ur, uu) - v * t;
}

// Returns the gap between the capsules around two hulls along a direction from the second to the first: a lower bound
// of the distance of the hulls [m]. With rotations in single precision, which are not exactly orthogonal, a hull may
// leave its capsule by 1e-7 m.
inline double capsule_gap(const PosedHull& a, const PosedHull& b, const Point& direction) {
  if (!long_enough(direction)) return -std::numeric_limits<double>::infinity();
  const Segment p = a.axis(), q = b.axis();
  const double from = std::min(dot(direction, p.from - q.from), dot(direction, p.from - q.to));
  const double to = std::min(dot(direction, p.to - q.from), dot(direction, p.to - q.to));
  return std::min(from, to) / std::sqrt(dot(direction, direction)) - (a.hull->capsule + b.hull->capsule) -
         kHullRounding;
}

// Returns the gap between two hulls along a direction from the second to the first: a lower bound of their distance
// [m].
inline double hull_gap(const PosedHull& a, const PosedHull& b, const Point& direction) {
  if (!long_enough(direction)) return -std::numeric_limits<double>::infinity();
  const Point w = a.pose.origin() - b.pose.origin() + (a.support(direction * -1.0) - b.support(direction));
  return dot(direction, w) / std::sqrt(dot(direction, direction)) - (a.hull->radius + b.hull->radius) - kHullRounding;
}

// Returns bounds of the distance between two hulls.
//
// The search begins along the shortest vector between the axes of the capsules around the hulls. The hulls of most
// links are long, so it nearly separates them.
inline ConvexDistance convex_distance(const PosedHull& a, const PosedHull& b, const Limits& limits) {
  const Point direction = between_segments(a.axis(), b.axis());
  const double gap = capsule_gap(a, b, direction);
  if (gap >= limits.wide) return {gap, std::numeric_limits<double>::infinity(), direction};
  const Point offset = a.pose.origin() - b.pose.origin();
  return distance_from_origin([&](const Point& d) { return offset + (a.support(d) - b.support(d * -1.0)); }, direction,
                              a.hull->radius + b.hull->radius, limits);
}

// Returns bounds of the least distance between two hulls whose points move straight from the first to the second pose.
//
// Along a direction that separates the hulls at both ends, the gap is concave in time: it is smallest at an end.
inline ConvexDistance swept_distance(const PosedHull& a0, const PosedHull& a1, const PosedHull& b0, const PosedHull& b1,
                                     const Limits& limits) {
  const auto halfway = [](const Segment& one, const Segment& other) {
    return Segment{(one.from + other.from) * 0.5, (one.to + other.to) * 0.5};
  };
  const Point direction = between_segments(halfway(a0.axis(), a1.axis()), halfway(b0.axis(), b1.axis()));
  const double gap = std::min(capsule_gap(a0, b0, direction), capsule_gap(a1, b1, direction));
  if (gap >= limits.wide) return {gap, std::numeric_limits<double>::infinity(), direction};
  const Point offset0 = a0.pose.origin() - b0.pose.origin(), offset1 = a1.pose.origin() - b1.pose.origin();
  const bool a_stands = a0.pose == a1.pose, b_stands = b0.pose == b1.pose;
  const auto support = [&](const Point& d) {
    const Point back = d * -1.0, of_a = a0.support(d), of_b = b0.support(back);
    const Point first = offset0 + (of_a - of_b);
    const Point second = offset1 + ((a_stands ? of_a : a1.support(d)) - (b_stands ? of_b : b1.support(back)));
    return dot(first, d) >= dot(second, d) ? first : second;
  };
  return distance_from_origin(support, direction, a0.hull->radius + b0.hull->radius, limits);
}

}  // namespace mmp
