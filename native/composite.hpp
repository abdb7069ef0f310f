// RRT-Connect (Kuffner and LaValle 2000) in the composite space: all joints of all arms, one after the other.
//
// Edges are looked at every `step` radians; a way that is found is then proved at every instant, and an edge that is
// not free falls with all that hangs on it: the trees grow on without it.
#pragma once

#include <deque>

#include "random.hpp"
#include "segments.hpp"

namespace mmp {

// What all arms together may touch, asked about straight edges of the composite space.
template <class V>
class CompositeEdges {
 public:
  using T = Scalar<V>;
  CompositeEdges(StaticWorld<V>& world, T margin, T step)
      : world_(&world), prover_(world), margin_(margin), step_(step) {
    const auto& arms = world.cell->arms;
    for (const auto& arm : arms) {
      offset_.push_back(dof_);
      dof_ += arm.dof;
      poses_.emplace_back(arm);
    }
    ready_.resize(arms.size());
    for (int a = 0; a < count(); ++a) {
      tests_.push_back({a, -1});
      for (int b = a + 1; b < count(); ++b) tests_.push_back({a, b});
    }
  }

  int dof() const { return dof_; }
  int count() const { return static_cast<int>(poses_.size()); }
  int offset(int a) const { return offset_[a]; }
  const ArmModel<T>& arm(int a) const { return *poses_[a].arm; }

  // Whether no sample of the edge touches anything; `from` itself is known to be free.
  bool free(const T* from, const T* to) {
    T longest = 0;
    for (int j = 0; j < dof_; ++j) longest = std::max(longest, std::abs(to[j] - from[j]));
    const int samples = std::max(1, static_cast<int>(std::ceil(longest / step_)));
    const int batches = (samples + width<V> - 1) / width<V>;
    // The lanes of a batch are spread over the whole edge, so that the first one finds most contacts.
    for (int batch = 0; batch < batches; ++batch) {
      std::fill(ready_.begin(), ready_.end(), false);
      V at;
      for (int lane = 0; lane < width<V>; ++lane)
        at[lane] = T(std::min(batch + 1 + lane * batches, samples)) / T(samples);
      for (size_t k = 0; k < tests_.size(); ++k)
        if (touches(tests_[k], from, to, at)) {
          // What was in the way is likely to be in the way again.
          std::rotate(tests_.begin(), tests_.begin() + k, tests_.begin() + k + 1);
          return false;
        }
    }
    return true;
  }

  // Which of the edges way[k] -> way[k + 1] keep `levels.proof` at every instant.
  std::vector<bool> proved(const std::vector<const T*>& way, Levels<T> levels, const Clock& clock) {
    const int edges = static_cast<int>(way.size()) - 1;
    std::vector<bool> out(edges, true);
    std::vector<SegmentResult<T>> results;
    const auto of = [&](int a) {
      return [&way, o = offset_[a]](int s) { return std::pair<const T*, const T*>(way[s] + o, way[s + 1] + o); };
    };
    const auto note = [&] {
      for (int k = 0; k < edges; ++k)
        if (!results[k].free) out[k] = false;
    };
    for (int a = 0; a < count(); ++a) {
      results.assign(edges, {});
      prover_.alone(a, edges, of(a), levels, Stop::at_first_contact_of_segment, results.data(), &clock);
      note();
      for (int b = a + 1; b < count(); ++b) {
        results.assign(edges, {});
        prover_.pair(a, b, edges, of(a), of(b), levels, false, results.data(), &clock);
        note();
      }
    }
    return out;
  }

 private:
  struct Test {
    int a, b;  // b = -1: arm a alone
  };

