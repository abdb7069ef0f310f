// Distance between two convex hulls: the GJK algorithm (Gilbert, Johnson, Keerthi 1988) with a certified lower bound.
//
// For every direction, the gap between the two hulls' projections is a lower bound of their distance. The bound
// therefore holds whether the iteration has converged or not, and rounding costs at most kRounding.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace mmp {

struct Point {
  double x, y, z;
};
inline Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Point operator*(const Point& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

namespace gjk {
inline constexpr double kRounding = 1e-12;  // [m]
inline constexpr double kConverged = 1e-9;  // [m]
inline constexpr int kMaxIterations = 64;
}  // namespace gjk

// Rigid transform in double precision.
struct RigidPose {
  double r[9]{1, 0, 0, 0, 1, 0, 0, 0, 1}, p[3]{};
  Point origin() const { return {p[0], p[1], p[2]}; }
  Point apply(const Point& v) const { return origin() + turn(v); }
  Point turn(const Point& v) const {
    return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
            r[6] * v.x + r[7] * v.y + r[8] * v.z};
  }
  Point turn_back(const Point& v) const {  // rotates a world direction into the body's frame
    return {r[0] * v.x + r[3] * v.y + r[6] * v.z, r[1] * v.x + r[4] * v.y + r[7] * v.z,
            r[2] * v.x + r[5] * v.y + r[8] * v.z};
  }
};

// Vertices that can be farthest along a direction, by the direction's cell in a cube map.
//
// A vertex is left out of a cell when another one is farther along every direction of the cell.
class FarthestVertices {
 public:
  explicit FarthestVertices(const std::vector<Point>& vertices) {
    if (vertices.size() <= kFew) return;
    first_.reserve(kCells + 1);
    for (int cell = 0; cell < kCells; ++cell) {
      first_.push_back(static_cast<uint32_t>(numbers_.size()));
      add(vertices, cell);
    }
    first_.push_back(static_cast<uint32_t>(numbers_.size()));
  }

  // Returns unit vectors in all directions, about 0.2 rad apart.
  static std::vector<Point> directions() {
    std::vector<Point> out;
    for (int cell = 0; cell < kCells; ++cell) out.push_back(direction(cell, 0.5, 0.5));
    return out;
  }

  // Returns the number of the farthest vertex, the first one of several.
  size_t operator()(const std::vector<Point>& vertices, const Point& d) const {
    double best = -std::numeric_limits<double>::infinity();
    size_t at = 0;
    const auto look = [&](size_t k) {
      const double along = dot(vertices[k], d);
      at = along > best ? k : at;
      best = along > best ? along : best;
    };
    if (first_.empty()) {
      for (size_t k = 0; k < vertices.size(); ++k) look(k);
    } else {
      const int cell = cell_of(d);
      for (uint32_t k = first_[cell]; k < first_[cell + 1]; ++k) look(numbers_[k]);
    }
    return at;
  }

 private:
  static constexpr size_t kFew = 8;  // vertices that need no map
  static constexpr int kEdge = 8, kCells = 6 * kEdge * kEdge;
  static constexpr double kRounding = 1e-9;  // of unit vectors and of their products with vertices [m]

  static int cell_of(const Point& d) {
    const double x = std::abs(d.x), y = std::abs(d.y), z = std::abs(d.z);
    int face;
    double u, v, major;
    if (x >= y && x >= z) face = d.x < 0, major = x, u = d.y, v = d.z;
    else if (y >= z) face = 2 + (d.y < 0), major = y, u = d.z, v = d.x;
    else face = 4 + (d.z < 0), major = z, u = d.x, v = d.y;
    const double scale = kEdge / 2.0 / major;
    const auto row = [&](double w) {
      return static_cast<int>(std::min(std::max(0.0, w * scale + kEdge / 2.0), kEdge - 1.0));
    };
    return (face * kEdge + row(u)) * kEdge + row(v);
  }

