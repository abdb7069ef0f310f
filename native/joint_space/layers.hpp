// Puts proved edges of a path side by side, so that arms that stay apart move at the same time.
#pragma once

#include <algorithm>
#include <deque>
#include <vector>

#include "proof/near_arms.hpp"

namespace mmp {

// The edges of a path in layers. The edges of a layer take place at the same time. An edge comes in the layer after the
// last edge before it that moves one of its arms, or an arm that may come close. So if the order of two edges changes,
// the boxes around their arms are apart, and the path is free in both orders.
template <class V>
class Layers {
 public:
  using T = Scalar<V>;
  Layers(const CellModel<T>& cell, std::vector<int> offsets, T gap)
      : cell_(&cell), offsets_(std::move(offsets)), gap_(gap + kBoxSlack<T>) {}

  // Returns the path with its edges in layers. `path`: states of all joints.
  std::deque<std::vector<T>> operator()(const std::deque<std::vector<T>>& path) {
    std::deque<std::vector<T>> out{path[0]};
    std::vector<std::vector<Move>> layers;
    for (size_t k = 0; k + 1 < path.size(); ++k) {
      const auto moves = moves_on(path[k], path[k + 1]);
      size_t layer = layers.size();
      while (layer > 0 && !any_near(moves, layers[layer - 1])) --layer;
      if (layer == layers.size()) {
        layers.emplace_back();
        out.push_back(out.back());
      }
      for (const auto& move : moves) {
        layers[layer].push_back(move);
        const auto end = path[k + 1].begin() + offsets_[move.arm];
        for (size_t later = layer + 1; later < out.size(); ++later)
          std::copy_n(end, cell_->arms[move.arm].dof, out[later].begin() + offsets_[move.arm]);
      }
    }
    return out;
  }

 private:
  struct Move {
    int arm;
    Box<T> box;
  };

  std::vector<Move> moves_on(const std::vector<T>& from, const std::vector<T>& to) {
    std::vector<Move> out;
    for (size_t a = 0; a < offsets_.size(); ++a) {
      const auto& arm = cell_->arms[a];
      const T *p = from.data() + offsets_[a], *q = to.data() + offsets_[a];
      if (std::equal(p, p + arm.dof, q)) continue;
      out.push_back({static_cast<int>(a), box(arm, p, q)});
    }
    return out;
  }

  Box<T> box(const ArmModel<T>& arm, const T* p, const T* q) {
    Box<T> out;
    const auto at = [&](int) { return std::pair(p, q); };
    pieces_.clear();
    split(pieces_, 1, arm.dof, at);
    Pose<V> pose(arm);
    for (size_t k = 0; k < pieces_.size(); k += width<V>) {
      const int count = static_cast<int>(std::min<size_t>(width<V>, pieces_.size() - k));
      batch_.set(&pieces_[k], count, arm.dof, at);
      forward(batch_.middle, pose);
      sweep_.set(pose, batch_.middle, batch_.half);
      visit_bounds<V>(
          pose, count, [&](int l) { return sweep_.reach(pose, l); },
          [&](int, int axis, T low, T high) { out.include(axis, low, high); });
    }
    return out;
  }

  bool any_near(const std::vector<Move>& some, const std::vector<Move>& others) const {
    for (const auto& a : some)
      for (const auto& b : others)
        if (a.arm == b.arm || a.box.near(b.box, gap_)) return true;
    return false;
  }

  const CellModel<T>* cell_;
  std::vector<int> offsets_;
  T gap_;
  std::vector<Piece<T>> pieces_;
  PieceBatch<V> batch_;
  Sweep<V> sweep_;
};

}  // namespace mmp
