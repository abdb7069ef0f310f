// Tree of joint configurations of all arms, with nearest-neighbour search.
#pragma once

#include <deque>
#include <limits>
#include <vector>

#include "simd/lanes.hpp"

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

  int add(const std::vector<T>& q, int parent) {
    const int k = size();
    rows_.push_back(q);
    parent_.push_back(parent);
    if (k % kBlock == 0) blocks_.resize(blocks_.size() + static_cast<size_t>(kBlock) * dof_, kFarAway);
    for (int j = 0; j < dof_; ++j) blocks_[at(k, j)] = q[j];
    return k;
  }

  // Returns the nearest node in L2, the first of equally near ones.
  int nearest(const std::vector<T>& q) const {
    V least = splat<V>(std::numeric_limits<T>::max());
    V which{}, number;
    for (int lane = 0; lane < width<V>; ++lane) number[lane] = T(lane);
    for (int first = 0; first < size(); first += width<V>) {
      const T* p = blocks_.data() + at(first, 0);
      V d2{};
      for (int j = 0; j < dof_; ++j, p += kBlock) {
        const V d = load<V>(p) - q[j];
        d2 += d * d;
      }
      const Mask<V> nearer = d2 < least;
      least = select<V>(nearer, d2, least);
      which = select<V>(nearer, number, which);
      number += T(width<V>);
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
  static constexpr int kBlock = 16;
  static constexpr T kFarAway = T(1e6);
  size_t at(int k, int j) const {
    return (static_cast<size_t>(k / kBlock) * dof_ + j) * kBlock + static_cast<size_t>(k % kBlock);
  }

  int dof_;
  std::deque<std::vector<T>> rows_;  // addresses stay valid
  std::vector<int> parent_;
  std::vector<T> blocks_;
};

}  // namespace mmp
