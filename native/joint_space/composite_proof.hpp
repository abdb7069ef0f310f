// Proof of a path in the composite space.
#pragma once

#include <algorithm>
#include <vector>

#include "joint_space/composite_steps.hpp"
#include "proof/near_arms.hpp"

namespace mmp {

// Proves edges between configurations of some arms: each arm alone and every pair, where one of them moves. Parked arms
// stand, and all others are only there with their bases.
template <class V>
class CompositeProof {
 public:
  using T = Scalar<V>;
  CompositeProof(StaticWorld<V>& world, std::vector<int> arms, std::vector<Parked<T>> parked, Levels<T> levels)
      : cell_(world.cell), prover_(world), arms_(std::move(arms)), parked_(std::move(parked)), levels_(levels) {}

  // Returns which edges path[k] -> path[k + 1] keep `levels.proof` at every instant.
  std::vector<bool> operator()(const std::vector<const T*>& path, const Clock& clock) {
    std::vector<bool> proved(path.size() - 1, true);
    const auto moves = moving_edges(path);
    for (size_t a = 0; a < arms_.size(); ++a)
      test(moves[a], proved, [&](const std::vector<int>& edges, SegmentResult<T>* results) {
        const auto at = [&](int s) { return ends(path, static_cast<int>(a), edges[s]); };
        prover_.alone(arms_[a], static_cast<int>(edges.size()), at, levels_, Stop::at_first_contact_of_segment, results,
                      &clock);
      });
    std::vector<const ArmModel<T>*> models;
    std::vector<int> numbers = arms_;
    for (const auto& parked : parked_) numbers.push_back(parked.arm);
    for (const int arm : numbers) models.push_back(&cell_->arms[arm]);
    NearArms<V> near(
        models, static_cast<int>(proved.size()),
        [&](int a) { return [&path, a, this](int s) { return ends(path, a, s); }; }, clock);
    if (clock.expired()) return std::vector<bool>(proved.size(), false);  // its boxes are not complete
    near.find(std::max(levels_.margin, levels_.proof));
    std::vector<int> either, edges_near;
    for (size_t a = 0; a < arms_.size(); ++a)
      near.others(static_cast<int>(a), [&](int b, const std::vector<int>& close) {
        either.clear();
        edges_near.clear();
        std::ranges::set_union(moves[a], moves[b], std::back_inserter(either));
        std::ranges::set_intersection(either, close, std::back_inserter(edges_near));
        test(edges_near, proved, [&](const std::vector<int>& edges, SegmentResult<T>* results) {
          const auto at_a = [&](int s) { return ends(path, static_cast<int>(a), edges[s]); };
          const auto at_b = [&](int s) { return ends(path, b, edges[s]); };
          prover_.pair(numbers[a], numbers[b], static_cast<int>(edges.size()), at_a, at_b, levels_, false, results,
                       &clock);
        });
        return true;
      });
    return proved;
  }

 private:
  using Ends = std::pair<const T*, const T*>;

  // Returns the ends of an edge for arm number `a` of the moving arms, or of the parked arms behind them.
  Ends ends(const std::vector<const T*>& path, int a, int edge) const {
    if (a < static_cast<int>(arms_.size())) return {path[edge] + offsets_[a], path[edge + 1] + offsets_[a]};
    const T* q = parked_[a - arms_.size()].q.data();
    return {q, q};
  }

  // Returns the numbers of the edges on which each arm moves, and fills the arms' offsets.
  std::vector<std::vector<int>> moving_edges(const std::vector<const T*>& path) {
    std::vector<std::vector<int>> out;
    offsets_.clear();
    int offset = 0;
    for (const int arm : arms_) {
      const int end = offset + cell_->arms[arm].dof;
      auto& edges = out.emplace_back();
      for (size_t k = 0; k + 1 < path.size(); ++k)
        if (!std::equal(path[k] + offset, path[k] + end, path[k + 1] + offset)) edges.push_back(static_cast<int>(k));
      offsets_.push_back(offset);
      offset = end;
    }
    out.resize(arms_.size() + parked_.size());
    return out;
  }

  // Runs a proof of some edges, and notes those that fail.
  template <class Proof>
  void test(const std::vector<int>& edges, std::vector<bool>& proved, Proof&& proof) {
    results_.assign(edges.size(), {});
    proof(edges, results_.data());
    for (size_t s = 0; s < edges.size(); ++s)
      if (!results_[s].free) proved[edges[s]] = false;
  }

  const CellModel<T>* cell_;
  Prover<V> prover_;
  std::vector<int> arms_, offsets_;
  std::vector<Parked<T>> parked_;
  Levels<T> levels_;
  std::vector<SegmentResult<T>> results_;
};

}  // namespace mmp
