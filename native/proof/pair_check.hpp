// Conflicts of two motions on the common grid of steps.
#pragma once

#include <vector>

#include "geometry/swept_distance.hpp"
#include "proof/segments.hpp"

namespace mmp {

// Lists the instants of conflict of two motions, in steps, ascending, at most one per step.
//
// At a step, surfaces closer than `margin` are a conflict. Between steps the test uses the chords of all sphere pairs,
// minus the deviation of the true arcs. The prover decides undecided steps; a contact that it finds is an instant
// between two steps. Outside conflicts `proof` is proved at every instant.
template <class V>
class PairCheck {
 public:
  using T = Scalar<V>;
  // `bases` also tests one arm's moving links against the other's base. Paths that are free alone never touch it.
  explicit PairCheck(StaticWorld<V>& world, bool bases = false) : prover_(world), first_(bases ? 0 : 1) {}

  void operator()(const Motion<V>& a, const Motion<V>& b, Levels<T> levels, std::vector<double>& instants) {
    const int last = std::max(a.last, b.last);
    instants.clear();
    undecided_.clear();
    // The boxes hold all moving links at all steps and between them.
    if (first_ == 1 && !a.whole.near(b.whole, std::max(levels.margin, levels.proof) + kRounding)) return;
    for (int k = 0; k <= last; k += width<V>) block(a, b, k, last, levels, instants);
    refine(a, b, levels, last, instants);
  }

  // Returns whether `part` of a motion, which begins at step `offset` of the other motion, is clear of it.
  template <class Part, class Other>
  bool is_clear(Part& part, Other& other, int offset, Levels<T> levels, const Clock* clock = nullptr) {
    undecided_.clear();
    for (int k = 0; k < part.last; k += width<V>) {
      Mask<V> touching{}, undecided{};
      const unsigned lanes = part.last - k >= width<V> ? all_bits<V> : (1u << (part.last - k)) - 1u;
      chords(part, other, k, k + offset, levels, touching, undecided, lanes, true);
      if (bits<V>(touching) & lanes) return false;
      for (int lane = 0; lane < width<V>; ++lane)
        if (bits<V>(undecided) & lanes & (1u << lane)) undecided_.push_back(k + lane);
    }
    if (undecided_.empty()) return true;
    std::vector<SegmentResult<T>> results(undecided_.size());
    const auto of = [&](const Motion<V>& m, int from) {
      return [&, from](int s) {
        return std::pair<const T*, const T*>(m.at(from + undecided_[s]), m.at(from + undecided_[s] + 1));
      };
    };
    prover_.pair(part.arm_index, other.arm_index, static_cast<int>(undecided_.size()), of(part, 0), of(other, offset),
                 levels, first_ == 0, results.data(), clock);
    return std::all_of(results.begin(), results.end(), [](const auto& r) { return r.free; });
  }

 private:
  // A sphere at one step and at the next.
  struct Ends {
    Vec3<V> here, next;
  };

  // Tests chords of spheres between steps ka and ka + 1, kb and kb + 1.
  struct Visitor : SpherePairVisitor {
    const Motion<V>&a, &b;
    int ka, kb;
    T margin;
    V slack;
    Mask<V>&touching, &undecided;
    V far = max(slack, splat<V>(margin));

    MMP_INLINE Ends group_a(int g) const { return {a.centers(a.groups, g, ka), a.centers(a.groups, g, ka + 1)}; }
    MMP_INLINE Ends group_b(int g) const { return {b.centers(b.groups, g, kb), b.centers(b.groups, g, kb + 1)}; }
    MMP_INLINE Ends sphere_a(int i) const { return {a.centers(a.spheres, i, ka), a.centers(a.spheres, i, ka + 1)}; }
    MMP_INLINE Ends sphere_b(int j) const { return {b.centers(b.spheres, j, kb), b.centers(b.spheres, j, kb + 1)}; }
    MMP_INLINE bool near(const Ends& p, T rp, const Ends& q, T rq) const {
      const V limit = far + (rp + rq);
      return bits<V>(chord_distance2<V>(p.here - q.here, p.next - q.next) < limit * limit);
    }
    MMP_INLINE void pair(const Ends& p, T rp, const Ends& q, T rq) {
      const T radii = rp + rq;
      const auto d0 = p.here - q.here, d1 = p.next - q.next;
      const V wide = slack + radii;
      touching |= dot(d0, d0) < splat<V>((margin + radii) * (margin + radii));
      undecided |= chord_distance2<V>(d0, d1) < wide * wide;
    }
  };

  // Also tells which spheres are closer by more than they protrude.
  struct ExactVisitor : Visitor {
    T protrusion;
    Mask<V>&surely_touching, &surely_undecided;

    MMP_INLINE void pair(const Ends& p, T rp, const Ends& q, T rq) {
      Visitor::pair(p, rp, q, rq);
      const T radii = rp + rq - protrusion, close = std::max(this->margin + radii, T(0));
      const auto d0 = p.here - q.here, d1 = p.next - q.next;
      const V wide = max(this->slack + radii, V{});
      surely_touching |= dot(d0, d0) < splat<V>(close * close);
      surely_undecided |= chord_distance2<V>(d0, d1) < wide * wide;
    }
  };

