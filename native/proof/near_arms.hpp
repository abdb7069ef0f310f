// Pairs of arms that come close, from boxes around the arms.
#pragma once

#include <algorithm>
#include <vector>

#include "geometry/box.hpp"
#include "proof/segments.hpp"

namespace mmp {

// Arms whose boxes are farther apart than a gap and this are farther apart than the gap, with rounding errors [m].
template <class T>
inline constexpr T kBoxSlack = T(1e-3);

// Calls `include(lane, axis, low, high)` for the bounds of all moving links, grown by `reach(link)`.
template <class V, class Reach, class Include>
void visit_bounds(const Pose<V>& pose, int lanes, const Reach& reach, const Include& include) {
  for (int l = 1; l < static_cast<int>(pose.arm->links.size()); ++l) {
    const V r = reach(l) + pose.arm->links[l].bound.r;
    const V* center[3] = {&pose.link[l].x, &pose.link[l].y, &pose.link[l].z};
    for (int k = 0; k < 3; ++k) {
      const V low = *center[k] - r, high = *center[k] + r;
      for (int lane = 0; lane < lanes; ++lane) include(lane, k, low[lane], high[lane]);
    }
  }
}

// Finds the pairs of boxes that are no farther apart than a gap, by a sweep along the axis on which they spread most.
template <class T>
class BoxSweep {
 public:
  template <class Visit>  // Visit(a, b) with a < b, in any order
  void operator()(const Box<T>* boxes, int count, T gap, const Visit& visit) {
    const int axis = widest_axis(boxes, count);
    order_.resize(count);
    for (int k = 0; k < count; ++k) order_[k] = k;
    std::sort(order_.begin(), order_.end(), [&](int a, int b) { return boxes[a].lo[axis] < boxes[b].lo[axis]; });
    for (int i = 0; i < count; ++i) {
      const Box<T>& box = boxes[order_[i]];
      for (int k = i + 1; k < count && boxes[order_[k]].lo[axis] <= box.hi[axis] + gap; ++k)
        if (box.near(boxes[order_[k]], gap)) visit(std::min(order_[i], order_[k]), std::max(order_[i], order_[k]));
    }
  }

 private:
  static int widest_axis(const Box<T>* boxes, int count) {
    Box<T> lows;
    for (int a = 0; a < count; ++a)
      for (int k = 0; k < 3; ++k) lows.include(k, boxes[a].lo[k], boxes[a].lo[k]);
    int out = 0;
    for (int k = 1; k < 3; ++k)
      if (lows.hi[k] - lows.lo[k] > lows.hi[out] - lows.lo[out]) out = k;
    return out;
  }

  std::vector<int> order_;
};

// The segments in which each pair of arms comes close.
//
// The segments are divided into intervals of equal length. A box holds all moving links of an arm during an interval.
template <class V>
class NearArms {
 public:
  using T = Scalar<V>;

  // `at(a)(s)` returns the ends of segment s of arm a, which begins where the one before ends. Stops when the clock has
  // expired; then the boxes are not complete.
  template <class At>
  NearArms(const std::vector<const ArmModel<T>*>& arms, int segments, const At& at, const Clock& clock)
      : arms_(static_cast<int>(arms.size())),
        segments_(segments),
        length_(std::max(1, (segments + kMostIntervals - 1) / kMostIntervals)),
        boxes_(static_cast<size_t>(intervals()) * arms_) {
    std::vector<Piece<T>> pieces;
    PieceBatch<V> batch;
    Sweep<V> sweep;
    for (int a = 0; a < arms_ && !clock.expired(); ++a) {
      const int dof = arms[a]->dof;
      Pose<V> pose(*arms[a]);
      pieces.clear();
      const auto of_arm = at(a);
      const auto stands = [&](int s) {
        const auto [from, to] = of_arm(s);
        return std::equal(from, from + dof, to);
      };
      // Where an arm stands, it is in the box of the segment before.
      split(pieces, segments, dof, of_arm, [&](int s) { return s % length_ == 0 || !stands(s); });
      for (size_t k = 0; k < pieces.size(); k += width<V>) {
        const int count = static_cast<int>(std::min<size_t>(width<V>, pieces.size() - k));
        batch.set(&pieces[k], count, dof, of_arm);
        forward(batch.middle, pose);
        sweep.set(pose, batch.middle, batch.half);
        visit_bounds<V>(
            pose, count, [&](int l) { return sweep.reach(pose, l); },
            [&](int lane, int axis, T low, T high) {
              boxes_[static_cast<size_t>(pieces[k + lane].segment / length_) * arms_ + a].include(axis, low, high);
            });
      }
    }
  }

  // Finds the segments in which arms may be as close as `gap`.
  void find(T gap) {
    near_.assign(arms_, {});
    for (int i = 0; i < intervals(); ++i)
      sweep_(&boxes_[static_cast<size_t>(i) * arms_], arms_, gap + kBoxSlack<T>,
             [&](int a, int b) { near_[a].push_back({b, i}); });
    for (auto& others : near_) std::sort(others.begin(), others.end());
  }

  // Calls `visit(b, segments)` for the arms b > a that come close to arm a, in ascending order, until it returns false.
  // Returns whether it never did.
  template <class Visit>
  bool others(int a, const Visit& visit) const {
    std::vector<int> segments;
    const auto& near = near_[a];
    for (size_t k = 0; k < near.size();) {
      const int b = near[k].first;
      segments.clear();
      for (; k < near.size() && near[k].first == b; ++k) {
        const int first = near[k].second * length_, last = std::min(first + length_, segments_);
        for (int s = first; s < last; ++s) segments.push_back(s);
      }
      if (!visit(b, segments)) return false;
    }
    return true;
  }

 private:
  static constexpr int kMostIntervals = 128;  // more take longer to sweep than they save

  int intervals() const { return (segments_ + length_ - 1) / length_; }

  int arms_, segments_, length_;
  std::vector<Box<T>> boxes_;                           // [interval][arm]
  std::vector<std::vector<std::pair<int, int>>> near_;  // per arm: another arm behind it, and an interval
  BoxSweep<T> sweep_;
};

}  // namespace mmp
