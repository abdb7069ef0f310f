// Small covers of samples by candidates: a greedy choice, and a local search with weights that makes it smaller.
//
// The search is RWLS (Gao, Weise, Li: "An efficient local search heuristic with row weighting for the unicost set
// covering problem", EJOR 2015). It takes a candidate out whenever all samples are covered. Then it exchanges
// candidates until they are again. Samples that stay uncovered gain weight. Weights are whole numbers, so that sums of
// them have no rounding.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace mmp::covers {

class SetCover {
 public:
  using Numbers = std::vector<int32_t>;

  // Sample samples[k] is covered by candidate candidates[k].
  SetCover(std::span<const int32_t> samples, std::span<const int32_t> candidates, size_t sample_count,
           size_t candidate_count)
      : of_sample_(samples, candidates, sample_count),
        of_candidate_(candidates, samples, candidate_count),
        weight_(sample_count, 1),
        count_(sample_count, 0),
        score_(candidate_count),
        changed_(candidate_count, -kTabuSteps),
        is_chosen_(candidate_count, 0) {
    for (size_t k = 0; k < candidate_count; ++k) score_[k] = static_cast<int64_t>(of_candidate_.of(k).size());
  }

  const Numbers& chosen() const { return chosen_; }  // in ascending order

  // Chooses candidates, and further ones greedily until all samples are covered that can be.
  void start(std::span<const int32_t> chosen) {
    for (const int32_t candidate : chosen)
      if (!is_chosen_[candidate]) add(candidate, -kTabuSteps);
    while (!open().empty()) {
      int32_t best = -1;
      for (size_t k = 0; k < score_.size(); ++k)
        if (!is_chosen_[k] && (best < 0 || score_[k] > score_[best])) best = static_cast<int32_t>(k);
      add(best, -kTabuSteps);
    }
  }

  // Searches for a smaller choice, and keeps the smallest that covers all samples. Each step takes one of `draws`,
  // numbers from 0 to below 1.
  void shrink(std::span<const double> draws) {
    Numbers best = chosen_;
    const auto steps = static_cast<int32_t>(std::min(draws.size(), kStepsOfEach * best.size()));
    for (int32_t step = 0; step < steps; ++step) {
      while (open().empty()) {
        best = chosen_;
        if (best.size() <= 1) return;
        remove(least_loss(step), -kTabuSteps);
      }
      if (!chosen_.empty()) remove(least_loss(step), step);
      const Numbers& uncovered = open();
      const auto drawn = static_cast<size_t>(draws[step] * static_cast<double>(uncovered.size()));
      add(best_of(of_sample_.of(uncovered[std::min(drawn, uncovered.size() - 1)]), step), step);
      make_heavier(open());
    }
    if (!open().empty() || chosen_.size() > best.size()) chosen_ = best;
  }

 private:
  static constexpr int32_t kTabuSteps = 3;
  static constexpr size_t kStepsOfEach = 8;  // search steps for each chosen candidate: small covers need few

  // For each key the list of its values.
  class Lists {
   public:
    Lists(std::span<const int32_t> keys, std::span<const int32_t> values, size_t count)
        : begin_(count + 1, 0), values_(values.size()) {
      for (const int32_t key : keys) ++begin_[static_cast<size_t>(key) + 1];
      std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
      std::vector<size_t> next(begin_.begin(), begin_.end() - 1);
      for (size_t k = 0; k < keys.size(); ++k) values_[next[keys[k]]++] = values[k];
    }
    std::span<const int32_t> of(size_t key) const {
      return {values_.data() + begin_[key], values_.data() + begin_[key + 1]};
    }

   private:
    std::vector<size_t> begin_;
    Numbers values_;
  };

  // Returns the samples that are not covered and could be, in ascending order.
  const Numbers& open() {
    if (open_is_old_) {
      open_.clear();
      for (size_t k = 0; k < count_.size(); ++k)
        if (count_[k] == 0 && !of_sample_.of(k).empty()) open_.push_back(static_cast<int32_t>(k));
      open_is_old_ = false;
    }
    return open_;
  }

  // Returns the chosen candidate that leaves least uncovered; of several that which changed first. Those that were
  // chosen in the last steps come last.
  int32_t least_loss(int32_t step) const {
    const auto is_old = [&](int32_t k) { return changed_[k] < step - kTabuSteps; };
    const bool any_old = std::ranges::any_of(chosen_, is_old);
    int32_t best = -1;
    for (const int32_t k : chosen_)
      if ((!any_old || is_old(k)) &&
          (best < 0 || score_[k] < score_[best] || (score_[k] == score_[best] && changed_[k] < changed_[best])))
        best = k;
    return best;
  }

  // Returns the candidate that covers most; of several that which changed first. Those of this step come last.
  int32_t best_of(std::span<const int32_t> choice, int32_t step) const {
    const auto is_old = [&](int32_t k) { return changed_[k] < step; };
    const bool any_old = std::ranges::any_of(choice, is_old);
    int32_t best = -1;
    for (const int32_t k : choice)
      if ((!any_old || is_old(k)) &&
          (best < 0 || score_[k] > score_[best] || (score_[k] == score_[best] && changed_[k] < changed_[best])))
        best = k;
    return best;
  }

  void add(int32_t candidate, int32_t step) {
    int64_t gain = 0;
    for (const int32_t row : of_candidate_.of(candidate)) {
      const int32_t before = count_[row]++;
      if (before == 0) {
        gain += weight_[row];
        for (const int32_t other : of_sample_.of(row)) score_[other] -= weight_[row];
      } else if (before == 1) {
        for (const int32_t other : of_sample_.of(row))
          if (is_chosen_[other]) score_[other] -= weight_[row];
      }
    }
    is_chosen_[candidate] = 1, changed_[candidate] = step, score_[candidate] = gain;
    chosen_.insert(std::ranges::lower_bound(chosen_, candidate), candidate);
    open_is_old_ = true;
  }

  void remove(int32_t candidate, int32_t step) {
    is_chosen_[candidate] = 0, changed_[candidate] = step;
    chosen_.erase(std::ranges::lower_bound(chosen_, candidate));
    int64_t loss = 0;
    for (const int32_t row : of_candidate_.of(candidate)) {
      const int32_t left = --count_[row];
      if (left == 0) {
        loss += weight_[row];
        for (const int32_t other : of_sample_.of(row)) score_[other] += weight_[row];
      } else if (left == 1) {
        for (const int32_t other : of_sample_.of(row))
          if (is_chosen_[other]) score_[other] += weight_[row];
      }
    }
    score_[candidate] = loss;
    open_is_old_ = true;
  }

  void make_heavier(const Numbers& rows) {
    for (const int32_t row : rows) {
      ++weight_[row];
      for (const int32_t other : of_sample_.of(row)) ++score_[other];
    }
  }

  Lists of_sample_, of_candidate_;
  std::vector<int64_t> weight_;
  std::vector<int32_t> count_;  // chosen candidates that cover a sample
  std::vector<int64_t> score_;  // weight that a candidate would cover, or, if chosen, that it alone covers
  std::vector<int32_t> changed_;
  std::vector<uint8_t> is_chosen_;
  Numbers chosen_, open_;
  bool open_is_old_ = true;
};

}  // namespace mmp::covers
