// Short window of one arm's motion. Geometry is computed only where a test needs it, since most candidates fail.
#pragma once

#include "geometry/motion.hpp"

namespace mmp {

template <class V>
class MotionWindow : public Motion<V> {
 public:
  using T = Scalar<V>;
  static constexpr int kMaxSteps = width<V> - 1;  // one row per lane

  MotionWindow(const CellModel<T>& cell, int a)
      : Motion<V>(cell, a, std::vector<T>(static_cast<size_t>(width<V>) * cell.arms[a].dof), false),
        pose_(cell.arms[a]) {
    this->groups.resize(this->arm->groups.size() * 3 * this->stride);
    this->spheres.resize(this->arm->spheres.size() * 3 * this->stride);
  }

  // Replaces the motion by these rows, [steps + 1][dof].
  void set(const T* rows, int steps) {
    this->last = steps;
    this->q.assign(rows, rows + static_cast<size_t>(steps + 1) * this->arm->dof);
    this->fill(0, pose_);
    this->enclose(0);
    detailed_ = 0;
  }

  // Computes groups and spheres of a link.
  void need(int l) {
    if (detailed_ >> l & 1u) return;
    detailed_ |= 1u << l;
    this->put_link(l, pose_, 0);
  }
  void need_all() {
    for (size_t l = 0; l < this->arm->links.size(); ++l) need(static_cast<int>(l));
  }

 private:
  Pose<V> pose_;
  uint32_t detailed_ = 0;
};

// Calls `each` with the number, first step and step count of each piece until one call returns false. Starts in the
// middle, where most candidates fail.
template <class V, class Each>
bool all_windows(int length, Each&& each) {
  const int most = MotionWindow<V>::kMaxSteps, count = (length + most - 1) / most;
  for (int n = 0; n < count; ++n) {
    const int from = (count / 2 + (n % 2 == 0 ? n / 2 : -(n + 1) / 2)) * most;
    if (!each(n, from, std::min(most, length - from))) return false;
  }
  return true;
}

}  // namespace mmp
