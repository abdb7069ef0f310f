// Dynamic obstacles: moving arms seen by the single-arm planner. A lane is a departure time: an edge that starts at
// consecutive steps is tested against an arm whose centres are stored step by step.
#pragma once

#include <bit>
#include <memory>

#include "geometry/swept_distance.hpp"

namespace mmp {

// Link of the planned arm and link of a moving arm that may come close.
struct NearLinks {
  int obstacle, own, other;
  uint64_t when;  // bit set of blocks of the obstacle's steps
};

// Share of the chord deviation that a search allows for when a proof follows.
template <class T>
inline constexpr T kPartialDeviation = T(0.4);

// Motions that a search must avoid.
//
// Chords of centres between steps are tested at `margin`, and at `proof` plus a share of the deviation of the true
// arcs. The full share proves that a path is clear; with less, some paths fail the later proof.
template <class V>
class DynamicObstacles {
 public:
  using T = Scalar<V>;
  DynamicObstacles() = default;
  DynamicObstacles(std::vector<const Motion<V>*> motions, Levels<T> levels, T share)
      : motions_(std::move(motions)), levels_(levels), share_(share) {
    for (const auto* m : motions_) horizon_ = std::max(horizon_, m->last);
  }

  bool empty() const { return motions_.empty(); }
  // First step from which all obstacles stand still.
  int horizon() const { return horizon_; }

  // Lists the pairs of links whose boxes are ever close. `own` needs no groups or spheres yet.
  void find_near_links(const Motion<V>& own, std::vector<NearLinks>& out) const {
    out.clear();
    for (size_t m = 0; m < motions_.size(); ++m) {
      const auto& other = *motions_[m];
      // The tip first: it touches most often, and a contact in every lane ends the test.
      for (size_t i = own.boxes.size(); i-- > 1;) {
        const T out_of_link =
            own.arm->links[i].bound.r + own.max_deviation[i] + levels_.margin + levels_.proof + kRounding;
        if (!own.boxes[i].near(other.whole, out_of_link)) continue;
        for (size_t j = other.boxes.size(); j-- > 1;)
          if (const uint64_t when = blocks_near(own, i, other, j))
            out.push_back({static_cast<int>(m), static_cast<int>(i), static_cast<int>(j), when});
      }
    }
  }

  // Returns whether two links may be close while the obstacle passes steps k, k + 1, ..., one per lane.
  bool may_be_near(const NearLinks& e, int k) const {
    const auto& o = *motions_[e.obstacle];
    const int lo = o.block_of(k), hi = o.block_of(k + width<V>);
    return e.when >> lo & ((2ull << (hi - lo)) - 1);
  }

  // Returns the lanes of `asked` that touch: own links between steps s and s + 1, the obstacle between steps k and k +
  // 1, k + 1 and k + 2, ...
  unsigned touching(const NearLinks& e, const Motion<V>& own, int s, int k, unsigned asked) const {
    const auto& o = *motions_[e.obstacle];
    const T own_deviation = s >= own.last ? T(0) : own.deviation[static_cast<size_t>(e.own) * own.stride + s];
    const V slack = levels_.proof + share_ * (own_deviation + o.deviation_at(e.other, k));
    const V far = max(slack, splat<V>(levels_.margin));
    if (exact(*own.arm, e.own, *o.arm, e.other)) return hulls_touching(e, own, s, k, far, asked);
    return links_near<V>(
        *own.arm, e.own, [&](auto array, int i) { return own.chord_at(own.*array, i, s); }, *o.arm, e.other,
        [&](auto array, int i) { return o.chord(o.*array, i, k); }, far, asked);
  }

 private:
  // Returns the lanes of `asked` in which the hulls of two links come closer than `far`.
  MMP_NOINLINE unsigned hulls_touching(const NearLinks& e, const Motion<V>& own, int s, int k, const V& far,
                                       unsigned asked) const {
    const auto& o = *motions_[e.obstacle];
    return hulls_near<V>(
        *own.arm, e.own, [&](auto array, int i) { return own.chord_at(own.*array, i, s); }, *o.arm, e.other,
        [&](auto array, int i) { return o.chord(o.*array, i, k); }, far, asked,
        [&](int lane) {
          return StepEnds{own.hulls_at(e.own, s), own.hulls_at(e.own, s + 1), o.hulls_at(e.other, k + lane),
                          o.hulls_at(e.other, k + lane + 1)};
        });
  }

