// Ways of several plans put together anew: one for each arm, such that all of them can be driven at once.
//
// Plans in which arms pass each other in different orders each have arms with short ways. Choices of ways are looked at
// from the shortest on. Of one in which every pair can be timed (`coordination.hpp`) all arms are timed together, depth
// first.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <queue>
#include <set>
#include <vector>

#include "movers.hpp"
#include "pair_check.hpp"
#include "timing.hpp"

namespace mmp {

template <class V>
class Recombination {
 public:
  using T = Scalar<V>;
  using Rows = std::vector<std::vector<T>>;  // of each arm, [steps + 1][dof]

  Recombination(StaticWorld<V>& world, std::vector<std::vector<T>> max_step, Levels<T> levels)
      : cell_(world.cell), check_(world), levels_(levels), ways_(max_step.size()) {
    for (auto& steps : max_step) paces_.push_back({std::move(steps)});
  }

  const CellModel<T>& cell() const { return *cell_; }
  int arms() const { return static_cast<int>(ways_.size()); }

  // A way for each arm from its start to its goal, free alone. Of too many of an arm the longest goes. Returns the
  // numbers of the ways that stand for them, -1 for none.
  std::vector<int> add(const Rows& rows) {
    std::vector<int> out;
    for (int a = 0; a < arms(); ++a) out.push_back(add(a, rows[a]));
    return out;
  }

  // The number of the shortest way of each arm.
  std::vector<int> shortest() const {
    std::vector<int> out;
    for (const auto& ways : ways_)
      out.push_back(ways.empty() ? -1 : (*std::ranges::min_element(ways, shorter))->number);
    return out;
  }

  // None where there is no such way, or no more.
  const Motion<V>* way(int a, int number) const {
    const int n = place_of(a, number);
    return n < 0 ? nullptr : &ways_[a][n]->motion;
  }

  // Whether there are ways with these numbers, one for each arm.
  bool has(const std::vector<int>& numbers) const {
    bool all = static_cast<int>(numbers.size()) == arms();
    for (int a = 0; all && a < arms(); ++a) all = place_of(a, numbers[a]) >= 0;
    return all;
  }

  // Pairs of arms that cannot both come to their ends on the ways with these numbers; those found until time is up.
  std::vector<std::pair<int, int>> closed(std::vector<int> numbers, const Clock& clock) {
    for (int a = 0; a < arms(); ++a) numbers[a] = place_of(a, numbers[a]);
    std::vector<std::pair<int, int>> out;
    for (int b = 0; b < arms(); ++b)
      for (int a = 0; a < b; ++a) {
        if (places_ > kMostPlaces) forget();
        const bool open = diagram(numbers, a, b).open(0, 0, clock);
        if (clock.expired()) return out;
        if (!open) out.emplace_back(a, b);
      }
    return out;
  }

  // Motions along ways that are shorter than `limit` [rad] together; empty if no choice is found. No choice twice.
  Rows run(double limit, const Clock& clock) {
    const auto orders = shortest_first();
    double least = 0;
    for (const auto& order : orders) {
      if (order.empty()) return {};
      least += order[0].first;
    }
    std::priority_queue<Choice> open;
    open.push({least, {}});
    int states = 0;
    for (int looks = 0; looks < kLooks && states < kStates && !open.empty() && !clock.expired(); ++looks) {
      if (places_ > kMostPlaces) forget();
      const Choice choice = open.top();
      open.pop();
      if (choice.bound >= limit) break;
      if (!last_fits(choice.ways, clock)) continue;
      const size_t a = choice.ways.size();
      if (a == ways_.size()) {
        if (!tried_.insert(numbers(choice.ways)).second) continue;
        auto rows = timed(choice.ways, states, clock);
        if (!rows.empty()) return rows;
        continue;
      }
      for (const auto& [length, n] : orders[a]) {
        Choice next{choice.bound + length - orders[a][0].first, choice.ways};
        next.ways.push_back(n);
        open.push(std::move(next));
      }
    }
    return {};
  }

 private:
  static constexpr double kSame = 1e-6;           // [rad]; one of several as long stands for all: fewer choices
  static constexpr size_t kMostWays = 32;         // of an arm
  static constexpr int kMostSteps = 1000;         // of a way
  static constexpr size_t kMostPlaces = 1 << 26;  // of all diagrams that are kept, a byte each
  static constexpr int kLooks = 2000;             // choices that are looked at, with those of the first few arms
  static constexpr int kStates = 5000;            // of all choices together while they are timed
  static constexpr int kStatesOfOne = 500;        // of one of them

  // Ways of the first arms; `bound`: with the shortest ways of the others [rad].
  struct Choice {
    double bound;
    std::vector<int> ways;
    // Among equals those that are nearly complete come first.
    bool operator<(const Choice& o) const {
      if (bound != o.bound) return bound > o.bound;
      return ways.size() != o.ways.size() ? ways.size() < o.ways.size() : ways > o.ways;
    }
  };

