// Which stretch (window) of one arm's motion to replace, and what by: ways between its ends that are shorter in joint
// movement.
//
// The length of a way is the sum over its joints (L1), so every way on which no joint turns back is as short as the
// straight one: there is room for more than straight lines.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "random.hpp"

namespace mmp {

// Joints of one arm and how far each may go in a step of the grid [rad].
template <class T>
struct Pace {
  std::vector<T> max_step;

  int dof() const { return static_cast<int>(max_step.size()); }
  // Whole steps that the straight way takes at full speed.
  int steps(const T* p, const T* q) const {
    T n = 0;
    for (int k = 0; k < dof(); ++k) n = std::max(n, std::abs(q[k] - p[k]) / max_step[k]);
    return static_cast<int>(std::ceil(n - T(1e-4)));
  }
};

template <class T>
double apart(const T* p, const T* q, int dof) {
  double d = 0;
  for (int k = 0; k < dof; ++k) d += std::abs(double(q[k]) - double(p[k]));
  return d;
}

// How the steps of a stretch are spent, in turn: waiting, driving to the via point, waiting there, driving on; the arm
// waits at the end for what is left of `length`.
struct Timing {
  int length, wait, drive, wait_at_via = 0, drive_on = 0;

  // Spends what is left by chance.
  static Timing by_chance(int length, int drive, int drive_on, Random& random) {
    int rest = length - drive - drive_on;
    const auto some = [&] {
      const int n = random.below(rest + 1);
      rest -= n;
      return n;
    };
    Timing t{length, some(), drive, 0, drive_on};
    if (drive_on > 0) t.wait_at_via = some();
    t.drive += some();
    if (drive_on > 0) t.drive_on += some();
    return t;
  }
};

// Rows [length + 1][dof] from p by way of `via` to q; straight to q where `via` is q.
template <class T>
std::vector<T> driven(const T* p, const T* via, const T* q, int dof, const Timing& t) {
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

// A place in the box between p and q, which is no detour, or out of it in one or two joints so that the way by it is
// longer than the straight one by no more than `spare` [rad].
template <class T>
std::vector<T> via_point(const T* p, const T* q, const std::vector<T>& lower, const std::vector<T>& upper, double spare,
                         Random& random) {
  const int dof = static_cast<int>(lower.size());
  std::vector<T> via(dof);
  for (int k = 0; k < dof; ++k) via[k] = p[k] + T(random.uniform()) * (q[k] - p[k]);
  double out = random.uniform() < 0.5 ? 0 : 0.5 * spare * random.uniform();
  for (int n = 0; n < 2 && out > 0; ++n) {
    const int k = random.below(dof);
    const double part = n == 1 ? out : out * random.uniform();
    out -= part;
    const bool up = random.uniform() < 0.5;
    via[k] = up ? std::max(p[k], q[k]) + T(part) : std::min(p[k], q[k]) - T(part);
    via[k] = std::clamp(via[k], lower[k], upper[k]);
  }
  return via;
}

// First and last step of a stretch that is to be replaced; often it begins with the first of all, or ends with the
// last.
inline std::pair<int, int> some_window(int last, Random& random) {
  const double u = random.uniform();
  int i = random.below(last + 1), j = random.below(last + 1);
  if (i > j) std::swap(i, j);
  if (u < 0.3) i = 0;
  if (u < 0.15 || (u >= 0.3 && u < 0.45)) j = last;
  return {i, j};
}

// How a joint goes from the first of its rows to the last without turning back: evenly, or staying as near to where it
// was as that allows, early or late.
enum class Profile { even, early, late };

// Lets joint `joint` of rows [length + 1][dof] go like that, or a `share` of the way from what it was to that. Returns
// by how much it moves less [rad].
template <class T>
double ease(std::vector<T>& rows, int dof, int joint, Profile profile, T share) {
  const int length = static_cast<int>(rows.size()) / dof - 1;
  const auto at = [&](int k) -> T& { return rows[static_cast<size_t>(k) * dof + joint]; };
  const T from = at(0), to = at(length), up = to >= from ? T(1) : T(-1);
  double moved = 0;
  for (int k = 0; k < length; ++k) moved += std::abs(double(at(k + 1)) - double(at(k)));
  const auto change = [&](int k, T eased) { at(k) += share * (eased - at(k)); };
  if (profile == Profile::even) {
    for (int k = 1; k < length; ++k) change(k, from + T(k) / T(length) * (to - from));
  } else if (profile == Profile::early) {  // as far as it ever was
    T reached = up * from;
    for (int k = 1; k < length; ++k) change(k, up * (reached = std::min(up * to, std::max(reached, up * at(k)))));
  } else {  // no farther than it will be again
    T left = up * to;
    for (int k = length - 1; k > 0; --k) change(k, up * (left = std::max(up * from, std::min(left, up * at(k)))));
  }
  return double(share) * (moved - std::abs(double(to) - double(from)));
}

}  // namespace mmp
