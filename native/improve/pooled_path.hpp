// A path of one arm in the path pool, in as few steps as full speed allows.
#pragma once

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

}  // namespace mmp
