// The tree of SI-RRT*: configurations, their safe intervals, and the earliest arrival in each that is reached.
//
// A vertex is a pair (configuration, safe interval). Times are whole steps; an edge takes the least number of steps at
// full speed, the wait happens before it.
#pragma once

#include "seen_tree.hpp"
#include "static_tree.hpp"

namespace mmp {

template <class V>
class SpaceTimeTree {
 public:
  using T = Scalar<V>;
  // A sample is joined to `most` others at the most, no farther away than `radius` [rad].
  SpaceTimeTree(EdgeMaker<V>& maker, T radius, int most) : maker_(maker), radius_(radius), most_(most) {}

  // Where it grows from at step 0, sample 0; the place is safe then.
  void plant(Knot<V> root) {
    vertices_.push_back({0, root.safe[0].second, 0, -1});
    samples_[add(std::move(root))].vertices[0] = 0;
  }

  // Hangs a knot onto a sample by the knot's edge; its number, or -1 if it cannot be reached in time.
  int hang(int from, Knot<V> knot) {
    const auto edge = std::move(knot.edge);
    const int sample = add(std::move(knot));
    if (lead(from, sample, edge)) return sample;
    samples_.pop_back();
    return -1;
  }

  // Joins a knot to `near`, from where the way is free, and to its neighbours; its number, or -1 if it cannot be
  // reached in time.
  int join(int near, Knot<V> knot) {
    const int sample = add(std::move(knot));
    if (!choose_parents(sample, near)) {
      samples_.pop_back();
      return -1;
    }
    rewire(sample);
    return sample;
  }

  const Config<T>& q(int sample) const { return samples_[sample].q; }
  int nearest(const Config<T>& q) const { return mmp::nearest(samples_, q); }
  // One for each safe interval, -1 if not reached.
  const std::vector<int>& vertices(int sample) const { return samples_[sample].vertices; }

  // The way from the root to a vertex.
  Way<V> branch(int vertex) {
    std::vector<int> order;
    for (int v = vertex; v >= 0; v = vertices_[v].parent) order.push_back(vertices_[v].sample);
    Way<V> way;
    for (size_t k = order.size(); k-- > 0;) {
      const auto& s = samples_[order[k]];
      Knot<V> next{s.q, s.safe, {}};
      if (!way.empty()) maker_.touch(way.back().q.data(), s.q.data(), next.edge);
      way.push_back(std::move(next));
    }
    return way;
  }

  // The tree as it stands.
  void look(SeenTree<T>& out) const {
    for (const auto& v : vertices_) {
      out.positions.insert(out.positions.end(), q(v.sample).begin(), q(v.sample).end());
      out.links.insert(out.links.end(), {v.arrival, v.parent});
    }
  }

 private:
  struct Sample {
    Config<T> q;
    std::vector<std::pair<int, int>> safe;
    std::vector<int> vertices;
  };
  struct Vertex {
    int sample, leave_by, arrival, parent;
  };

  int add(Knot<V> knot) {
    const size_t n = knot.safe.size();
    samples_.push_back({std::move(knot.q), std::move(knot.safe), std::vector<int>(n, -1)});
    return static_cast<int>(samples_.size()) - 1;
  }

  std::vector<int> neighbours(int sample, int near) const {
    std::vector<std::pair<T, int>> within;
    for (int k = 0; k < static_cast<int>(samples_.size()); ++k)
      if (k != sample && k != near && distance(q(k), q(sample)) <= radius_)
        within.emplace_back(squared(q(k), q(sample)), k);
    std::sort(within.begin(), within.end());
    std::vector<int> out{near};
    for (size_t k = 0; k < within.size() && static_cast<int>(out.size()) < most_; ++k) out.push_back(within[k].second);
    return out;
  }

  bool choose_parents(int sample, int near) {
    near_ = neighbours(sample, near);
    edges_.assign(near_.size(), {});
    bool any = false;
    for (size_t n = 0; n < near_.size(); ++n) {
      const int from = near_[n];
      if (n > 0 && !maker_.statically_free(q(from).data(), q(sample).data())) {
        near_[n] = -1;
        continue;
      }
      maker_.touch(q(from).data(), q(sample).data(), edges_[n]);
      any |= lead(from, sample, edges_[n]);
    }
    return any;
  }

  void rewire(int sample) {
    for (size_t n = 0; n < near_.size(); ++n)
      if (near_[n] > 0)  // free, and not the root
        lead(sample, near_[n], maker_.reversed(q(near_[n]).data(), q(sample).data(), edges_[n]));
  }

  // Ways from any vertex of `from` into the safe intervals of `to`; kept if they arrive earlier. Whoever hangs below a
  // vertex that is now reached earlier still leaves it in time; `time_way` makes good what the tree leaves lying.
  bool lead(int from, int to, const Edge<V>& edge) {
    bool any = false;
    for (size_t i = 0; i < samples_[to].safe.size(); ++i)
      for (const int v : samples_[from].vertices)
        if (v >= 0) any |= arrive(v, to, i, edge);
    return any;
  }

  bool arrive(int from, int to, size_t interval, const Edge<V>& edge) {
    const auto [lo, hi] = samples_[to].safe[interval];
    const int depart = earliest_departure(maker_, edge, vertices_[from].arrival, vertices_[from].leave_by, lo, hi);
    if (depart < 0) return false;
    const int arrival = depart + edge.steps;
    int& mine = samples_[to].vertices[interval];
    if (mine < 0) {
      mine = static_cast<int>(vertices_.size());
      vertices_.push_back({to, hi, arrival, from});
    } else if (arrival < vertices_[mine].arrival) {
      vertices_[mine].arrival = arrival;
      vertices_[mine].parent = from;
    } else {
      return false;
    }
    return true;
  }

  EdgeMaker<V>& maker_;
  T radius_;
  int most_;
  std::vector<Sample> samples_;
  std::vector<Vertex> vertices_;
  std::vector<int> near_;  // of the sample that is being joined, -1 where the way is not free
  std::vector<Edge<V>> edges_;
};

}  // namespace mmp
