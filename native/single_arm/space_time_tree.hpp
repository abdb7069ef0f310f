// Search tree of SI-RRT*: configurations, their safe intervals, and the earliest arrival in each.
//
// A vertex is a pair (configuration, safe interval), with its earliest arrival and the shorter of two paths. Times are
// whole steps. An edge is driven at full speed; waiting happens before it.
#pragma once

#include "single_arm/static_tree.hpp"

namespace mmp {

// Read-only copy of a search tree.
template <class T>
struct TreeSnapshot {
  std::vector<T> positions;  // [vertices][dof]
  std::vector<int> links;    // [vertices][2]: step of arrival, and parent vertex or -1
};

template <class V>
class SpaceTimeTree {
 public:
  using T = Scalar<V>;
  // Connects a sample to at most `most` others within `radius` [rad].
  SpaceTimeTree(EdgeChecker<V>& checker, T radius, int most) : checker_(checker), radius_(radius), most_(most) {}

  // Adds the root, sample 0, which is safe at step 0.
  void add_root(Waypoint<V> root) {
    vertices_.push_back({0, root.safe[0].second, 0, -1, 0.0});
    samples_[add(std::move(root))].vertices[0] = 0;
  }

  // Attaches a waypoint to a sample by the waypoint's edge. Returns its sample, or -1 if no arrival is in time.
  int attach(int from, Waypoint<V> waypoint) {
    const auto edge = std::move(waypoint.edge);
    const int sample = add(std::move(waypoint));
    if (connect_samples(from, sample, edge)) return sample;
    samples_.pop_back();
    return -1;
  }

  // Connects a waypoint to `near`, whose edge is free, and to its neighbours. Returns its sample, or -1 if no arrival
  // is in time.
  int connect(int near, Waypoint<V> waypoint) {
    const int sample = add(std::move(waypoint));
    if (!choose_parents(sample, near)) {
      samples_.pop_back();
      return -1;
    }
    rewire(sample);
    return sample;
  }

  const Config<T>& q(int sample) const { return samples_[sample].q; }
  int nearest(const Config<T>& q) const { return mmp::nearest(samples_, q); }
  // One vertex per safe interval, -1 if not reached.
  const std::vector<int>& vertices(int sample) const { return samples_[sample].vertices; }

  // Returns the path from the root to a vertex.
  TimedPath<V> branch(int vertex) {
    std::vector<int> order;
    for (int v = vertex; v >= 0; v = vertices_[v].parent) order.push_back(vertices_[v].sample);
    TimedPath<V> path;
    for (size_t k = order.size(); k-- > 0;) {
      const auto& s = samples_[order[k]];
      Waypoint<V> next{s.q, s.safe, {}};
      if (!path.empty()) checker_.evaluate(path.back().q.data(), s.q.data(), next.edge);
      path.push_back(std::move(next));
    }
    return path;
  }

  // Copies the tree.
  void copy_to(TreeSnapshot<T>& out) const {
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
    double length;  // of the path to it when its parent was chosen [rad]
  };

  int add(Waypoint<V> waypoint) {
    const size_t n = waypoint.safe.size();
    samples_.push_back({std::move(waypoint.q), std::move(waypoint.safe), std::vector<int>(n, -1)});
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
      if (n > 0 && !checker_.is_static_free(q(from).data(), q(sample).data())) {
        near_[n] = -1;
        continue;
      }
      checker_.evaluate(q(from).data(), q(sample).data(), edges_[n]);
      any |= connect_samples(from, sample, edges_[n]);
    }
    return any;
  }

  void rewire(int sample) {
    for (size_t n = 0; n < near_.size(); ++n)
      if (near_[n] > 0)  // free, and not the root
        connect_samples(sample, near_[n], checker_.reversed(q(near_[n]).data(), q(sample).data(), edges_[n]));
  }

  // Relaxes all vertices of `to` over an edge from `from`: the earliest arrival, and the shorter path of two that
  // arrive at once. Descendants stay feasible when their ancestor arrives earlier; `schedule_path` recovers the time
  // that the tree does not propagate.
  bool connect_samples(int from, int to, const Edge<V>& edge) {
    bool any = false;
    for (size_t i = 0; i < samples_[to].safe.size(); ++i)
      for (const int v : samples_[from].vertices)
        if (v >= 0) any |= arrive(v, to, i, edge);
    return any;
  }

  bool arrive(int from, int to, size_t interval, const Edge<V>& edge) {
    const auto [lo, hi] = samples_[to].safe[interval];
    const int depart = earliest_departure(checker_, edge, vertices_[from].arrival, vertices_[from].leave_by, lo, hi);
    if (depart < 0) return false;
    const int arrival = depart + edge.steps;
    const double length = vertices_[from].length + mmp::length(q(vertices_[from].sample), q(to));
    int& mine = samples_[to].vertices[interval];
    if (mine < 0) {
      mine = static_cast<int>(vertices_.size());
      vertices_.push_back({to, hi, arrival, from, length});
    } else if (std::pair(arrival, length) < std::pair(vertices_[mine].arrival, vertices_[mine].length)) {
      vertices_[mine].arrival = arrival;
      vertices_[mine].parent = from;
      vertices_[mine].length = length;
    } else {
      return false;
    }
    return true;
  }

  EdgeChecker<V>& checker_;
  T radius_;
  int most_;
  std::vector<Sample> samples_;
  std::vector<Vertex> vertices_;
  std::vector<int> near_;  // neighbours of the current sample, -1 where the edge is not free
  std::vector<Edge<V>> edges_;
};

}  // namespace mmp
