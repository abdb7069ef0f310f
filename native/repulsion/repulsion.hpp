// Repulsive force of APF-ECBS between the spheres of two arms, and the resulting joint torques (forces of slides).
// On request the force has the direction between the links' hulls near contact.
#pragma once

#include <vector>

#include "geometry/collision.hpp"
#include "geometry/link_distance.hpp"
#include "geometry/motion.hpp"

namespace mmp {

// Settings of the force field, and of the descent along it (ModifyMotion).
struct RepulsionSettings {
  double k_rep = 0.05;           // gain of the force
  double d0 = 0.10;              // range of the force [m]
  bool centre_distance = false;  // paper-literal: distances between centres instead of surfaces
  double alpha = 1e-7;           // step of the descent
  int max_iterations = 50;
  bool normalised = false;        // fixed largest step, forces smoothed over time
  double normalised_step = 0.03;  // largest step of a normalised iteration [rad]
  double floor = 0.01;            // distance below which the force is constant [m]; 0: none
  double max_step = 0.05;         // cap per joint and iteration [rad]; 0: none
  double stretch = 3;             // longest step between waypoints, relative to full speed; 0: any
  double comfort = 0.02;          // clearance that ends the descent [m]; negative: never
  double exact_within = 0;        // distance of hulls below which they give the direction of the force [m]; 0: never
  int halvings = 0;               // how often a step that would end the descent is halved first
};

template <class V>
class Repulsion {
 public:
  using T = Scalar<V>;
  explicit Repulsion(const RepulsionSettings& settings) : settings_(settings) {}

  // Computes joint forces J^T F at every inner step of `motion`, [last + 1][dof], zero at the ends.
  void force(const Motion<V>& motion, const std::vector<const Motion<V>*>& others, std::vector<T>& out) {
    const int dof = motion.arm->dof;
    out.assign(static_cast<size_t>(motion.last + 1) * dof, T(0));
    find_near_links(motion, others);
    Pose<V> pose(*motion.arm);
    for (int k = 0; k <= motion.last; k += width<V>) {
      Vec3<V> push[kMaxDof + 1], moment[kMaxDof + 1];
      for (int f = 0; f <= dof; ++f) push[f] = moment[f] = {V{}, V{}, V{}};
      bool any = false;
      for (const auto& pair : near_) any |= push_from(motion, pair, k, push, moment);
      if (any) transpose_jacobian(motion, pose, k, push, moment, out);
    }
    std::fill_n(out.begin(), dof, T(0));
    std::fill_n(out.end() - dof, dof, T(0));
  }

 private:
  // A moving link, and a link of another arm that is in range of it at some step.
  struct NearLinks {
    const Motion<V>* other;
    int link, other_link;
  };

  // Lists the pairs of links whose boxes over all steps are in range; most arms of a large cell are far away.
  void find_near_links(const Motion<V>& m, const std::vector<const Motion<V>*>& others) {
    constexpr T rounding = T(1e-4);  // [m]
    const T d0 = T(settings_.d0) + rounding;
    near_.clear();
    for (const auto* o : others) {
      const auto& base = o->arm->links[0].bound;
      const Box<T> foot{{base.x, base.y, base.z}, {base.x, base.y, base.z}};
      if (!m.whole.near(o->whole, d0) && !m.whole.near(foot, d0 + base.r)) continue;
      for (int i = 1; i < static_cast<int>(m.arm->links.size()); ++i)
        for (int j = 0; j < static_cast<int>(o->arm->links.size()); ++j) {
          const T reach = d0 + m.arm->links[i].bound.r + o->arm->links[j].bound.r;
          if (m.boxes[i].near(j == 0 ? foot : o->boxes[j], reach)) near_.push_back({o, i, j});
        }
    }
  }

  // Adds the forces of another arm's link to the frames of this arm. Moments are about the world's origin.
  bool push_from(const Motion<V>& m, const NearLinks& pair, int k, Vec3<V>* push, Vec3<V>* moment) {
    const auto& o = *pair.other;
    const auto &A = m.arm->links[pair.link], &B = o.arm->links[pair.other_link];
    const bool fixed_b = pair.other_link == 0;
    const auto cb = fixed_b ? fixed(B.bound) : o.centers(o.links, pair.other_link, k);
    const V reach = splat<V>(T(settings_.d0)) + (A.bound.r + B.bound.r);
    if (!bits<V>(closer(m.centers(m.links, pair.link, k), cb, reach))) return false;
    const Vec3<V> push_before = push[A.frame], moment_before = moment[A.frame];
    Visitor visitor{{}, settings_, m, o, fixed_b, k, push[A.frame], moment[A.frame]};
    visit_sphere_pairs(*m.arm, pair.link, *o.arm, pair.other_link, visitor);
    if (settings_.exact_within > 0 && exact(*m.arm, pair.link, *o.arm, pair.other_link))
      turn_forces(m, pair, k, push_before, moment_before, visitor);
    return visitor.any;
  }

  // Sums the forces of one arm's spheres on another arm's link. A base (`fixed_b`) does not move.
  struct Visitor : SpherePairVisitor {
    const RepulsionSettings& settings;
    const Motion<V>&a, &b;
    bool fixed_b;
    int k;
    Vec3<V>&push, &moment;
    T d0 = T(settings.d0), k_rep = T(settings.k_rep), floor = std::max(T(settings.floor), T(1e-6));
    bool any = false, near_sphere = false;
    Vec3<V> sum{V{}, V{}, V{}};
    Vec3<V> weighted_centres{V{}, V{}, V{}};  // sum of the spheres' centres, each times the size of its force
    V sizes{};                                // sum of the sizes of the forces

