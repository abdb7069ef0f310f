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
        spheres.push_back({first.p[0] + first.r[2] * s.z, first.p[1] + first.r[5] * s.z, first.p[2] + first.r[8] * s.z, r});
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
  }

  V operator()(const std::vector<const double*>& q, size_t n, size_t row, bool obstacles) {
    V joints[kMaxDof];
    for (size_t a = 0; a < poses_.size(); ++a) {
      load_rows(q[a], n, row, poses_[a].arm->dof, joints);
      forward(joints, poses_[a]);
    }
    V best = closest_looking();
    for (const auto& pair : pairs_)
      if (bits<V>(pair.gap2 < (best + pair.radii) * (best + pair.radii)))
        lower_clearance(poses_[pair.a], pair.i, poses_[pair.b], pair.j, best);
    if (obstacles)
      for (size_t a = 0; a < poses_.size(); ++a)
        for (size_t l = 1; l < poses_[a].arm->links.size(); ++l)
          for (const auto& o : world_->cell->obstacles) lower_clearance(poses_[a], static_cast<int>(l), o, best);
    return best;
  }

 private:
  struct LinkPair {
    int a, i, b, j;
    T radii;
    V gap2;
  };

  V closest_looking() {
    pairs_.clear();
    V least = splat<V>(T(kFar));
    V which{};
    for (size_t a = 0; a < poses_.size(); ++a)
      for (size_t b = a + 1; b < poses_.size(); ++b) {
        const auto &la = poses_[a].arm->links, &lb = poses_[b].arm->links;
        for (size_t i = 0; i < la.size(); ++i)
          for (size_t j = 0; j < lb.size(); ++j) {
            if (i + j == 0) continue;
            const auto d = poses_[a].link[i] - poses_[b].link[j];
            const V gap2 = dot(d, d);
            const T radii = la[i].bound.r + lb[j].bound.r;
            // Squared gap over squared radii: a cheap stand-in for the bound that needs no root.
            const V looks = gap2 * (T(1) / (radii * radii));
            const Mask<V> closer_now = looks < least;
            least = select<V>(closer_now, looks, least);
            which = select<V>(closer_now, splat<V>(T(pairs_.size())), which);
            pairs_.push_back({int(a), int(i), int(b), int(j), radii, gap2});
          }
      }
    V best = splat<V>(T(kFar));
    if (pairs_.empty()) return best;
    for (int lane = 0; lane < width<V>; ++lane) {
      const auto& p = pairs_[static_cast<size_t>(which[lane])];
      lower_clearance(poses_[p.a], p.i, poses_[p.b], p.j, best);
    }
    return best;
  }

  StaticWorld<V>* world_;
  std::vector<Pose<V>> poses_;
  std::vector<LinkPair> pairs_;
};

}  // namespace mmp