  // Returns the unit vector at a place [0, 1]^2 of a cell.
  static Point direction(int cell, double across, double along) {
    const int face = cell / (kEdge * kEdge);
    const double u = (cell / kEdge % kEdge + across) * 2 / kEdge - 1, v = (cell % kEdge + along) * 2 / kEdge - 1;
    const double major = face % 2 ? -1 : 1;
    const Point d = face < 2 ? Point{major, u, v} : face < 4 ? Point{v, major, u} : Point{u, v, major};
    return d * (1 / std::sqrt(dot(d, d)));
  }

  void add(const std::vector<Point>& vertices, int cell) {
    const Point middle = direction(cell, 0.5, 0.5);
    std::array<Point, 5> far;
    double width = 0;
    for (int k = 0; k < 5; ++k) {
      const Point d = k == 0 ? middle : direction(cell, k % 2, (k - 1) / 2), off = d - middle;
      width = std::max(width, std::sqrt(dot(off, off)) + kRounding);
      far[k] = *std::max_element(vertices.begin(), vertices.end(),
                                 [&](const Point& a, const Point& b) { return dot(a, d) < dot(b, d); });
    }
    for (size_t v = 0; v < vertices.size(); ++v)
      if (std::none_of(far.begin(), far.end(), [&](const Point& other) {
            const Point ahead = other - vertices[v];
            const double gain = dot(ahead, middle) - kRounding;
            return gain > 0 && gain * gain > dot(ahead, ahead) * (width * width);
          }))
        numbers_.push_back(static_cast<uint16_t>(v));
  }

  std::vector<uint32_t> first_;    // [cell]; empty: all vertices are looked at
  std::vector<uint16_t> numbers_;  // of the vertices of all cells
};

// Convex hull of vertices, grown by a ball and by a disc in the xy plane. A sphere is one vertex grown by a ball, a
// capsule two; a cylinder is two vertices on the z axis grown by a disc.
class ConvexHull {
 public:
  double radius, disc;  // of the ball and of the disc [m]
  Point center{};       // of a ball that contains the hull
  double bound = 0;     // its radius [m]

  ConvexHull(std::vector<Point> vertices, double ball_radius, double disc_radius = 0)
      : radius(ball_radius), disc(disc_radius), vertices_(std::move(vertices)), farthest_(vertices_) {
    const auto middle = [&](auto coordinate) {
      const auto [lo, hi] = std::minmax_element(vertices_.begin(), vertices_.end(), [&](const auto& a, const auto& b) {
        return a.*coordinate < b.*coordinate;
      });
      return (*lo.*coordinate + *hi.*coordinate) / 2;
    };
    center = {middle(&Point::x), middle(&Point::y), middle(&Point::z)};
    bound = farthest_from(center) + gjk::kRounding;
  }

  // Returns whether these vertices and this ball give the same hull.
  bool is_of(const std::vector<Point>& vertices, double ball_radius) const {
    const auto same = [](const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; };
    return radius == ball_radius && disc == 0 &&
           std::equal(vertices_.begin(), vertices_.end(), vertices.begin(), vertices.end(), same);
  }

  // Returns the largest distance of a point of the hull from another point [m].
  double farthest_from(const Point& point) const {
    double farthest = 0;
    for (const Point& vertex : vertices_) {
      const Point off = vertex - point;
      farthest = std::max(farthest, std::sqrt(dot(off, off)));
    }
    return farthest + radius + disc;
  }

  // Returns the point of the hull, without its ball, that is farthest along a direction in the hull's frame.
  Point support(const Point& d) const {
    Point out = vertices_[farthest_(vertices_, d)];
    if (disc > 0) {
      const double across = std::sqrt(d.x * d.x + d.y * d.y);
      if (across > 0) out = out + Point{d.x, d.y, 0} * (disc / across);
    }
    return out;
  }

 private:
  std::vector<Point> vertices_;
  FarthestVertices farthest_;
};

