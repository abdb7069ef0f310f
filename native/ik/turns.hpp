// Whole turns of hinges within the joint limits.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <vector>

namespace mmp::ik {

// A position of a joint [rad or m] and its distance from the preferred one.
struct Turned {
  double position, cost;
};

// A configuration of the result: the index of the row that it is a turn of, and its joints.
struct TurnedRow {
  int owner;
  double cost;
  std::vector<double> q;
};

// Enumerates the turns of configurations, the nearest first (best-first, as Lawler enumerates k best assignments).
class TurnedRows {
 public:
  explicit TurnedRows(int dof) : dof_(dof) {}

  // Adds a configuration by the positions that each of its joints may have.
  void add(std::vector<std::vector<Turned>> joints) {
    for (auto& positions : joints)
      std::stable_sort(positions.begin(), positions.end(),
                       [](const Turned& a, const Turned& b) { return a.cost < b.cost; });
    rows_.push_back(std::move(joints));
    push(static_cast<int>(rows_.size()) - 1, std::vector<int>(dof_, 0), 0);
  }

  // Returns the nearest configurations, equally near ones in the order of their joints.
  std::vector<TurnedRow> nearest(size_t limit) {
    std::vector<TurnedRow> out;
    while (!queue_.empty() && (out.size() < limit || queue_.top().cost < out[limit - 1].cost + 2 * kEqual)) {
      const Entry top = queue_.top();
      queue_.pop();
      TurnedRow row{top.owner, top.cost, {}};
      for (int k = 0; k < dof_; ++k) row.q.push_back(rows_[top.owner][k][top.choice[k]].position);
      out.push_back(std::move(row));
      for (int k = top.last; k < dof_; ++k) {
        if (top.choice[k] + 1 == static_cast<int>(rows_[top.owner][k].size())) continue;
        auto next = top.choice;
        ++next[k];
        push(top.owner, std::move(next), k);
      }
    }
    const auto key = [](const TurnedRow& row) { return std::nearbyint(row.cost / kEqual); };
    std::stable_sort(out.begin(), out.end(), [&](const TurnedRow& a, const TurnedRow& b) {
      return key(a) != key(b) ? key(a) < key(b) : a.q < b.q;
    });
    if (out.size() > limit) out.resize(limit);
    return out;
  }

 private:
  static constexpr double kEqual = 1e-6;  // [rad or m]
  struct Entry {
    double cost;
    int owner, last;
    std::vector<int> choice;
    bool operator<(const Entry& o) const { return cost > o.cost; }
  };

  void push(int owner, std::vector<int> choice, int last) {
    double cost = 0;
    for (int k = 0; k < dof_; ++k) cost += rows_[owner][k][choice[k]].cost;
    queue_.push({cost, owner, last, std::move(choice)});
  }

  int dof_;
  std::vector<std::vector<std::vector<Turned>>> rows_;
  std::priority_queue<Entry> queue_;
};

}  // namespace mmp::ik