  static constexpr T kRounding = T(1e-5);  // [m]; boxes must never exclude what chords would find

  uint64_t blocks_near(const Motion<V>& own, size_t i, const Motion<V>& other, size_t j) const {
    if (own.arm->links[i].spheres.count == 0 || other.arm->links[j].spheres.count == 0) return 0;
    const T within = reach(own, i, other, j);
    if (!own.boxes[i].near(other.boxes[j], within)) return 0;
    uint64_t when = 0;
    const size_t count = other.block_count();
    for (size_t b = 0; b < count; ++b)
      if (own.boxes[i].near(other.blocks[j * count + b], within)) when |= uint64_t{1} << b;
    return when;
  }

  T reach(const Motion<V>& own, size_t i, const Motion<V>& other, size_t j) const {
    return std::max(levels_.margin, levels_.proof + share_ * (own.max_deviation[i] + other.max_deviation[j])) +
           own.arm->links[i].bound.r + other.arm->links[j].bound.r + kRounding;
  }

  std::vector<const Motion<V>*> motions_;
  Levels<T> levels_{};
  T share_{};
  int horizon_ = 0;
};

// Edge at full speed among dynamic obstacles, or a stay (one row): the steps at which it may begin.
template <class V>
class EdgeTimeline {
 public:
  using T = Scalar<V>;

  // Returns nullptr if no obstacle ever comes close.
  static std::shared_ptr<EdgeTimeline> make(const DynamicObstacles<V>& obstacles, Motion<V> own, Pose<V>& pose) {
    std::vector<NearLinks> near_links;
    obstacles.find_near_links(own, near_links);
    if (near_links.empty()) return nullptr;
    uint32_t wanted = 0;
    for (const auto& e : near_links) wanted |= 1u << e.own;
    own.detail(wanted, pose);
    return std::make_shared<EdgeTimeline>(obstacles, std::move(own), std::move(near_links));
  }

  EdgeTimeline(const DynamicObstacles<V>& obstacles, Motion<V> own, std::vector<NearLinks> near_links)
      : obstacles_(&obstacles), own_(std::move(own)), near_links_(std::move(near_links)) {
    known_.assign(static_cast<size_t>(obstacles.horizon() / width<V> + 1), -1);
  }

  // Returns the first step in [depart, latest] at which a departure is free along the whole edge; -1 if there is none.
  long first_free(long depart, long latest) {
    const long horizon = obstacles_->horizon();
    if (depart > latest) return -1;
    if (depart >= horizon) return free_from(horizon) & 1u ? depart : -1;
    for (long d = depart; d <= std::min(latest, horizon); d = (d / width<V> + 1) * width<V>) {
      const unsigned free = free_from(d);
      if (free == 0) continue;
      d += std::countr_zero(free);
      return d <= latest ? d : -1;
    }
    return -1;
  }

  // Returns bits: bit k is set if a departure at step d + k of the same block is free.
  unsigned free_from(long d) {
    auto& known = known_[static_cast<size_t>(d / width<V>)];
    if (known < 0) known = static_cast<int>(all_bits<V> & ~blocked(static_cast<int>(d / width<V>) * width<V>));
    return static_cast<unsigned>(known) >> (d % width<V>);
  }

 private:
  unsigned blocked(int first) {
    unsigned touching_lanes = 0;
    const int moves = std::max(1, own_.last);
    for (size_t n = 0; n < near_links_.size(); ++n)
      for (int s = 0; s < moves; ++s) {
        if (!obstacles_->may_be_near(near_links_[n], first + s)) continue;
        touching_lanes |= obstacles_->touching(near_links_[n], own_, s, first + s, all_bits<V> & ~touching_lanes);
        if (touching_lanes == all_bits<V>) {
          std::swap(near_links_[n], near_links_[n / 2]);  // found sooner the next time
          return touching_lanes;
        }
      }
    return touching_lanes;
  }

  const DynamicObstacles<V>* obstacles_;
  Motion<V> own_;
  std::vector<NearLinks> near_links_;
  std::vector<int> known_;
};

}  // namespace mmp
