// Collision tests of straight edges in the composite space.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/upright_projection.hpp"
#include "proof/segments.hpp"

namespace mmp {

// Edge tests over some arms: each arm alone and every pair. The other arms are only there with their bases.
template <class V>
class CompositeEdges {
 public:
  using T = Scalar<V>;
  CompositeEdges(StaticWorld<V>& world, std::vector<int> arms, Levels<T> levels, T step)
      : world_(&world), prover_(world), levels_(levels), step_(step), arms_(std::move(arms)) {
    for (const int a : arms_) {
      const auto& arm = world.cell->arms[a];
      offset_.push_back(dof_);
      dof_ += arm.dof;
      poses_.emplace_back(arm);
      upright_.emplace_back(arm);
    }
    ready_.resize(arms_.size());
    for (int a = 0; a < count(); ++a) {
      tests_.push_back({a, -1});
      for (int b = a + 1; b < count(); ++b) tests_.push_back({a, b});
    }
  }

  int dof() const { return dof_; }
  int count() const { return static_cast<int>(poses_.size()); }
  int offset(int a) const { return offset_[a]; }
  const ArmModel<T>& arm(int a) const { return *poses_[a].arm; }

  // Moves a configuration of all joints inside the bounds of upright tools. Returns false if that fails.
  bool project(std::vector<T>& q) {
    for (int a = 0; a < count(); ++a)
      if (!upright_[a](q.data() + offset_[a])) return false;
    return true;
  }
  // Returns whether a tool is to be upright, and the largest share of a step that moves no joint of its arm too far.
  std::pair<bool, T> upright_share(const T* from, const T* to) const {
    bool any = false;
    T share = 1;
    for (int a = 0; a < count(); ++a) {
      if (!upright_[a].is_bound()) continue;
      any = true;
      const T longest = longest_move(std::pair(from + offset_[a], to + offset_[a]), poses_[a].arm->dof);
      if (longest > upright_[a].longest_step()) share = std::min(share, upright_[a].longest_step() / longest);
    }
    return {any, share};
  }

  // Returns whether all samples of the edge are free. `from` itself is known to be free.
  bool free(const T* from, const T* to) {
    T longest = 0;
    for (int j = 0; j < dof_; ++j) longest = std::max(longest, std::abs(to[j] - from[j]));
    const int samples = std::max(1, static_cast<int>(std::ceil(longest / step_)));
    const int batches = (samples + width<V> - 1) / width<V>;
    // Each batch spreads its lanes over the whole edge, so that the first batch finds most contacts.
    for (int batch = 0; batch < batches; ++batch) {
      std::fill(ready_.begin(), ready_.end(), false);
      V at;
      for (int lane = 0; lane < width<V>; ++lane)
        at[lane] = T(std::min(batch + 1 + lane * batches, samples)) / T(samples);
      for (size_t k = 0; k < tests_.size(); ++k)
        if (touches(tests_[k], from, to, at)) {
          // The last contact is likely to occur again.
          std::rotate(tests_.begin(), tests_.begin() + k, tests_.begin() + k + 1);
          return false;
        }
    }
    return true;
  }

  // Returns which edges path[k] -> path[k + 1] keep `levels.proof` at every instant.
  std::vector<bool> proved(const std::vector<const T*>& path, Levels<T> levels, const Clock& clock) {
    const int edges = static_cast<int>(path.size()) - 1;
    std::vector<bool> out(edges, true);
    std::vector<SegmentResult<T>> results;
    const auto of = [&](int a) {
      return [&path, o = offset_[a]](int s) { return std::pair<const T*, const T*>(path[s] + o, path[s + 1] + o); };
    };
    const auto note = [&] {
      for (int k = 0; k < edges; ++k)
        if (!results[k].free) out[k] = false;
    };
    for (int a = 0; a < count(); ++a) {
      results.assign(edges, {});
      prover_.alone(arms_[a], edges, of(a), levels, Stop::at_first_contact_of_segment, results.data(), &clock);
      note();
      for (int b = a + 1; b < count(); ++b) {
        results.assign(edges, {});
        prover_.pair(arms_[a], arms_[b], edges, of(a), of(b), levels, false, results.data(), &clock);
        note();
      }
    }
    return out;
  }

 private:
  struct Test {
    int a, b;  // b = -1: arm a alone; numbers among the arms of the search
  };

  bool touches(Test test, const T* from, const T* to, V at) {
    Contacts<V> out;
    auto& a = pose(test.a, from, to, at);
    if (test.b < 0) {
      if (a.arm->upright && bits<V>(upright_room(a) < splat<V>(levels_.margin + levels_.upright))) return true;
      const auto none = [](int) { return V{}; };
      world_->contacts(
          arms_[test.a], a, levels_, none, none, [](const Contacts<V>& c) { return bits<V>(c.touching) != 0; }, out);
      return bits<V>(out.touching) != 0;
    }
    auto& b = pose(test.b, from, to, at);
    for (size_t i = a.arm->links.size(); i-- > 1;)
      for (size_t j = b.arm->links.size(); j-- > 1;) {
        contact(a, static_cast<int>(i), b, static_cast<int>(j), levels_.margin, V{}, out);
        if (bits<V>(out.touching)) return true;
      }
    return false;
  }

  Pose<V>& pose(int a, const T* from, const T* to, V at) {
    if (!ready_[a]) {
      ready_[a] = true;
      V q[kMaxDof];
      const T *p = from + offset_[a], *n = to + offset_[a];
      for (int j = 0; j < poses_[a].arm->dof; ++j) q[j] = p[j] + at * (n[j] - p[j]);
      forward(q, poses_[a]);
    }
    return poses_[a];
  }

  StaticWorld<V>* world_;
  Prover<V> prover_;
  Levels<T> levels_;
  T step_;
  std::vector<int> arms_;
  int dof_ = 0;
  std::vector<int> offset_;
  std::vector<Pose<V>> poses_;
  std::vector<UprightProjection<V>> upright_;
  std::vector<bool> ready_;
  std::vector<Test> tests_;
};

}  // namespace mmp