    MMP_INLINE Vec3<V> group_a(int g) const { return a.centers(a.groups, g, k); }
    MMP_INLINE Vec3<V> group_b(int g) const { return fixed_b ? fixed(b.arm->groups[g]) : b.centers(b.groups, g, k); }
    MMP_INLINE Vec3<V> sphere_a(int i) const { return a.centers(a.spheres, i, k); }
    MMP_INLINE Vec3<V> sphere_b(int j) const { return fixed_b ? fixed(b.arm->spheres[j]) : b.centers(b.spheres, j, k); }
    MMP_INLINE bool near(const Vec3<V>& p, T rp, const Vec3<V>& q, T rq) const {
      return bits<V>(closer(p, q, splat<V>(d0) + (rp + rq)));
    }
    MMP_INLINE void begin_sphere() {
      sum = {V{}, V{}, V{}};
      near_sphere = false;
    }
    MMP_INLINE void pair(const Vec3<V>& p, T rp, const Vec3<V>& q, T rq) {
      const auto away = p - q;
      const V d2 = dot(away, away);
      const T radii = settings.centre_distance ? T(0) : rp + rq;
      const Mask<V> in_range = d2 <= splat<V>((d0 + radii) * (d0 + radii));
      if (!bits<V>(in_range)) return;
      const V centres = max(sqrt<V>(d2), splat<V>(T(1e-6)));
      const V d = max(centres - radii, splat<V>(floor));
      const V inverse = T(1) / d;
      const V size = max(k_rep * (inverse - T(1) / d0) * inverse * inverse, V{});
      sum = sum + away * select<V>(in_range, size / centres, V{});
      near_sphere = true;
    }
    MMP_INLINE void end_sphere(const Vec3<V>& p) {
      if (!near_sphere) return;
      push = push + sum;
      moment = moment + cross(p, sum);
      if (settings.exact_within > 0) {
        const V size = sqrt<V>(dot(sum, sum));
        sizes = sizes + size;
        weighted_centres = weighted_centres + p * size;
      }
      any = true;
    }
  };

  // Turns the forces on the spheres of a link to the direction between the nearest points of the hulls, where these are
  // apart but near. The sizes of the forces stay. `push_before` and `moment_before` are without this pair of links.
  void turn_forces(const Motion<V>& m, const NearLinks& pair, int k, const Vec3<V>& push_before,
                   const Vec3<V>& moment_before, Visitor& visitor) {
    const Limits limits = Limits::measure(settings_.exact_within);
    const Mask<V> finite = visitor.sizes <= splat<V>(std::numeric_limits<T>::max());
    const unsigned pushed = bits<V>(finite & (visitor.sizes > V{}));
    for (unsigned open = pushed & first_lanes<V>(std::min(width<V>, m.last + 1 - k)); open; open &= open - 1) {
      const int lane = std::countr_zero(open);
      const auto d =
          hulls_distance(m.hulls_at(pair.link, k + lane), pair.other->hulls_at(pair.other_link, k + lane), limits);
      if (!(d.lower > 0 && d.lower < settings_.exact_within)) continue;
      const Point normal = d.between * (1 / std::sqrt(dot(d.between, d.between)));
      const auto& centres = visitor.weighted_centres;
      set_lane(visitor.push, lane, push_before, normal * double(visitor.sizes[lane]));
      set_lane(visitor.moment, lane, moment_before,
               cross(Point{centres.x[lane], centres.y[lane], centres.z[lane]}, normal));
    }
  }

  // Sets a lane to the sum of two vectors.
  static void set_lane(Vec3<V>& out, int lane, const Vec3<V>& a, const Point& b) {
    out.x[lane] = a.x[lane] + T(b.x);
    out.y[lane] = a.y[lane] + T(b.y);
    out.z[lane] = a.z[lane] + T(b.z);
  }

  void transpose_jacobian(const Motion<V>& m, Pose<V>& pose, int k, const Vec3<V>* push, const Vec3<V>* moment,
                          std::vector<T>& out) {
    const int dof = m.arm->dof;
    V joints[kMaxDof];
    for (int lane = 0; lane < width<V>; ++lane)
      for (int j = 0; j < dof; ++j) joints[j][lane] = m.at(k + lane)[j];
    forward(joints, pose);
    // From the tip inwards: a joint feels all forces beyond it.
    Vec3<V> total{V{}, V{}, V{}}, turn = total;
    for (int j = dof; j >= 1; --j) {
      total = total + push[j];
      turn = turn + moment[j];
      const auto& f = pose.frames[j];
      const Vec3<V> axis{f.r[2], f.r[5], f.r[8]};
      const V torque = m.arm->slides(j - 1) ? dot(axis, total) : dot(axis, turn - cross(f.p, total));
      for (int lane = 0; lane < width<V> && k + lane <= m.last; ++lane)
        out[static_cast<size_t>(k + lane) * dof + (j - 1)] = torque[lane];
    }
  }

  static Vec3<V> fixed(const Sphere<T>& s) { return {splat<V>(s.x), splat<V>(s.y), splat<V>(s.z)}; }

  RepulsionSettings settings_;
  std::vector<NearLinks> near_;
};

}  // namespace mmp
