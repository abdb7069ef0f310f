// The batch queries of a cell: configurations in, numbers out.
#pragma once

#include "certificate.hpp"
#include "repulsion.hpp"
#include "si_rrt.hpp"

namespace mmp {

// The same cell in both precisions: Floats for search, Doubles for instances and proofs.
class Cell {
 public:
  CellModel<float> single, with_cores;
  CellModel<double> precise;
  std::unique_ptr<StaticWorld<Floats>> world_single, world_planning;
  std::unique_ptr<StaticWorld<Doubles>> world_precise;

  void freeze() {
    with_cores = single;
    for (auto& arm : with_cores.arms) add_core(arm);
    for (auto* cell : {&single, &with_cores})
      for (auto& arm : cell->arms) finish_arm(arm);
    for (auto& arm : precise.arms) finish_arm(arm);
    world_single = std::make_unique<StaticWorld<Floats>>(single, single);
    world_planning = std::make_unique<StaticWorld<Floats>>(single, with_cores);
    world_precise = std::make_unique<StaticWorld<Doubles>>(precise, precise);
  }

  template <class V>
  StaticWorld<V>& world() const {
    if constexpr (std::is_same_v<V, Floats>) return *world_single;
    else return *world_precise;
  }

 private:
  // Adds to the base what the first link fills at every angle: a sphere at distance d from the first joint's axis
  // always covers the one of radius r - d on the axis. Only the base of such a model is ever used.
  static void add_core(ArmModel<float>& arm) {
    const auto& first = arm.fixed[0];
    std::vector<Sphere<float>> spheres;
    const auto base = arm.links[0].spheres, link = arm.links[1].spheres;
    spheres.assign(arm.spheres.begin() + base.first, arm.spheres.begin() + base.first + base.count);
    for (int i = link.first; i < link.first + link.count; ++i) {
      const auto& s = arm.spheres[i];
      const float r = s.r - std::sqrt(s.x * s.x + s.y * s.y);
      if (arm.links[1].frame == 1 && r > 0.01f)
        spheres.push_back(
            {first.p[0] + first.r[2] * s.z, first.p[1] + first.r[5] * s.z, first.p[2] + first.r[8] * s.z, r});
    }
    arm.spheres = std::move(spheres);
    arm.links.resize(1);
    arm.links[0].spheres = {0, static_cast<int>(arm.spheres.size())};
    arm.self_pairs.clear();
  }
};

// Rows [n][dof] of doubles, `width` at a time, into lanes; the last lanes repeat the last row.
template <class V>
void load_rows(const double* q, size_t n, size_t row, int dof, V* out) {
  for (int lane = 0; lane < width<V>; ++lane) {
    const double* p = q + std::min(row + lane, n - 1) * dof;
    for (int j = 0; j < dof; ++j) out[j][lane] = static_cast<Scalar<V>>(p[j]);
  }
}

template <class V>
void store_lanes(V value, double* out, size_t n, size_t row) {
  for (int lane = 0; lane < width<V> && row + lane < n; ++lane) out[row + lane] = value[lane];
}

inline constexpr double kFar = 1e3;  // [m], the clearance of what has nothing to touch

template <class V>
void static_clearance(const Cell& cell, int a, const double* q, size_t n, double* out) {
  auto& world = cell.world<V>();
  Pose<V> pose(world.cell->arms[a]);
  V joints[kMaxDof];
  for (size_t k = 0; k < n; k += width<V>) {
    load_rows(q, n, k, pose.arm->dof, joints);
    forward(joints, pose);
    V best = splat<V>(Scalar<V>(kFar));
    world.lower(a, pose, best);
    store_lanes(best, out, n, k);
  }
}

template <class V>
void pair_clearance(const Cell& cell, int a, const double* qa, int b, const double* qb, size_t n, double* out) {
  auto& world = cell.world<V>();
  Pose<V> pa(world.cell->arms[a]), pb(world.cell->arms[b]);
  V joints[kMaxDof];
  for (size_t k = 0; k < n; k += width<V>) {
    load_rows(qa, n, k, pa.arm->dof, joints);
    forward(joints, pa);
    load_rows(qb, n, k, pb.arm->dof, joints);
    forward(joints, pb);
    V best = splat<V>(Scalar<V>(kFar));
    lower_pair_clearance(pa, pb, true, best);
    store_lanes(best, out, n, k);
  }
}

// Least clearance of whole states: all pairs of arms (with their bases), and obstacles where asked for.
//
// The bounds of all link pairs come first; the pair that looks closest is worked out at once, so that nearly all others
// are passed over by their bounds.
template <class V>
class CellClearance {
 public:
  using T = Scalar<V>;
  explicit CellClearance(const Cell& cell) : world_(&cell.world<V>()) {
    for (const auto& arm : world_->cell->arms) poses_.emplace_back(arm);
    for (size_t a = 0; a < poses_.size(); ++a)
      for (size_t b = a + 1; b < poses_.size(); ++b)
        for (size_t i = 0; i < poses_[a].arm->links.size(); ++i)
          for (size_t j = i == 0 ? 1 : 0; j < poses_[b].arm->links.size(); ++j) {
            const T radii = poses_[a].arm->links[i].bound.r + poses_[b].arm->links[j].bound.r;
            pairs_.push_back({int(a), int(i), int(b), int(j), radii, T(1) / (radii * radii)});
          }
    gaps2_.resize(pairs_.size());
  }

  V operator()(const std::vector<const double*>& q, size_t n, size_t row, bool obstacles) {
    V joints[kMaxDof];
    for (size_t a = 0; a < poses_.size(); ++a) {
      load_rows(q[a], n, row, poses_[a].arm->dof, joints);
      forward(joints, poses_[a]);
    }
    V best = closest_looking();
    for (size_t k = 0; k < pairs_.size(); ++k) {
      const V limit = best + pairs_[k].radii;
      if (bits<V>(gaps2_[k] < limit * limit)) lower(pairs_[k], best);
    }
    if (obstacles)
      for (size_t a = 0; a < poses_.size(); ++a)
        for (size_t l = 1; l < poses_[a].arm->links.size(); ++l)
          for (const auto& o : world_->cell->obstacles) lower_clearance(poses_[a], static_cast<int>(l), o, best);
    return best;
  }

 private:
  struct LinkPair {
    int a, i, b, j;
    T radii, inverse2;  // of the bounds: sum, and its inverse square
  };

  void lower(const LinkPair& p, V& best) { lower_clearance(poses_[p.a], p.i, poses_[p.b], p.j, best); }

  V closest_looking() {
    V best = splat<V>(T(kFar)), least = best, which{}, number{};
    for (size_t k = 0; k < pairs_.size(); ++k) {
      const auto& p = pairs_[k];
      const auto d = poses_[p.a].link[p.i] - poses_[p.b].link[p.j];
      gaps2_[k] = dot(d, d);
      // Squared gap over squared radii: a stand-in for the bound that needs no root.
      const V looks = gaps2_[k] * p.inverse2;
      const Mask<V> closer_now = looks < least;
      least = select<V>(closer_now, looks, least);
      which = select<V>(closer_now, number, which);
      number += T(1);
    }
    if (pairs_.empty()) return best;
    for (int lane = 0; lane < width<V>; ++lane) lower(pairs_[static_cast<size_t>(which[lane])], best);
    return best;
  }

  StaticWorld<V>* world_;
  std::vector<Pose<V>> poses_;
  std::vector<LinkPair> pairs_;
  std::vector<V> gaps2_;  // between the centres of the bounds
};

}  // namespace mmp