  static bool shorter(const std::unique_ptr<Track<V>>& p, const std::unique_ptr<Track<V>>& q) {
    return p->length < q->length;
  }

  int add(int a, const std::vector<T>& rows) {
    auto track = std::make_unique<Track<V>>(*cell_, a, rows, paces_[a], tracks_++);
    auto& ways = ways_[a];
    const auto same =
        std::ranges::find_if(ways, [&](const auto& other) { return std::abs(other->length - track->length) < kSame; });
    if (same != ways.end()) return (*same)->number;
    if (track->motion.last > kMostSteps) return -1;
    const int number = track->number;
    if (ways.size() < kMostWays) {
      ways.push_back(std::move(track));
      return number;
    }
    const auto longest = std::ranges::max_element(ways, shorter);
    if ((*longest)->length <= track->length) return -1;
    forget((*longest)->number);
    *longest = std::move(track);
    return number;
  }

  int place_of(int a, int number) const {
    const auto it = std::ranges::find_if(ways_[a], [&](const auto& way) { return way->number == number; });
    return it == ways_[a].end() ? -1 : static_cast<int>(it - ways_[a].begin());
  }

  std::vector<std::vector<std::pair<double, int>>> shortest_first() const {
    std::vector<std::vector<std::pair<double, int>>> out(ways_.size());
    for (size_t a = 0; a < ways_.size(); ++a) {
      for (size_t n = 0; n < ways_[a].size(); ++n) out[a].emplace_back(ways_[a][n]->length, static_cast<int>(n));
      std::sort(out[a].begin(), out[a].end());
    }
    return out;
  }

  const Motion<V>& motion(const std::vector<int>& choice, int a) const { return ways_[a][choice[a]]->motion; }

  std::vector<int> numbers(const std::vector<int>& choice) const {
    std::vector<int> out;
    for (int a = 0; a < arms(); ++a) out.push_back(ways_[a][choice[a]]->number);
    return out;
  }

  Diagram<V>& diagram(const std::vector<int>& choice, int a, int b) {
    const std::pair key{ways_[a][choice[a]]->number, ways_[b][choice[b]]->number};
    const auto [at, made] = diagrams_.try_emplace(key, motion(choice, a), motion(choice, b), levels_, kSomeBulge<T>);
    if (made) places_ += at->second.places();
    return at->second;
  }

  // Drops all diagrams, or those of one way.
  void forget(int number = -1) {
    std::erase_if(diagrams_, [&](const auto& entry) {
      const auto& [pair, diagram] = entry;
      const bool goes = number < 0 || pair.first == number || pair.second == number;
      if (goes) places_ -= diagram.places();
      return goes;
    });
  }

  bool last_fits(const std::vector<int>& choice, const Clock& clock) {
    const int b = static_cast<int>(choice.size()) - 1;
    for (int a = 0; a < b; ++a)
      if (!diagram(choice, a, b).open(0, 0, clock)) return false;
    return true;
  }

  // Adds to `states`.
  Rows timed(const std::vector<int>& choice, int& states, const Clock& clock) {
    std::vector<int> last;
    for (int a = 0; a < arms(); ++a) last.push_back(motion(choice, a).last);
    const auto of_pair = [&](int a, int b) -> Diagram<V>& { return diagram(choice, a, b); };
    JointTiming<V, decltype(of_pair)> timing(std::move(last), of_pair, clock);
    const auto passed = timing.run(states, std::min(kStates, states + kStatesOfOne));
    Rows rows(arms());
    for (const auto& state : passed)
      for (int a = 0; a < arms(); ++a) {
        const T* q = motion(choice, a).at(state[a]);
        rows[a].insert(rows[a].end(), q, q + paces_[a].dof());
      }
    return !passed.empty() && clear(rows) ? rows : Rows{};
  }

  bool clear(const Rows& rows) {
    std::vector<Motion<V>> motions;
    std::vector<double> instants;
    for (int a = 0; a < arms(); ++a) {
      motions.emplace_back(*cell_, a, rows[a]);
      for (int b = 0; b < a; ++b) {
        check_(motions[b], motions[a], levels_, instants);
        if (!instants.empty()) return false;
      }
    }
    return true;
  }

  const CellModel<T>* cell_;
  PairCheck<V> check_;
  Levels<T> levels_;
  std::vector<Pace<T>> paces_;
  std::vector<std::vector<std::unique_ptr<Track<V>>>> ways_;  // of each arm
  int tracks_ = 0;                                            // that were ever made
  std::map<std::pair<int, int>, Diagram<V>> diagrams_;        // by the numbers of their ways
  size_t places_ = 0;                                         // of these
  std::set<std::vector<int>> tried_;                          // choices, by the numbers of their ways
};

}  // namespace mmp
