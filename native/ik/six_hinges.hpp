// Arms of six hinges with a special geometry that has a closed form.
#pragma once

#include <vector>

#include "ik/subproblems.hpp"
#include "ik/trigonometric_roots.hpp"

namespace mmp::ik {

using Six = std::array<double, 6>;

// A chain in frames that are parallel to the base frame at zero positions, and a target of its last frame. Offsets lead
// from the base to joint 0, from each joint to the next one, and from the last joint to the last frame.
struct SixHinges {
  std::array<Vec, 6> axes;
  std::array<Vec, 7> offsets;
  Rotation rotation;
  Vec position;

  std::array<Vec, 7> points() const {
    std::array<Vec, 7> out{offsets};
    for (int k = 1; k < 7; ++k) out[k] = out[k - 1] + offsets[k];
    return out;
  }
};

// Adds the joint angles [rad] of an arm whose axes 2, 3 and 4 are parallel and whose axes 5 and 6 meet.
//
// The parallel joints keep heights and directions along their axis, which gives joints 1, 5 and 6; the three joints
// themselves are a planar arm.
inline void parallel_axes(const SixHinges& arm, std::vector<Six>& out) {
  const auto& h = arm.axes;
  const auto points = arm.points();
  const Vec wrist = meeting_point(&points[4], &h[4], 2);
  const Vec target = arm.position - arm.rotation * (points[6] - wrist) - arm.offsets[0];
  const Vec &up = h[1], last = wrist - points[3], side = perpendicular(up);
  const Vec &upper = arm.offsets[2], &fore = arm.offsets[3];
  const Rotation back = arm.rotation.transposed();
  const double height = dot(up, arm.offsets[1] + upper + fore + last);
  const auto sign = [&](int k) { return dot(up, h[k]) < 0 ? -1.0 : 1.0; };
  for (const double q1 : angles_of_height(minus(h[0]), target, up, height)) {
    const Vec seen = back * rotated(h[0], q1, up), seen_target = rotated(minus(h[0]), q1, target);
    for (const double q5 : angles_of_height(h[4], h[5], up, dot(seen, h[5]))) {
      const double q6 = angle_between(h[5], seen, rotated(minus(h[4]), q5, up));
      const Vec tool_side = rotated(minus(h[5]), q6, rotated(minus(h[4]), q5, side));
      const double sum = angle_between(up, side, rotated(minus(h[0]), q1, arm.rotation * tool_side));
      const Vec place = seen_target - arm.offsets[1] - rotated(up, sum, last);
      const Vec flat = place - up * dot(place, up);
      const double lift = dot(upper + fore, up);
      const double squared = dot(flat, flat) + lift * lift;
      for (const double q3 : angles_of_height(up, fore, upper, (squared - dot(upper, upper) - dot(fore, fore)) / 2)) {
        const double q2 = angle_between(up, upper + rotated(up, q3, fore), flat);
        out.push_back({q1, q2, q3 * sign(2), (sum - q2 - q3) * sign(3), q5, q6});
      }
    }
  }
}

// An arm whose last three axes meet in the wrist, seen from there: vectors at zero positions, and the wrist's target.
struct ThreeHinges {
  Vec h1, h2, h3, first, second, third, target;

  Wave series(const Vec& direction, const Vec& axis, const Vec& v) const {
    const double mean = dot(direction, axis) * dot(axis, v);
    return {mean, dot(direction, v) - mean, dot(direction, cross(axis, v))};
  }

