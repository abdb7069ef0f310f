// Conflicts of two motions that may run at any times: the volumes that they sweep, step against step.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/swept_distance.hpp"

namespace mmp {

// Tells which steps of two motions may come closer than a distance, whenever the arms do them.
//
// First boxes around all moving links in each step decide, then spheres. Those of the first arm stand in the middle of
// their chord, grown by half its length and by the deviation of the true arc. Those of the second arm move along their
// chord, grown by the deviation. Hulls lie inside of the spheres.
template <class V>
class SweptConflicts {
 public:
  using T = Scalar<V>;

  SweptConflicts(const Motion<V>& a, const Motion<V>& b, T distance) : a_(a), b_(b), distance_(distance) {
    if (!a.whole.near(b.whole, distance + kRounding)) return;
    for (int i = static_cast<int>(a.boxes.size()); i-- > 1;)
      for (int j = static_cast<int>(b.boxes.size()); j-- > 1;)
        if (may_be_near(i, a.boxes[i], j, b.boxes[j])) near_links_.push_back({i, j});
    if (any_near()) near_in_blocks_.resize(a.block_count() * chunks());
  }

  int rows() const { return std::max(a_.last, 1); }
  int columns() const { return std::max(b_.last, 1); }
  bool any_near() const { return !near_links_.empty(); }

  // Returns a byte for each step of the first motion (rows) and of the second (columns): 1 if they may conflict. A
  // motion of one configuration counts as one step.
  std::vector<uint8_t> matrix() {
    std::vector<uint8_t> out(static_cast<size_t>(rows()) * columns(), 0);
    for (int s = 0; s < rows() && any_near(); ++s) {
      for (int t = 0; t < columns(); t += width<V>) {
        unsigned found = test(s, t, first_lanes<V>(std::min(columns() - t, width<V>)));
        for (; found; found &= found - 1) out[static_cast<size_t>(s) * columns() + t + std::countr_zero(found)] = 1;
      }
    }
    return out;
  }

  // Returns the lanes of `asked`, steps t, t + 1, ... of the second motion, that may conflict with step s of the first.
  // t is a multiple of the number of lanes.
  unsigned test(int s, int t, unsigned asked) {
    asked &= a_.box_at(s).near(b_.boxes_at(t), splat<V>(distance_ + kRounding));
    if (!asked) return 0;
    if (s != row_) growth_.assign(a_.arm->links.size(), T(-1));
    row_ = s;
    auto& near = near_links(a_.block_of(s), t / width<V>);
    unsigned found = 0;
    for (size_t n = 0; n < near.size() && found != asked; ++n) {
      const auto [i, j] = near[n];
      if (growth_[i] < 0) growth_[i] = growth(i, s);
      const V far = splat<V>(distance_ + kRounding + growth_[i]) + b_.deviation_at(j, t);
      const auto middle = [&](auto array, int e) {
        const auto chord = a_.chord_at(a_.*array, e, s);
        return Chord<V>{chord.from + chord.along * splat<V>(T(0.5)), {V{}, V{}, V{}}};
      };
      const auto moving = [&](auto array, int e) { return b_.chord(b_.*array, e, t); };
      found |= links_near<V>(*a_.arm, i, middle, *b_.arm, j, moving, far, asked & ~found);
      if (found == asked) std::rotate(near.begin(), near.begin() + n, near.begin() + n + 1);
    }
    return found;
  }

 private:
  static constexpr T kRounding = T(1e-5);  // [m]

  using Links = std::vector<std::pair<int, int>>;

  size_t chunks() const { return static_cast<size_t>((columns() + width<V> - 1) / width<V>); }

  // Returns the links that come close in a block of steps of the first motion and the steps of the second in all lanes.
  Links& near_links(int block_a, int chunk) {
    auto& out = near_in_blocks_[block_a * chunks() + chunk];
    if (out) return *out;
    out.emplace();
    const int first = b_.block_of(chunk * width<V>), last = b_.block_of((chunk + 1) * width<V> - 1);
    for (const auto& [i, j] : near_links_)
      for (int block = first; block <= last; ++block)
        if (may_be_near(i, a_.blocks[i * a_.block_count() + block_a], j, b_.blocks[j * b_.block_count() + block])) {
          out->push_back({i, j});
          break;
        }
    return *out;
  }

  bool may_be_near(int i, const Box<T>& box_a, int j, const Box<T>& box_b) const {
    const auto &A = a_.arm->links[i], &B = b_.arm->links[j];
    if (A.spheres.count == 0 || B.spheres.count == 0) return false;
    const T reach = distance_ + kRounding + a_.max_deviation[i] + b_.max_deviation[j];
    return box_a.near(box_b, reach + A.bound.r + B.bound.r);
  }

  // Returns how far centres of a link are at most from the middle of their chords in a step.
  T growth(int i, int s) const {
    const auto& link = a_.arm->links[i];
    T most = half_chord(a_.links, i, s);
    for (int g = link.groups.first; g < link.groups.first + link.groups.count; ++g)
      most = std::max(most, half_chord(a_.groups, g, s));
    for (int k = link.spheres.first; k < link.spheres.first + link.spheres.count; ++k)
      most = std::max(most, half_chord(a_.spheres, k, s));
    return most + a_.deviation[static_cast<size_t>(i) * a_.stride + std::min(s, a_.last)];
  }

  T half_chord(const Unfilled<T>& array, int e, int s) const {
    const T* p = array.data() + static_cast<size_t>(e) * 3 * a_.stride + s;
    const int next = s < a_.last ? 1 : 0;
    T sum = 0;
    for (int x = 0; x < 3; ++x, p += a_.stride) sum += (p[next] - p[0]) * (p[next] - p[0]);
    return std::sqrt(sum) / 2;
  }

  const Motion<V>&a_, &b_;
  T distance_;
  Links near_links_;                                  // links that ever come close
  std::vector<std::optional<Links>> near_in_blocks_;  // those that do in blocks of steps, the last contact first
  std::vector<T> growth_;                             // [link] in step `row_`; negative: not computed
  int row_ = -1;
};

}  // namespace mmp
