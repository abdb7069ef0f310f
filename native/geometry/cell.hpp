// The cell and its batch queries: configurations in, numbers out.
#pragma once

#include <memory>

#include "geometry/static_world.hpp"

namespace mmp {

// Two links of two arms: indices of their bounds in a flat array of all links, and the sum of the bounds' radii.
struct LinkPair {
  int at_a, at_b, a, i, b, j;
  float radii, inverse2;  // sum of the radii, and its inverse square
};

// The same cell in both precisions: Floats for search, Doubles for instances and proofs.
class Cell {
 public:
  CellModel<float> single, with_cores;
  CellModel<double> precise;
  std::unique_ptr<StaticWorld<Floats>> world_single, world_planning;
  std::unique_ptr<StaticWorld<Doubles>> world_precise;
  std::vector<LinkPair> link_pairs;
  bool frozen = false;

  // Returns the hull of these vertices grown by a ball: one that arms or obstacles have already, or a new one.
  std::shared_ptr<const ConvexHull> hull(std::vector<Point> vertices, double radius) {
    for (const auto& known : hulls_)
      if (known->is_of(vertices, radius)) return known;
    return hulls_.emplace_back(std::make_shared<ConvexHull>(std::move(vertices), radius));
  }

  void freeze() {
    frozen = true;
    with_cores = single;
    for (auto& arm : with_cores.arms) add_core(arm);
    for (auto* cell : {&single, &with_cores})
      for (auto& arm : cell->arms) finish_arm(arm);
    for (auto& arm : precise.arms) finish_arm(arm);
    world_single = std::make_unique<StaticWorld<Floats>>(single, single);
    world_planning = std::make_unique<StaticWorld<Floats>>(single, with_cores);
    world_precise = std::make_unique<StaticWorld<Doubles>>(precise, precise);
    const int arms = static_cast<int>(single.arms.size());
    for (int a = 0; a < arms; ++a)
      for (int b = a + 1; b < arms; ++b) pair_links(a, b);
  }

  template <class V>
  StaticWorld<V>& world() const {
    if constexpr (std::is_same_v<V, Floats>) return *world_single;
    else return *world_precise;
  }

 private:
  Hulls hulls_;  // all of them, each once

  void pair_links(int a, int b) {
    const auto &la = single.arms[a].links, &lb = single.arms[b].links;
    for (int i = 0; i < static_cast<int>(la.size()); ++i)
      for (int j = i == 0 ? 1 : 0; j < static_cast<int>(lb.size()); ++j) {
        if (la[i].spheres.count == 0 || lb[j].spheres.count == 0) continue;
        const float radii = la[i].bound.r + lb[j].bound.r;
        link_pairs.push_back({a * kMaxLinks + i, b * kMaxLinks + j, a, i, b, j, radii, 1.0f / (radii * radii)});
      }
  }

  // Adds to the base the volume that the first link fills at every angle of a hinge: a sphere at distance d from the
  // first joint's axis always covers the sphere of radius r - d on the axis. Only the base of such a model is used.
  static void add_core(ArmModel<float>& arm) {
    std::vector<Sphere<float>> spheres;
    const auto base = arm.links[0].spheres, link = arm.links[1].spheres;
    spheres.assign(arm.spheres.begin() + base.first, arm.spheres.begin() + base.first + base.count);
    Hulls hulls(arm.hulls.begin(), arm.hulls.begin() + arm.links[0].hulls.count);
    if (arm.links[1].frame != 1 || arm.slides(0)) {
    } else if (arm.links[1].hulls.count == 0) {
      for (int i = link.first; i < link.first + link.count; ++i) {
        const auto& s = arm.spheres[i];
        const float r = s.r - std::sqrt(s.x * s.x + s.y * s.y);
        if (r > 0.01f) spheres.push_back(on_first_axis(arm, s.z, r));
      }
    } else if (!hulls.empty()) {  // a base without hulls would become one with the core's alone
      add_hull_core(arm, spheres, hulls);
    }
    arm.spheres = std::move(spheres);
    arm.hulls = std::move(hulls);
    arm.links.resize(1);
    arm.links[0].spheres = {0, static_cast<int>(arm.spheres.size())};
    arm.links[0].hulls = {0, static_cast<int>(arm.hulls.size())};
    arm.self_pairs.clear();
  }

