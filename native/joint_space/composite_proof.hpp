// Proof of a path in the composite space.
#pragma once

#include <algorithm>
#include <vector>

#include "proof/segments.hpp"

namespace mmp {

// Proves edges between configurations of some arms: each arm alone and every pair, where one of them moves. The other
// arms of the cell are only there with their bases.
template <class V>
class CompositeProof {
 public:
  using T = Scalar<V>;
  CompositeProof(StaticWorld<V>& world, std::vector<int> arms, Levels<T> levels)
      : cell_(world.cell), prover_(world), arms_(std::move(arms)), levels_(levels) {}

  // Returns which edges path[k] -> path[k + 1] keep `levels.proof` at every instant.
  std::vector<bool> operator()(const std::vector<const T*>& path, const Clock& clock) {
    std::vector<bool> proved(path.size() - 1, true);
    const auto moves = moving_edges(path);
    for (size_t a = 0; a < arms_.size(); ++a) {
      test(path, moves[a], proved, [&](int count, auto&& of, SegmentResult<T>* results) {
        prover_.alone(arms_[a], count, of(offsets_[a]), levels_, Stop::at_first_contact_of_segment, results, &clock);
      });
      for (size_t b = a + 1; b < arms_.size(); ++b) {
        std::vector<int> either;
        std::ranges::set_union(moves[a], moves[b], std::back_inserter(either));
        test(path, either, proved, [&](int count, auto&& of, SegmentResult<T>* results) {
          prover_.pair(arms_[a], arms_[b], count, of(offsets_[a]), of(offsets_[b]), levels_, false, results, &clock);
        });
      }
    }
    return proved;
  }

 private:
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
    return out;
  }

  // Runs a proof of some edges, and notes those that fail.
  template <class Proof>
  void test(const std::vector<const T*>& path, const std::vector<int>& edges, std::vector<bool>& proved,
            Proof&& proof) {
    results_.assign(edges.size(), {});
    const auto of = [&](int offset) {
      return [&path, &edges, offset](int s) {
        return std::pair<const T*, const T*>(path[edges[s]] + offset, path[edges[s] + 1] + offset);
      };
    };
    proof(static_cast<int>(edges.size()), of, results_.data());
    for (size_t s = 0; s < edges.size(); ++s)
      if (!results_[s].free) proved[edges[s]] = false;
  }

  const CellModel<T>* cell_;
  Prover<V> prover_;
  std::vector<int> arms_, offsets_;
  Levels<T> levels_;
  std::vector<SegmentResult<T>> results_;
};

}  // namespace mmp
