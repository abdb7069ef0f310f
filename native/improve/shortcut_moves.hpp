// Shortcut candidates: which window of one arm's motion to replace, and by what.
//
// Length is summed over joints (L1). So every path on which no joint turns back is as short as the straight line, and
// there are more candidates than straight lines.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "single_arm/via_point.hpp"

namespace mmp {

// Largest move of each joint in one step of the grid [rad].
template <class T>
struct StepLimits {
  std::vector<T> max_step;

  int dof() const { return static_cast<int>(max_step.size()); }
  // Returns the number of steps of the straight line at full speed.
  int steps(const T* p, const T* q) const {
    T n = 0;
    for (int k = 0; k < dof(); ++k) n = std::max(n, std::abs(q[k] - p[k]) / max_step[k]);
    return static_cast<int>(std::min(std::ceil(n - T(1e-4)), T(kForever)));
  }
};

template <class T>
double l1_distance(const T* p, const T* q, int dof) {
  double d = 0;
  for (int k = 0; k < dof; ++k) d += std::abs(double(q[k]) - double(p[k]));
  return d;
}

// Schedule of a window: wait, drive to the via point, wait there, drive on, and wait for the rest of `length`.
struct DriveTiming {
  int length, wait, drive, wait_at_via = 0, drive_on = 0;

  // Distributes the remaining steps at random.
  static DriveTiming by_chance(int length, int drive, int drive_on, Random& random) {
    int rest = length - drive - drive_on;
    const auto some = [&] {
      const int n = random.below(rest + 1);
      rest -= n;
      return n;
    };
    DriveTiming t{length, some(), drive, 0, drive_on};
    if (drive_on > 0) t.wait_at_via = some();
    t.drive += some();
    if (drive_on > 0) t.drive_on += some();
    return t;
  }
};

// Returns rows [length + 1][dof] from p through `via` to q; a straight line where `via` is q.
template <class T>
std::vector<T> drive_rows(const T* p, const T* via, const T* q, int dof, const DriveTiming& t) {
  std::vector<T> rows(static_cast<size_t>(t.length + 1) * dof);
  const auto done = [](int steps, int of) { return std::clamp(T(steps) / T(std::max(of, 1)), T(0), T(1)); };
  for (int k = 0; k <= t.length; ++k) {
    const bool second = k > t.wait + t.drive;
    const T f = second ? done(k - t.wait - t.drive - t.wait_at_via, t.drive_on) : done(k - t.wait, t.drive);
    const T *from = second ? via : p, *to = second ? q : via;
    T* row = rows.data() + static_cast<size_t>(k) * dof;
    for (int n = 0; n < dof; ++n) row[n] = k == t.length ? q[n] : f < T(1) ? from[n] + f * (to[n] - from[n]) : to[n];
  }
  return rows;
}

// Draws the first and last step of a window. Windows at the start or end of the motion are more likely.
inline std::pair<int, int> random_window(int last, Random& random) {
  const double u = random.uniform();
  int i = random.below(last + 1), j = random.below(last + 1);
  if (i > j) std::swap(i, j);
  if (u < 0.3) i = 0;
  if (u < 0.15 || (u >= 0.3 && u < 0.45)) j = last;
  return {i, j};
}

// Monotone profiles of a joint from its first row to its last: even, or as close to the old values as possible, early
// or late.
enum class Profile { even, early, late };

// Changes joint `joint` of rows [length + 1][dof] by a `share` of the difference to the monotone profile. Returns the
// saved movement [rad].
template <class T>
double remove_backtracking(std::vector<T>& rows, int dof, int joint, Profile profile, T share) {
  const int length = static_cast<int>(rows.size()) / dof - 1;
  const auto at = [&](int k) -> T& { return rows[static_cast<size_t>(k) * dof + joint]; };
  const T from = at(0), to = at(length), up = to >= from ? T(1) : T(-1);
  double moved = 0;
  for (int k = 0; k < length; ++k) moved += std::abs(double(at(k + 1)) - double(at(k)));
  const auto change = [&](int k, T smooth) { at(k) += share * (smooth - at(k)); };
  if (profile == Profile::even) {
    for (int k = 1; k < length; ++k) change(k, from + T(k) / T(length) * (to - from));
  } else if (profile == Profile::early) {  // running maximum
    T reached = up * from;
    for (int k = 1; k < length; ++k) change(k, up * (reached = std::min(up * to, std::max(reached, up * at(k)))));
  } else {  // running minimum from the end
    T left = up * to;
    for (int k = length - 1; k > 0; --k) change(k, up * (left = std::max(up * from, std::min(left, up * at(k)))));
  }
  return double(share) * (moved - std::abs(double(to) - double(from)));
}

}  // namespace mmp