  void block(const Motion<V>& a, const Motion<V>& b, int k, int last, Levels<T> levels, std::vector<double>& instants) {
    Mask<V> touching{}, undecided{};
    const unsigned lanes = last - k >= width<V> ? all_bits<V> : (2u << (last - k)) - 1u;
    chords(a, b, k, k, levels, touching, undecided, lanes, false);
    const unsigned h = bits<V>(touching), o = bits<V>(undecided);
    for (int lane = 0; lane < width<V> && k + lane <= last; ++lane) {
      if (h >> lane & 1u) instants.push_back(k + lane);
      if (o >> lane & 1u) undecided_.push_back(k + lane);
    }
  }

  // Tests chords from step ka of one motion and step kb of the other: surfaces that touch at the step, and chords too
  // close for a proof. Ends early on request when a lane of `asked` touches.
  template <class A, class B>
  void chords(A& a, B& b, int ka, int kb, Levels<T> levels, Mask<V>& touching, Mask<V>& undecided, unsigned asked,
              bool ends_early) {
    const auto whole_b = b.boxes_at(kb);
    const V room = splat<V>(std::max(levels.margin, levels.proof) + kRounding);
    if (first_ == 1 && !(asked & a.boxes_at(ka).near(whole_b, room))) return;
    for (size_t i = first_; i < a.arm->links.size(); ++i) {
      const int la = static_cast<int>(i);
      const auto a0 = a.centers(a.links, la, ka), a1 = a.centers(a.links, la, ka + 1);
      const V deviation_a = a.deviation_at(la, ka) + levels.proof;
      if (first_ == 1 &&
          !(asked & around(a0, a1).near(whole_b, room + a.deviation_at(la, ka) + a.arm->links[i].bound.r)))
        continue;
      for (size_t j = i == 0 ? 1 : first_; j < b.arm->links.size(); ++j) {
        const int lb = static_cast<int>(j);
        const V slack = deviation_a + b.deviation_at(lb, kb);
        const V far = max(slack, splat<V>(levels.margin)) + (a.arm->links[i].bound.r + b.arm->links[j].bound.r);
        const V d2 = chord_distance2<V>(a0 - b.centers(b.links, lb, kb), a1 - b.centers(b.links, lb, kb + 1));
        if (!bits<V>(d2 < far * far)) continue;
        a.need(la);
        b.need(lb);
        if (exact(*a.arm, la, *b.arm, lb))
          test_hulls(a, la, ka, b, lb, kb, asked, levels.margin, slack, touching, undecided, ends_early);
        else
          visit_sphere_pairs(*a.arm, la, *b.arm, lb,
                             Visitor{{}, a, b, ka, kb, levels.margin, slack, touching, undecided});
        if (ends_early && bits<V>(touching) & asked) return;
      }
    }
  }

  // Tests links with hulls. Spheres leave lanes open, and hulls decide these: at the step, and along it. Ends early on
  // request when a lane of `asked` touches.
  template <class A, class B>
  static MMP_NOINLINE void test_hulls(const A& a, int la, int ka, const B& b, int lb, int kb, unsigned asked, T margin,
                                      const V& slack, Mask<V>& touching, Mask<V>& undecided, bool ends_early) {
    Contacts<V> near;
    visit_sphere_pairs(*a.arm, la, *b.arm, lb,
                       ExactVisitor{{{}, a, b, ka, kb, margin, slack, near.touching, near.undecided},
                                    protrusion(*a.arm, la, *b.arm, lb),
                                    touching,
                                    undecided});
    if (ends_early && bits<V>(touching) & asked) return;
    const unsigned may_touch = bits<V>(near.touching & ~touching);
    const unsigned open = asked & (may_touch | bits<V>(near.undecided & ~undecided & ~touching));
    const double close = double(margin);
    LastDirection last;
    for (unsigned left = asked & may_touch; left; left &= left - 1) {
      const int lane = std::countr_zero(left);
      if (hulls_distance(a.hulls_at(la, ka + lane), b.hulls_at(lb, kb + lane), {close, close}, &last).lower >= close)
        continue;
      touching[lane] = -1;
      if (ends_early) return;
    }
    for (unsigned left = open & ~bits<V>(touching | undecided); left; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const auto a0 = a.hulls_at(la, ka + lane), a1 = a.hulls_at(la, ka + lane + 1);
      const auto b0 = b.hulls_at(lb, kb + lane), b1 = b.hulls_at(lb, kb + lane + 1);
      if (swept_hulls_near(a0, a1, b0, b1, double(slack[lane]), last)) undecided[lane] = -1;
    }
  }

  void refine(const Motion<V>& a, const Motion<V>& b, Levels<T> levels, int last, std::vector<double>& instants) {
    const auto touching = [&](int k) { return std::binary_search(instants.begin(), instants.end(), double(k)); };
    std::erase_if(undecided_, [&](int k) { return k == last || touching(k) || touching(k + 1); });
    if (undecided_.empty()) return;
    std::vector<SegmentResult<T>> results(undecided_.size());
    const auto of = [&](const Motion<V>& m) {
      return [&](int s) { return std::pair<const T*, const T*>(m.at(undecided_[s]), m.at(undecided_[s] + 1)); };
    };
    prover_.pair(a.arm_index, b.arm_index, static_cast<int>(undecided_.size()), of(a), of(b), levels, first_ == 0,
                 results.data());
    for (size_t s = 0; s < undecided_.size(); ++s)
      if (!results[s].free) instants.push_back(undecided_[s] + double(results[s].contact));
    std::sort(instants.begin(), instants.end());
  }

  static constexpr T kRounding = T(1e-4);  // [m]

  Prover<V> prover_;
  size_t first_;
  std::vector<int> undecided_;
};

}  // namespace mmp