  // Adds a capsule on the first joint's axis that lies in a hull of the first link, and spheres that cover it.
  static void add_hull_core(ArmModel<float>& arm, std::vector<Sphere<float>>& spheres, Hulls& hulls) {
    const Range own = arm.links[1].hulls;
    for (int h = own.first; h < own.first + own.count; ++h) {
      const auto core = capsule_inside(*arm.hulls[h]);
      if (!core) continue;
      const int count = static_cast<int>(std::ceil((core->high - core->low) / core->radius)) + 1;
      const double step = count > 1 ? (core->high - core->low) / (count - 1) : 0;
      const double r = std::hypot(core->radius, step / 2);
      std::vector<Point> ends;
      for (int k = 0; k < count; ++k) {
        const auto s = on_first_axis(arm, float(core->low + k * step), float(r));
        spheres.push_back(s);
        if (k == 0 || k == count - 1) ends.push_back({s.x, s.y, s.z});
      }
      hulls.push_back(std::make_shared<ConvexHull>(std::move(ends), core->radius - kCoreRounding));
      arm.links[0].protrusion = std::max(arm.links[0].protrusion, float(r - core->radius + 2 * kCoreRounding));
    }
  }
  static constexpr double kCoreRounding = 1e-5;  // [m]

  static Sphere<float> on_first_axis(const ArmModel<float>& arm, float height, float radius) {
    const auto& t = arm.fixed[0];
    return {t.p[0] + t.r[2] * height, t.p[1] + t.r[5] * height, t.p[2] + t.r[8] * height, radius};
  }
};

// Loads `width` rows [n][dof] of doubles into lanes. The last lanes repeat the last row.
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

inline constexpr double kFar = 1e3;  // clearance [m] of a body that has nothing to touch

template <class V>
void static_clearance(const Cell& cell, int a, const double* q, size_t n, double* out) {
  auto& world = cell.world<V>();
  Pose<V> pose(world.cell->arms[a]);
  V joints[kMaxDof];
  for (size_t k = 0; k < n; k += width<V>) {
    load_rows(q, n, k, pose.arm->dof, joints);
    forward(joints, pose);
    V best = splat<V>(Scalar<V>(kFar));
    world.lower(a, pose, {}, best);
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

// Least clearance of whole states: all pairs of arms (bases included), and obstacles on request.
//
// The bounds of all link pairs come first. The pair with the closest bounds is computed at once, so that the bounds
// rule out nearly all other pairs.
class CellClearance {
 public:
  using V = Floats;
  explicit CellClearance(const Cell& cell) : cell_(&cell), centers_(cell.single.arms.size() * kMaxLinks) {
    for (const auto& arm : cell.single.arms) poses_.emplace_back(arm);
    gaps2_.resize(cell.link_pairs.size());
  }

  V operator()(const std::vector<const double*>& q, size_t n, size_t row, bool obstacles) {
    V joints[kMaxDof];
    for (size_t a = 0; a < poses_.size(); ++a) {
      load_rows(q[a], n, row, poses_[a].arm->dof, joints);
      forward(joints, poses_[a]);
      std::copy_n(poses_[a].link, poses_[a].arm->links.size(), centers_.begin() + a * kMaxLinks);
    }
    V best = closest_looking();
    for (size_t k = 0; k < gaps2_.size(); ++k) {
      const V limit = best + cell_->link_pairs[k].radii;
      if (bits<V>(gaps2_[k] < limit * limit)) lower(cell_->link_pairs[k], best);
    }
    if (obstacles)
      for (size_t a = 0; a < poses_.size(); ++a)
        for (int l = 1; l < static_cast<int>(poses_[a].arm->links.size()); ++l)
          for (const auto& o : cell_->single.obstacles)
            if (!o.lets_touch(static_cast<int>(a), l)) lower_clearance(poses_[a], l, o, best);
    return best;
  }

 private:
  void lower(const LinkPair& p, V& best) { lower_clearance(poses_[p.a], p.i, poses_[p.b], p.j, best); }

  V closest_looking() {
    V best = splat<V>(float(kFar)), least = best, which{}, number{};
    const auto* centers = centers_.data();
    const auto* pairs = cell_->link_pairs.data();
    V* gaps2 = gaps2_.data();
    const size_t count = gaps2_.size();
    for (size_t k = 0; k < count; ++k) {
      const auto d = centers[pairs[k].at_a] - centers[pairs[k].at_b];
      const V gap2 = dot(d, d);
      gaps2[k] = gap2;
      // Squared gap over squared radii: ranks pairs like the bound, without a square root.
      const V looks = gap2 * pairs[k].inverse2;
      const Mask<V> closer_now = looks < least;
      least = select<V>(closer_now, looks, least);
      which = select<V>(closer_now, number, which);
      number += 1.0f;
    }
    if (count > 0)
      for (int lane = 0; lane < width<V>; ++lane) lower(pairs[static_cast<size_t>(which[lane])], best);
    return best;
  }

  const Cell* cell_;
  std::vector<Pose<V>> poses_;
  std::vector<Vec3<V>> centers_;  // of the bounds of all links, kMaxLinks per arm
  std::vector<V> gaps2_;          // squared distances between the centres of each pair
};

}  // namespace mmp
