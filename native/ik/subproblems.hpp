// Geometric subproblems of inverse kinematics: angles about an axis that bring a vector to where it should be.
//
// Canonical subproblems after Paden and Kahan, in the form of Elias and Wen: IK-Geo: Unified Robot Inverse Kinematics
// Using Subproblem Decomposition (arXiv 2211.05737). Where an equation has no solution, the angle is that of the least
// error: the results are starts of a refinement.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "simd/lanes.hpp"

namespace mmp::ik {

using Vec = Vec3<double>;

struct Rotation {
  std::array<double, 9> rows;

  Vec operator*(const Vec& v) const {
    return {rows[0] * v.x + rows[1] * v.y + rows[2] * v.z, rows[3] * v.x + rows[4] * v.y + rows[5] * v.z,
            rows[6] * v.x + rows[7] * v.y + rows[8] * v.z};
  }
  Vec column(int k) const { return {rows[k], rows[3 + k], rows[6 + k]}; }
  Rotation transposed() const {
    return {{rows[0], rows[3], rows[6], rows[1], rows[4], rows[7], rows[2], rows[5], rows[8]}};
  }
};

inline Vec minus(const Vec& v) { return {-v.x, -v.y, -v.z}; }
inline double length(const Vec& v) { return std::sqrt(dot(v, v)); }

inline Vec rotated(const Vec& axis, double angle, const Vec& v) {
  const Vec along = axis * dot(axis, v);
  return along + (v - along) * std::cos(angle) + cross(axis, v) * std::sin(angle);
}

// Returns the angle [rad] that brings `start` nearest to `end` (subproblem 1).
inline double angle_between(const Vec& axis, const Vec& start, const Vec& end) {
  return std::atan2(dot(axis, cross(start, end)), dot(start, end) - dot(axis, start) * dot(axis, end));
}

// Returns both angles [rad] at which direction . rotated vector = height (subproblem 4).
inline std::array<double, 2> angles_of_height(const Vec& axis, const Vec& v, const Vec& direction, double height) {
  const double along = dot(axis, v) * dot(axis, direction);
  const double cosine = dot(direction, v) - along, sine = dot(direction, cross(axis, v));
  const double size = std::max(std::hypot(cosine, sine), 1e-300);
  const double middle = std::atan2(sine, cosine);
  const double half = std::acos(std::clamp((height - along) / size, -1.0, 1.0));
  return {middle - half, middle + half};
}

// Returns a unit vector perpendicular to a unit vector.
inline Vec perpendicular(const Vec& axis) {
  const double x = std::abs(axis.x), y = std::abs(axis.y), z = std::abs(axis.z);
  const Vec other = x <= y && x <= z ? Vec{1, 0, 0} : y <= z ? Vec{0, 1, 0} : Vec{0, 0, 1};
  const Vec out = cross(axis, other);
  return out * (1 / length(out));
}

// Returns the point nearest to lines through points along unit vectors, which are not all parallel.
inline Vec meeting_point(const Vec* points, const Vec* axes, int count) {
  // The symmetric matrix sum(1 - a a^T): xx, xy, xz, yy, yz, zz.
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  Vec right{0, 0, 0};
  for (int k = 0; k < count; ++k) {
    const Vec& a = axes[k];
    xx += 1 - a.x * a.x, yy += 1 - a.y * a.y, zz += 1 - a.z * a.z;
    xy -= a.x * a.y, xz -= a.x * a.z, yz -= a.y * a.z;
    right = right + (points[k] - a * dot(a, points[k]));
  }
  const Vec first{yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy};
  const Vec second{first.y, xx * zz - xz * xz, xy * xz - xx * yz};
  const Vec third{first.z, second.z, xx * yy - xy * xy};
  const double determinant = xx * first.x + xy * first.y + xz * first.z;
  return Vec{dot(first, right), dot(second, right), dot(third, right)} * (1 / determinant);
}

}  // namespace mmp::ik
