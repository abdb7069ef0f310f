// Convex hulls with fast support functions, and rigid poses.
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

struct Segment {
  Point from, to;
};

// Largest error of a distance of points up to 100 m apart that comes from rounding [m].
inline constexpr double kHullRounding = 1e-12;

// Rigid transform in double precision.
struct RigidPose {
  double r[9]{1, 0, 0, 0, 1, 0, 0, 0, 1}, p[3]{};
  bool operator==(const RigidPose&) const = default;
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
  Segment axis{};       // of a capsule that contains the hull
  double capsule = 0;   // its radius [m]

  ConvexHull(std::vector<Point> vertices, double ball_radius, double disc_radius = 0)
      : radius(ball_radius), disc(disc_radius), vertices_(std::move(vertices)), farthest_(vertices_) {
    const auto middle = [&](auto coordinate) {
      const auto [lo, hi] = std::minmax_element(vertices_.begin(), vertices_.end(), [&](const auto& a, const auto& b) {
        return a.*coordinate < b.*coordinate;
      });
      return (*lo.*coordinate + *hi.*coordinate) / 2;
    };
    center = {middle(&Point::x), middle(&Point::y), middle(&Point::z)};
    bound = farthest_from(center) + kHullRounding;
    enclose_in_capsule();
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
  // Sets `axis` and `capsule`. The axis is parallel to the line between two vertices that are far from each other.
  void enclose_in_capsule() {
    const auto farthest = [&](const Point& from) {
      return *std::max_element(vertices_.begin(), vertices_.end(), [&](const Point& a, const Point& b) {
        return dot(a - from, a - from) < dot(b - from, b - from);
      });
    };
    const Point one = farthest(center), line = farthest(one) - one;
    const double length = std::sqrt(dot(line, line));
    const Point d = length > 0 ? line * (1 / length) : Point{1, 0, 0};
    double low = 0, high = 0, across = 0;
    for (const Point& vertex : vertices_) {
      const Point off = vertex - center;
      const double along = dot(off, d);
      low = std::min(low, along), high = std::max(high, along);
      across = std::max(across, std::sqrt(std::max(0.0, dot(off, off) - along * along)));
    }
    // The round ends reach as far as the hull.
    low = std::min(low + across, 0.0), high = std::max(high - across, 0.0);
    axis = {center + d * low, center + d * high};
    for (const Point& vertex : vertices_) {
      const Point off = vertex - center, from_axis = off - d * std::clamp(dot(off, d), low, high);
      capsule = std::max(capsule, std::sqrt(dot(from_axis, from_axis)));
    }
    capsule += radius + disc + kHullRounding;
  }

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

}  // namespace mmp
