// A path of one arm in the path pool, in as few steps as full speed allows.
#pragma once

#include <limits>

#include "geometry/motion.hpp"
#include "improve/shortcut_moves.hpp"
#include "proof/segments.hpp"

namespace mmp {

// One arm's path in as few steps as full speed allows, without waiting.
template <class V>
struct PooledPath {
  using T = Scalar<V>;

  Motion<V> motion;
  int id;             // path id
  double length = 0;  // [rad]

  // rows: [n][dof]
  PooledPath(const CellModel<T>& cell, int a, const std::vector<T>& rows, const StepLimits<T>& limits, int id)
      : motion(cell, a, merged(rows, limits)), id(id) {
    for (int k = 0; k < motion.last; ++k) length += l1_distance(motion.at(k), motion.at(k + 1), motion.arm->dof);
  }

 private:
  static constexpr T kStraight = T(1e-4);  // [rad]

  // Merges straight rows into one step where full speed allows.
  static std::vector<T> merged(const std::vector<T>& rows, const StepLimits<T>& limits) {
    const int dof = limits.dof(), count = static_cast<int>(rows.size()) / dof;
    const auto row = [&](int k) { return rows.data() + static_cast<size_t>(k) * dof; };
    std::vector<T> out(row(0), row(1));
    int from = 0, to = 0;  // end of the step that may still grow
    const auto close = [&] {
      if (to > from) out.insert(out.end(), row(to), row(to) + dof);
      from = to;
    };
    for (int k = 1; k < count; ++k) {
      if (longest_move<T>({row(to), row(k)}, dof) <= kStraight && k + 1 < count) continue;
      bool straight = limits.steps(row(from), row(k)) <= 1;
      for (int via = from + 1; straight && via < k; ++via) straight = is_between(row(from), row(via), row(k), dof);
      if (to > from && !straight) close();
      to = k;
    }
    close();
    return out;
  }

  static bool is_between(const T* p, const T* via, const T* q, int dof) {
    T whole = 0, part = 0;
    for (int j = 0; j < dof; ++j) {
      whole += (q[j] - p[j]) * (q[j] - p[j]);
      part += (via[j] - p[j]) * (q[j] - p[j]);
    }
    const T f = whole > 0 ? std::clamp(part / whole, T(0), T(1)) : T(0);
    for (int j = 0; j < dof; ++j)
      if (std::abs(p[j] + f * (q[j] - p[j]) - via[j]) > kStraight) return false;
    return true;
  }
};

// A position on a path that advances by arc length (L1) [rad].
template <class V>
class PathCursor {
 public:
  explicit PathCursor(const PooledPath<V>& path) : motion_(&path.motion) { enter(0); }

  // Arc length of the next waypoint, infinite at the end of the path.
  double next() const { return step_ < motion_->last ? begin_ + length_ : std::numeric_limits<double>::infinity(); }

  // `s`: arc length from the current position to `next()`.
  void advance(double s) {
    if (s >= next()) {
      begin_ = next();
      enter(step_ + 1);
    } else if (length_ > 0) {
      share_ = (s - begin_) / length_;
    }
  }

  double joint(int j) const {
    const double q = motion_->at(step_)[j];
    return share_ > 0 ? q + share_ * (motion_->at(step_ + 1)[j] - q) : q;
  }

 private:
  void enter(int step) {
    step_ = step;
    share_ = 0;
    length_ = step < motion_->last ? l1_distance(motion_->at(step), motion_->at(step + 1), motion_->arm->dof) : 0;
  }

  const Motion<V>* motion_;
  int step_ = 0;
  double begin_ = 0, length_ = 0, share_ = 0;
};

// Largest difference of any joint of two paths at equal arc length [rad]. It is at a waypoint of one of them.
template <class V>
double largest_difference(const PooledPath<V>& p, const PooledPath<V>& q) {
  PathCursor<V> a(p), b(q);
  for (double largest = 0;;) {
    for (int j = 0; j < p.motion.arm->dof; ++j) largest = std::max(largest, std::abs(a.joint(j) - b.joint(j)));
    const double s = std::min(a.next(), b.next());
    if (s == std::numeric_limits<double>::infinity()) return largest;
    a.advance(s);
    b.advance(s);
  }
}

}  // namespace mmp