// Ball or capsule on the z axis.
struct AxisCapsule {
  double low, high, radius;  // of the centres of its ends [m]
};

// Returns about the largest capsule on the z axis that lies in a hull. It may stick out by a few millimetres.
inline std::optional<AxisCapsule> capsule_inside(const ConvexHull& hull) {
  constexpr int kHeights = 32;
  constexpr double kLeastRadius = 0.01;
  std::array<double, kHeights> height, depth;
  for (int k = 0; k < kHeights; ++k)
    height[k] = hull.center.z + hull.bound * (2.0 * k / (kHeights - 1) - 1), depth[k] = hull.bound;
  for (const Point& d : FarthestVertices::directions()) {
    const double far = dot(hull.support(d), d) + hull.radius;
    for (int k = 0; k < kHeights; ++k) depth[k] = std::min(depth[k], far - d.z * height[k]);
  }
  std::optional<AxisCapsule> best;
  double largest = 0;
  for (int i = 0; i < kHeights; ++i) {
    double radius = hull.bound;
    for (int j = i; j < kHeights; ++j) {
      radius = std::min(radius, depth[j]);
      if (radius < kLeastRadius) break;
      const double volume = radius * radius * (height[j] - height[i] + radius * (4.0 / 3));
      if (volume > largest) largest = volume, best = {height[i], height[j], radius};
    }
  }
  return best;
}

struct PosedHull {
  const ConvexHull* hull;
  RigidPose pose;

  Point center() const { return pose.apply(hull->center); }
  // Returns the farthest point along a direction, relative to the origin of the hull's frame.
  Point support(const Point& d) const { return pose.turn(hull->support(pose.turn_back(d))); }
};

struct ConvexDistance {
  double lower;  // certified [m]; minus infinity for hulls that overlap
  double upper;  // of two points that were found [m]
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
  Point closest = dot(direction, direction) > 0 ? direction : Point{1, 0, 0};
  for (int k = 0; k < gjk::kMaxIterations; ++k) {
    const double length = std::sqrt(dot(closest, closest));
    if (!(length > gjk::kConverged)) return {kNone, 0};
    const Point w = support(closest * -1.0);
    out.lower = std::max(out.lower, dot(closest, w) / length - gjk::kRounding - radii);
    if (k > 0) out.upper = std::min(out.upper, length - radii);
    if (limits.answered(out) || out.upper - out.lower < gjk::kConverged || simplex.has(w)) return out;
    Point next = closest;
    if (!simplex.add(w, next)) return {kNone, 0};
    if (k > 0 && dot(next, next) >= length * length) return out;  // rounding ends the progress
    closest = next;
  }
  return out;
}

// Returns bounds of the distance between two hulls.
inline ConvexDistance convex_distance(const PosedHull& a, const PosedHull& b, const Limits& limits) {
  const Point offset = a.pose.origin() - b.pose.origin();
  return distance_from_origin([&](const Point& d) { return offset + (a.support(d) - b.support(d * -1.0)); },
                              a.center() - b.center(), a.hull->radius + b.hull->radius, limits);
}

// Returns bounds of the least distance between two hulls whose points move straight from the first to the second pose.
//
// Along a direction that separates the hulls at both ends, the gap is concave in time: it is smallest at an end.
inline ConvexDistance swept_distance(const PosedHull& a0, const PosedHull& a1, const PosedHull& b0, const PosedHull& b1,
                                     const Limits& limits) {
  const Point offset0 = a0.pose.origin() - b0.pose.origin(), offset1 = a1.pose.origin() - b1.pose.origin();
  const auto support = [&](const Point& d) {
    const Point back = d * -1.0;
    const Point first = offset0 + (a0.support(d) - b0.support(back));
    const Point second = offset1 + (a1.support(d) - b1.support(back));
    return dot(first, d) >= dot(second, d) ? first : second;
  };
  return distance_from_origin(support, a0.center() - b0.center(), a0.hull->radius + b0.hull->radius, limits);
}

}  // namespace mmp
