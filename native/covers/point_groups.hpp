// Which balls are near which points, found by halving the points: a group of points needs few of many balls.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "simd/lanes.hpp"

namespace mmp::covers {

// Points [n, 3] and balls: centers [s, 3] and radii [s], all in metres.
struct PointsAndBalls {
  const double* points;
  size_t n;
  const double* centers;
  const double* radii;
  size_t s;
};

using Numbers = std::vector<int32_t>;

namespace detail {

inline constexpr size_t kFewPoints = 64;
inline constexpr size_t kSmall = 1 << 12;  // pairs of a point and a ball up to which a group is not halved
inline constexpr double kRounding = 1e-9;  // [m]

inline double length(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

// Coordinates of some points, one in each lane; the last point fills the lanes that are left.
struct Coordinates {
  Doubles x, y, z;
  Coordinates(const PointsAndBalls& all, const int32_t* rows, size_t count) {
    for (size_t k = 0; k < static_cast<size_t>(width<Doubles>); ++k) {
      const double* p = all.points + 3 * static_cast<size_t>(rows[std::min(k, count - 1)]);
      x[k] = p[0], y[k] = p[1], z[k] = p[2];
    }
  }
  Doubles distance(const double* center) const {
    const Doubles dx = x - center[0], dy = y - center[1], dz = z - center[2];
    return sqrt(dx * dx + dy * dy + dz * dz);
  }
};

// Calls visit(rows, count, balls) for groups of points near each other, with all balls no farther from the middle of a
// group than limit(distance of the nearest ball, reach of the group) says, in ascending order.
template <class Limit, class Visit>
void halve(const PointsAndBalls& all, int32_t* rows, size_t count, const Numbers& balls, const Limit& limit,
           const Visit& visit) {
  double low[3], high[3], middle[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = std::numeric_limits<double>::infinity(), high[axis] = -low[axis];
    for (size_t k = 0; k < count; ++k) {
      const double x = all.points[3 * static_cast<size_t>(rows[k]) + axis];
      low[axis] = std::min(low[axis], x), high[axis] = std::max(high[axis], x);
    }
    middle[axis] = (low[axis] + high[axis]) / 2;
  }
  const double reach = length(high[0] - low[0], high[1] - low[1], high[2] - low[2]) / 2 + kRounding;
  std::vector<double> away;
  away.reserve(balls.size());
  double least = std::numeric_limits<double>::infinity();
  for (const int32_t ball : balls) {
    const double* c = all.centers + 3 * static_cast<size_t>(ball);
    away.push_back(length(middle[0] - c[0], middle[1] - c[1], middle[2] - c[2]) - all.radii[ball]);
    least = std::min(least, away.back());
  }
  const double most = limit(least, reach);
  Numbers near;
  for (size_t k = 0; k < balls.size(); ++k)
    if (away[k] <= most) near.push_back(balls[k]);
  if (count <= kFewPoints || count * near.size() <= kSmall) {
    visit(rows, count, near);
    return;
  }
  int axis = 0;
  for (int other = 1; other < 3; ++other)
    if (high[other] - low[other] > high[axis] - low[axis]) axis = other;
  const size_t half = count / 2;
  std::nth_element(rows, rows + half, rows + count, [&](int32_t a, int32_t b) {
    return all.points[3 * static_cast<size_t>(a) + axis] < all.points[3 * static_cast<size_t>(b) + axis];
  });
  halve(all, rows, half, near, limit, visit);
  halve(all, rows + half, count - half, near, limit, visit);
}

template <class Limit, class Visit>
void each_group(const PointsAndBalls& all, const Limit& limit, const Visit& visit) {
  if (all.n == 0 || all.s == 0) return;
  Numbers rows(all.n), balls(all.s);
  std::iota(rows.begin(), rows.end(), 0);
  std::iota(balls.begin(), balls.end(), 0);
  halve(all, rows.data(), rows.size(), balls, limit, visit);
}

}  // namespace detail

// Writes the ball in which each point lies deepest, the first of several, and how far [m] the point is outside it.
inline void deepest_balls(const PointsAndBalls& all, int32_t* ball, double* outside) {
  // The distance to a ball changes at most as much as the point moves.
  const auto limit = [](double least, double reach) { return least + 2 * reach; };
  detail::each_group(all, limit, [&](const int32_t* rows, size_t count, const Numbers& balls) {
    for (size_t k = 0; k < count; k += width<Doubles>) {
      const size_t lanes = std::min<size_t>(width<Doubles>, count - k);
      const detail::Coordinates own(all, rows + k, lanes);
      Doubles best = splat<Doubles>(std::numeric_limits<double>::infinity()), which{};
      for (const int32_t b : balls) {
        const Doubles away = own.distance(all.centers + 3 * static_cast<size_t>(b)) - all.radii[b];
        const auto nearer = away < best;
        best = select<Doubles>(nearer, away, best);
        which = select<Doubles>(nearer, splat<Doubles>(b), which);
      }
      for (size_t lane = 0; lane < lanes; ++lane) {
        ball[rows[k + lane]] = static_cast<int32_t>(which[lane]);
        outside[rows[k + lane]] = best[lane];
      }
    }
  });
}

// Returns which points lie at least `depth` [n] [m] deep in which balls: numbers of both, in ascending order.
inline std::pair<Numbers, Numbers> points_in_balls(const PointsAndBalls& all, const double* depth) {
  double least_depth = 0;
  for (size_t k = 0; k < all.n; ++k) least_depth = std::min(least_depth, depth[k]);
  const auto limit = [=](double, double reach) { return reach - least_depth; };
  std::vector<std::pair<int32_t, int32_t>> found;
  std::vector<size_t> begin(all.n + 1, 0);
  detail::each_group(all, limit, [&](const int32_t* rows, size_t count, const Numbers& balls) {
    for (size_t k = 0; k < count; k += width<Doubles>) {
      const size_t lanes = std::min<size_t>(width<Doubles>, count - k);
      const detail::Coordinates own(all, rows + k, lanes);
      Doubles deep{};
      for (size_t lane = 0; lane < lanes; ++lane) deep[lane] = depth[rows[k + lane]];
      for (const int32_t b : balls) {
        const auto inside = own.distance(all.centers + 3 * static_cast<size_t>(b)) + deep <= all.radii[b];
        if (const unsigned set = bits<Doubles>(inside))
          for (size_t lane = 0; lane < lanes; ++lane)
            if (set >> lane & 1) {
              found.emplace_back(rows[k + lane], b);
              ++begin[static_cast<size_t>(rows[k + lane]) + 1];
            }
      }
    }
  });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::pair<Numbers, Numbers> out{Numbers(found.size()), Numbers(found.size())};
  for (const auto& [row, ball] : found) {
    const size_t at = begin[static_cast<size_t>(row)]++;
    out.first[at] = row, out.second[at] = ball;
  }
  return out;
}

// Writes how deep [m] points [n, 3] lie inside half-spaces [p, 4] (n, n.x <= d): the least, and negative outside.
inline void plane_depths(const double* points, size_t n, const double* planes, size_t p, double* depth) {
  for (size_t k = 0; k < n; k += width<Doubles>) {
    const size_t lanes = std::min<size_t>(width<Doubles>, n - k);
    Doubles x{}, y{}, z{}, least = splat<Doubles>(std::numeric_limits<double>::infinity());
    for (size_t lane = 0; lane < lanes; ++lane) {
      const double* own = points + 3 * (k + lane);
      x[lane] = own[0], y[lane] = own[1], z[lane] = own[2];
    }
    for (const double* plane = planes; plane < planes + 4 * p; plane += 4)
      least = min(least, plane[3] - (x * plane[0] + y * plane[1] + z * plane[2]));
    for (size_t lane = 0; lane < lanes; ++lane) depth[k + lane] = least[lane];
  }
}

}  // namespace mmp::covers