  bool touches(Test test, const T* from, const T* to, V at) {
    Contacts<V> out;
    auto& a = pose(test.a, from, to, at);
    if (test.b < 0) {
      const auto none = [](int) { return V{}; };
      world_->contacts(test.a, a, margin_, none, none, [](const Contacts<V>& c) { return bits<V>(c.hit) != 0; }, out);
      return bits<V>(out.hit) != 0;
    }
    auto& b = pose(test.b, from, to, at);
    for (size_t i = a.arm->links.size(); i-- > 1;)
      for (size_t j = b.arm->links.size(); j-- > 1;) {
        contact(a, static_cast<int>(i), b, static_cast<int>(j), margin_, V{}, out);
        if (bits<V>(out.hit)) return true;
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
  T margin_, step_;
  int dof_ = 0;
  std::vector<int> offset_;
  std::vector<Pose<V>> poses_;
  std::vector<bool> ready_;
  std::vector<Test> tests_;
};

// Nodes of one tree. Rows for the search for the nearest stand in blocks, a node a lane: the sum over the joints has
// the same order, and so the same bits, for every width.
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

  // In L2; the first of those that are equally near.
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

  // Node k and all that hangs on it is as good as gone: nothing is ever near to it.
  void fell(int k) {
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
  std::deque<std::vector<T>> rows_;  // whose places never change
  std::vector<int> parent_;
  std::vector<T> blocks_;
};

struct CompositeOptions {
  double range = 2.0;  // longest edge, L2 [rad]
  double step = 0.05;  // between samples of an edge, largest joint [rad]
};

// Two trees that grow towards each other; can be asked to go on.
template <class V>
class CompositeSearch {
 public:
  using T = Scalar<V>;
  CompositeSearch(StaticWorld<V>& world, std::vector<T> start, std::vector<T> goal, Levels<T> looked, Levels<T> proof,
                  const CompositeOptions& options, uint64_t seed)
      : edges_(world, looked.margin, T(options.step)),
        proof_(proof),
        range_(T(options.range)),
        random_(seed),
        start_(std::move(start)),
        goal_(std::move(goal)),
        forward_(edges_.dof()),
        backward_(edges_.dof()) {
    forward_.add(start_, -1);
    backward_.add(goal_, -1);
  }

  int dof() const { return edges_.dof(); }
  int iterations() const { return iteration_; }
  int nodes() const { return forward_.size() + backward_.size(); }

  // Configurations from start to goal, proved; empty if `iterations` more did not find them.
  std::vector<const T*> grow(int iterations, const Clock& clock) {
    if (iteration_ == 0 && start_ == goal_) {
      iteration_ = 1;
      return {forward_.q(0), backward_.q(0)};
    }
    for (const int end = iteration_ + iterations; iteration_ < end;) {
      if ((iteration_ & 15) == 15 && clock.expired()) break;
      const int it = iteration_++;
      const bool ahead = it % 2 == 0;
      auto &tree = ahead ? forward_ : backward_, &other = ahead ? backward_ : forward_;
      const int tip = extend(tree, it < 2 ? (ahead ? goal_ : start_) : sample(it));
      if (tip < 0) continue;
      const std::vector<T> q(tree.q(tip), tree.q(tip) + dof());
      const int met = connect(other, q);
      if (met < 0) continue;
      if (auto way = joined(ahead ? tip : met, ahead ? met : tip, clock); !way.empty()) return way;
    }
    return {};
  }

 private:
  // Around start and goal first, farther out for some.
  std::vector<T> sample(int iteration) {
    std::vector<T> q(dof());
    for (int a = 0; a < edges_.count(); ++a) {
      const auto& arm = edges_.arm(a);
      const double u = random_.uniform();
      const double slack = u < 0.4 ? 0.8 : u < 0.8 ? 1.8 : 4.0 + 0.002 * iteration;
      for (int j = 0, k = edges_.offset(a); j < arm.dof; ++j, ++k) {
        const double lo = std::max<double>(arm.lower[j], std::min(start_[k], goal_[k]) - slack);
        const double hi = std::min<double>(arm.upper[j], std::max(start_[k], goal_[k]) + slack);
        q[k] = T(random_.uniform(lo, hi));
      }
    }
    return q;
  }

  // One edge of at most `range` towards the target; its node, or -1.
  int extend(CompositeTree<V>& tree, const std::vector<T>& target) {
    const int near = tree.nearest(target);
    return step(tree, near, target);
  }

  // Edge after edge until the target is reached: its node, or -1 if something is in the way.
  int connect(CompositeTree<V>& tree, const std::vector<T>& target) {
    int at = tree.nearest(target);
    while (at >= 0 && !std::equal(target.begin(), target.end(), tree.q(at))) at = step(tree, at, target);
    return at;
  }

  int step(CompositeTree<V>& tree, int from, const std::vector<T>& target) {
    const T* p = tree.q(from);
    double d2 = 0;
    for (int j = 0; j < dof(); ++j) d2 += double(target[j] - p[j]) * double(target[j] - p[j]);
    const double d = std::sqrt(d2);
    if (d == 0) return -1;
    std::vector<T> next = target;
    if (d > range_)
      for (int j = 0; j < dof(); ++j) next[j] = p[j] + T(range_ / d) * (target[j] - p[j]);
    return edges_.free(p, next.data()) ? tree.add(next, from) : -1;
  }

  // The way through both trees if every edge of it can be proved; else what is not free falls.
  std::vector<const T*> joined(int ahead, int behind, const Clock& clock) {
    std::vector<int> there, back;
    for (int k = ahead; k >= 0; k = forward_.parent(k)) there.push_back(k);
    for (int k = backward_.parent(behind); k >= 0; k = backward_.parent(k)) back.push_back(k);
    std::reverse(there.begin(), there.end());
    std::vector<const T*> way;
    for (const int k : there) way.push_back(forward_.q(k));
    for (const int k : back) way.push_back(backward_.q(k));
    const auto proved = edges_.proved(way, proof_, clock);
    if (std::find(proved.begin(), proved.end(), false) == proved.end()) return way;
    for (size_t k = 0; k < proved.size(); ++k) {
      if (proved[k] || clock.expired()) continue;
      // Edge k leads into there[k + 1], or out of the node that lies before back[k + 1 - size] on the other side.
      if (k + 1 < there.size()) forward_.fell(there[k + 1]);
      else backward_.fell(k + 1 == there.size() ? behind : back[k - there.size()]);
    }
    return {};
  }

  CompositeEdges<V> edges_;
  Levels<T> proof_;
  T range_;
  Random random_;
  std::vector<T> start_, goal_;
  CompositeTree<V> forward_, backward_;
  int iteration_ = 0;
};

}  // namespace mmp
