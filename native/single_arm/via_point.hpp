// Random via point between two configurations that costs little or no detour in joint movement (L1).
#pragma once

#include <algorithm>
#include <vector>

#include "runtime/random.hpp"

namespace mmp {

// Returns a random configuration in the box between p and q, which costs no detour, or outside it in one or two joints,
// so that the detour is at most `spare` [rad].
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

}  // namespace mmp