  // Returns the angles of joint 3 [rad] with which the wrist reaches its target.
  //
  // The distance of the wrist from the first joint, and its height along the first axis, are linear in the cosine and
  // the sine of joint 2. Both of them together leave one equation for joint 3.
  Angles elbow() const {
    const Wave along = series(h2, h3, third) + Wave{dot(h2, second)};
    const Wave squared = series(second, h3, third) * 2 + Wave{dot(second, second) + dot(third, third)};
    const double lift = dot(h2, first), slant = dot(h1, h2);
    const Wave alpha = Wave{(dot(target, target) - dot(first, first)) / 2} + squared * -0.5 + along * -lift;
    const Wave beta = Wave{dot(h1, target) - dot(h1, first)} + along * -slant;
    const Vec o = first - h2 * lift, g = h1 - h2 * slant;
    const double turn = dot(h2, cross(o, g));
    const auto plain = [](const Wave& w) { return TrigonometricPolynomial{w.mean, w.cosine, w.sine}; };
    // If axes 1 and 2 meet, the distance alone decides, and otherwise double roots would be.
    if (dot(o, o) < 1e-20 * (dot(second, second) + dot(third, third))) return roots_of(plain(alpha));
    return roots_of(product(alpha, alpha) * dot(g, g) + product(alpha, beta) * (-2 * dot(o, g)) +
                    product(beta, beta) * dot(o, o) + (plain(squared) + product(along, along) * -1) * (-turn * turn));
  }

  // Returns both angles of joint 2 [rad] from the height of the wrist, or from its distance if axes 1 and 2 align.
  std::array<double, 2> shoulder(const Vec& reach) const {
    if (std::abs(dot(h1, h2)) < 0.99) return angles_of_height(h2, reach, h1, dot(h1, target - first));
    const double distance = (dot(target, target) - dot(first, first) - dot(reach, reach)) / 2;
    return angles_of_height(h2, reach, first, distance);
  }
};

// Adds both solutions of the last three joints of an arm whose first three joints have the angles `front` [rad].
inline void add_wrist(const SixHinges& arm, const std::array<double, 3>& front, std::vector<Six>& out) {
  const auto& h = arm.axes;
  const auto unturned = [&](Vec v) {
    for (int k = 0; k < 3; ++k) v = rotated(minus(h[k]), front[k], v);
    return v;
  };
  const Vec tool = unturned(arm.rotation * h[5]), side = perpendicular(h[5]);
  const Vec turned_side = unturned(arm.rotation * side);
  for (const double q5 : angles_of_height(h[4], h[5], h[3], dot(h[3], tool))) {
    const double q4 = angle_between(h[3], rotated(h[4], q5, h[5]), tool);
    const double q6 = angle_between(h[5], side, rotated(minus(h[4]), q5, rotated(minus(h[3]), q4, turned_side)));
    out.push_back({front[0], front[1], front[2], q4, q5, q6});
  }
}

// Adds the joint angles [rad] of an arm whose last three axes meet.
//
// The first three joints bring the wrist to its place: a quartic equation for joint 3 and linear ones for joints 2 and
// 1. The others turn the tool. `miss` is the largest error of the wrist's position [arm lengths].
inline void spherical_wrist(const SixHinges& arm, double miss, std::vector<Six>& out) {
  const auto& h = arm.axes;
  const auto points = arm.points();
  const Vec wrist = meeting_point(&points[3], &h[3], 3);
  const Vec target = arm.position - arm.rotation * (points[6] - wrist) - arm.offsets[0];
  const ThreeHinges front{h[0], h[1], h[2], arm.offsets[1], arm.offsets[2], wrist - points[2], target};
  const double reachable = length(front.first) + length(front.second) + length(front.third);
  const Angles elbows = front.elbow();
  for (int k = 0; k < elbows.count; ++k) {
    const double q3 = elbows.values[k];
    const Vec reach = front.second + rotated(h[2], q3, front.third);
    for (const double q2 : front.shoulder(reach)) {
      const Vec stretched = front.first + rotated(h[1], q2, reach);
      const double q1 = angle_between(h[0], stretched, target);
      if (length(rotated(h[0], q1, stretched) - target) < miss * reachable) add_wrist(arm, {q1, q2, q3}, out);
    }
  }
}

}  // namespace mmp::ik
