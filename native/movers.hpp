// Other arms in motion as obstacles in space and time. A lane is a departure: an edge, left at eight steps in a row, is
// tested against an arm whose centres lie in memory step after step.
#pragma once

#include <bit>
#include <memory>

#include "chords.hpp"

namespace mmp {

// Links of a moving arm that may ever come near a link of one's own.
struct Encounter {
  int mover, own, other;
  uint64_t when;  // blocks of the mover's steps in which they may
};

// Of what the true paths may bulge out of their chords, how much is allowed for where a proof follows in the end.
template <class T>
inline constexpr T kSomeBulge = T(0.4);

// The motions that one search keeps clear of.
//
// Chords of centres between steps are tested at `margin`, and at `proof` plus a share of what the true paths may bulge
// out of them: with the whole of it a clear way is proved, with less some ways turn out to be false in the end.
template <class V>
class Movers {
 public:
  using T = Scalar<V>;
  Movers() = default;
  Movers(std::vector<const Motion<V>*> motions, Levels<T> levels, T share)
      : motions_(std::move(motions)), levels_(levels), share_(share) {
    for (const auto* m : motions_) horizon_ = std::max(horizon_, m->last);
  }

  bool empty() const { return motions_.empty(); }
  // From this step on all of them stand still.
  int horizon() const { return horizon_; }

  // Pairs of links whose boxes are near each other at any time at all; `own` is not detailed yet.
  void meet(const Motion<V>& own, std::vector<Encounter>& out) const {
    out.clear();
    for (size_t m = 0; m < motions_.size(); ++m) {
      const auto& other = *motions_[m];
      // The tip first: it touches most often, and a contact in every lane ends the test.
      for (size_t i = own.boxes.size(); i-- > 1;) {
        const T out_of_link =
            own.arm->links[i].bound.r + own.most_bulge[i] + levels_.margin + levels_.proof + kRounding;
        if (!own.boxes[i].near(other.whole, out_of_link)) continue;
        for (size_t j = other.boxes.size(); j-- > 1;)
          if (const uint64_t when = blocks_near(own, i, other, j))
            out.push_back({static_cast<int>(m), static_cast<int>(i), static_cast<int>(j), when});
      }
    }
  }

  // Whether the two may be near each other while the mover goes through steps k, k + 1, ..., one a lane.
  bool may_meet(const Encounter& e, int k) const {
    const auto& o = *motions_[e.mover];
    const int lo = o.block_of(k), hi = o.block_of(k + width<V>);
    return e.when >> lo & ((2ull << (hi - lo)) - 1);
  }

  // Which of the lanes `asked` touch: own links at step s and on to the next one, the mover at steps k, k + 1, ... and
  // on.
  unsigned touching(const Encounter& e, const Motion<V>& own, int s, int k, unsigned asked) const {
    const auto& o = *motions_[e.mover];
    const T bulge_own = s >= own.last ? T(0) : own.bulge[static_cast<size_t>(e.own) * own.stride + s];
    const V slack = levels_.proof + share_ * (bulge_own + o.bulge_at(e.other, k));
    const V far = max(slack, splat<V>(levels_.margin));
    return links_near<V>(
        *own.arm, e.own, [&](auto array, int i) { return own.chord_at(own.*array, i, s); }, *o.arm, e.other,
        [&](auto array, int i) { return o.chord(o.*array, i, k); }, far, asked);
  }

 private:
  static constexpr T kRounding = T(1e-5);  // [m]; boxes must never decide what chords would decide otherwise

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
    return std::max(levels_.margin, levels_.proof + share_ * (own.most_bulge[i] + other.most_bulge[j])) +
           own.arm->links[i].bound.r + other.arm->links[j].bound.r + kRounding;
  }

  std::vector<const Motion<V>*> motions_;
  Levels<T> levels_{};
  T share_{};
  int horizon_ = 0;
};

// An edge driven at full speed among movers, or a stay (one row of positions): when it may begin.
template <class V>
class Passage {
 public:
  using T = Scalar<V>;

  // None where nothing is ever near.
  static std::shared_ptr<Passage> make(const Movers<V>& movers, Motion<V> own, Pose<V>& pose) {
    std::vector<Encounter> encounters;
    movers.meet(own, encounters);
    if (encounters.empty()) return nullptr;
    uint32_t wanted = 0;
    for (const auto& e : encounters) wanted |= 1u << e.own;
    own.detail(wanted, pose);
    return std::make_shared<Passage>(movers, std::move(own), std::move(encounters));
  }

  Passage(const Movers<V>& movers, Motion<V> own, std::vector<Encounter> encounters)
      : movers_(&movers), own_(std::move(own)), encounters_(std::move(encounters)) {
    known_.assign(static_cast<size_t>(movers.horizon() / width<V> + 1), -1);
  }

  // First step in [depart, latest] at which the way is free from its beginning to its end; -1: none.
  long first_free(long depart, long latest) {
    const long horizon = movers_->horizon();
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

  // Bit k: whether it is free to begin at step d + k of the same block.
  unsigned free_from(long d) {
    auto& known = known_[static_cast<size_t>(d / width<V>)];
    if (known < 0) known = static_cast<int>(all_bits<V> & ~blocked(static_cast<int>(d / width<V>) * width<V>));
    return static_cast<unsigned>(known) >> (d % width<V>);
  }

 private:
  unsigned blocked(int first) {
    unsigned hit = 0;
    const int moves = std::max(1, own_.last);
    for (size_t n = 0; n < encounters_.size(); ++n)
      for (int s = 0; s < moves; ++s) {
        if (!movers_->may_meet(encounters_[n], first + s)) continue;
        hit |= movers_->touching(encounters_[n], own_, s, first + s, all_bits<V> & ~hit);
        if (hit == all_bits<V>) {
          std::swap(encounters_[n], encounters_[n / 2]);  // sooner the next time
          return hit;
        }
      }
    return hit;
  }

  const Movers<V>* movers_;
  Motion<V> own_;
  std::vector<Encounter> encounters_;
  std::vector<int> known_;
};

}  // namespace mmp
