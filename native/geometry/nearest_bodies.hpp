// Nearest bodies of one state, in double precision: two arms, an arm and an obstacle, two parts of one arm.
#pragma once

#include <array>

#include "geometry/cell.hpp"

namespace mmp {

struct NearestBodies {
  double clearance = kFar;
  int arm = -1, link = -1;
  int other = -1, other_link = -1;  // other arm, or obstacle, which has no links
};

enum class BodyPairKind { arms, obstacles, self };

// Ball around all links of an arm.
template <class V>
struct ArmBall {
  Vec3<V> center;
  Scalar<V> radius = 0;

  explicit ArmBall(const Pose<V>& pose) {
    const auto& links = pose.arm->links;
    Box<Scalar<V>> box;
    for (size_t l = 0; l < links.size(); ++l) box.include(pose.link[l], links[l].bound.r);
    center = {splat<V>((box.lo[0] + box.hi[0]) / 2), splat<V>((box.lo[1] + box.hi[1]) / 2),
              splat<V>((box.lo[2] + box.hi[2]) / 2)};
    for (size_t l = 0; l < links.size(); ++l)
      radius = std::max(radius, norm(pose.link[l] - center)[0] + links[l].bound.r);
  }
};

// q[arm]: [dof]. Results are ordered as `BodyPairKind`.
inline std::array<NearestBodies, 3> nearest_bodies(const Cell& cell, const std::vector<const double*>& q) {
  using V = Doubles;
  const auto& model = cell.precise;
  std::vector<Pose<V>> poses;
  for (size_t a = 0; a < model.arms.size(); ++a) {
    poses.emplace_back(model.arms[a]);
    V joints[kMaxDof];
    for (int j = 0; j < model.arms[a].dof; ++j) joints[j] = splat<V>(q[a][j]);
    forward(joints, poses[a]);
  }
  const std::vector<ArmBall<V>> balls(poses.begin(), poses.end());
  std::array<NearestBodies, 3> out;
  V best[3]{splat<V>(kFar), splat<V>(kFar), splat<V>(kFar)};
  const auto note = [&](BodyPairKind kind, int arm, int link, int other, int other_link) {
    const auto k = static_cast<size_t>(kind);
    if (best[k][0] < out[k].clearance) out[k] = {best[k][0], arm, link, other, other_link};
  };
  const int arms = static_cast<int>(poses.size());
  for (int a = 0; a < arms; ++a) {
    const int links = static_cast<int>(model.arms[a].links.size());
    for (const auto& [i, j] : model.arms[a].self_pairs) {
      lower_clearance(poses[a], i, poses[a], j, best[2]);
      note(BodyPairKind::self, a, i, a, j);
    }
    std::vector<int> near;
    for (int o = 0; o < static_cast<int>(model.obstacles.size()); ++o)
      if (distance<V>(model.obstacles[o], balls[a].center)[0] < best[1][0] + balls[a].radius) near.push_back(o);
    for (int i = 1; i < links; ++i)
      for (const int o : near) {
        if (model.obstacles[o].lets_touch(a, i)) continue;
        lower_clearance(poses[a], i, model.obstacles[o], best[1]);
        note(BodyPairKind::obstacles, a, i, o, -1);
      }
    for (int b = a + 1; b < arms; ++b) {
      const auto reach = best[0] + balls[a].radius + balls[b].radius;
      if (!bits<V>(closer(balls[a].center, balls[b].center, reach))) continue;
      for (int i = 0; i < links; ++i)
        for (int j = i > 0 ? 0 : 1; j < static_cast<int>(model.arms[b].links.size()); ++j) {
          lower_clearance(poses[a], i, poses[b], j, best[0]);
          note(BodyPairKind::arms, a, i, b, j);
        }
    }
  }
  return out;
}

}  // namespace mmp
