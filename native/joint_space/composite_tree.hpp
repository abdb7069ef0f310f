// Tree of joint configurations of all arms, with nearest-neighbour search.
#pragma once

#include <algorithm>
#include <deque>
#include <limits>
#include <vector>

#include "joint_space/composite_steps.hpp"

namespace mmp {

// Nodes of one tree. Rows for the nearest-neighbour search are stored in blocks, one node per lane: sums over joints
// have the same order, and so the same bits, for every width.
template <class V>
class CompositeTree {
 public:
  using T = Scalar<V>;
  explicit CompositeTree(int dof) : dof_(dof) {}

  int size() const { return static_cast<int>(parent_.size()); }
  int parent(int k) const { return parent_[k]; }
  const T* q(int k) const { return rows_[k].data(); }

  // Slots of the edge to the parent.
  const Slots& slots(int k) const { return slots_[k]; }

  int add(const std::vector<T>& q, int parent, Slots slots = {}) {
    const int k = size();
    slots_.push_back(std::move(slots));
    rows_.push_back(q);
    parent_.push_back(parent);
    if (k % kBlock == 0) blocks_.resize(blocks_.size() + static_cast<size_t>(kBlock) * dof_, kFarAway);
    for (int j = 0; j < dof_; ++j) blocks_[at(k, j)] = q[j];
    return k;
  }

  // Returns the nearest node in L2, the first of equally near ones.
  int nearest(const std::vector<T>& q) const {
    V least = splat<V>(std::numeric_limits<T>::max());
    V which{}, numbers{};
    for (int lane = 0; lane < width<V>; ++lane) numbers[lane] = T(lane);
    for (int first = 0; first < size(); first += kBlock) {
      V d2[kBlock / width<V>]{};
      const T* p = blocks_.data() + at(first, 0);
      bool nearer = true;  // whether a node of the block may be nearer; sums never fall
      for (int j = 0; nearer && j < dof_;) {
        for (const int end = std::min(j + kJointsAtOnce, dof_); j < end; ++j, p += kBlock)
          for (int k = 0; k < kBlock / width<V>; ++k) {
            const V d = load<V>(p + k * width<V>) - q[j];
            d2[k] += d * d;
          }
        Mask<V> any = d2[0] < least;
        for (int k = 1; k < kBlock / width<V>; ++k) any |= d2[k] < least;
        nearer = bits<V>(any) != 0;
      }
      for (int k = 0; nearer && k < kBlock / width<V>; ++k) {
        const Mask<V> closer = d2[k] < least;
        least = select<V>(closer, d2[k], least);
        which = select<V>(closer, numbers + T(first + k * width<V>), which);
      }
    }
    int best = 0;
    for (int lane = 1; lane < width<V>; ++lane)
      if (least[lane] < least[best] || (least[lane] == least[best] && which[lane] < which[best])) best = lane;
    return static_cast<int>(which[best]);
  }

  // Removes node k and its descendants from the nearest-neighbour search.
  void remove_subtree(int k) {
    std::vector<bool> down(size());
    for (int n = k; n < size(); ++n) {
      down[n] = n == k || (parent_[n] >= 0 && down[parent_[n]]);
      if (down[n])
        for (int j = 0; j < dof_; ++j) blocks_[at(n, j)] = kFarAway;
    }
  }

 private:
  static constexpr int kBlock = 32;        // nodes that are compared side by side
  static constexpr int kJointsAtOnce = 8;  // summed before the distances are compared
  static constexpr T kFarAway = T(1e6);
  size_t at(int k, int j) const {
    return (static_cast<size_t>(k / kBlock) * dof_ + j) * kBlock + static_cast<size_t>(k % kBlock);
  }

  int dof_;
  std::deque<std::vector<T>> rows_;  // addresses stay valid
  std::vector<int> parent_;
  std::vector<Slots> slots_;
  std::vector<T> blocks_;
};

}  // namespace mmp
