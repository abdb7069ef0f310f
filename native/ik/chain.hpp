// A serial chain of hinges and slides, and the task to bring its tool frame to a pose.
#pragma once

#include <vector>

#include "geometry/model.hpp"
#include "ik/subproblems.hpp"

namespace mmp::ik {

inline constexpr int kMaxRows = 6;

// A chain at zero positions, in frames that are parallel to the base frame. Offsets lead from the base to joint 0, from
// each joint to the next one, and from the last joint to the tool.
struct Chain {
  std::vector<Vec> axes, offsets;
  std::vector<bool> slides;
  Rotation tool;
  double scale = 1;  // of position errors [m]

  int dof() const { return static_cast<int>(axes.size()); }
};

struct ToolPose {
  Rotation rotation;
  Vec position;
};

// The joint axes and the tool frame of one configuration, in the base frame.
struct ChainFrames {
  std::array<Vec, kMaxDof> axes, points;
  ToolPose tool;

  ChainFrames(const Chain& chain, const double* q) {
    std::array<Vec, 3> columns{Vec{1, 0, 0}, Vec{0, 1, 0}, Vec{0, 0, 1}};
    const auto turned = [&](const Vec& v) { return columns[0] * v.x + columns[1] * v.y + columns[2] * v.z; };
    Vec position = chain.offsets[0];
    for (int k = 0; k < chain.dof(); ++k) {
      axes[k] = turned(chain.axes[k]), points[k] = position;
      if (chain.slides[k]) {
        position = position + axes[k] * q[k];
      } else {
        // Turns the columns about the axis in the base frame.
        const double sine = std::sin(q[k]), cosine = std::cos(q[k]);
        for (Vec& c : columns) {
          const Vec along = axes[k] * dot(axes[k], c);
          c = along + (c - along) * cosine + cross(axes[k], c) * sine;
        }
      }
      position = position + turned(chain.offsets[k + 1]);
    }
    std::array<Vec, 3> last;
    for (int j = 0; j < 3; ++j) last[j] = turned(chain.tool.column(j));
    tool = {{{last[0].x, last[1].x, last[2].x, last[0].y, last[1].y, last[2].y, last[0].z, last[1].z, last[2].z}},
            position};
  }
};

// Returns a vector, whose length is the sine of an angle, with the angle as its length.
inline Vec with_angle(const Vec& v, double cosine) {
  const double sine = length(v);
  return sine > 1e-12 ? v * (std::atan2(sine, cosine) / sine) : v;
}

// The task: 3 rows for a position, 5 with the z axis of the tool, 6 with its whole rotation.
struct ToolTask {
  const Chain& chain;
  int rows;

  // Writes the position error [chain.scale], then the rotation [rad] to the pose in the tool frame.
  void error(const ChainFrames& frames, const ToolPose& pose, double* out) const {
    const Vec away = (pose.position - frames.tool.position) * (1 / chain.scale);
    out[0] = away.x, out[1] = away.y, out[2] = away.z;
    const Rotation back = frames.tool.rotation.transposed();
    if (rows == 5) {
      const Vec z = back * pose.rotation.column(2);
      const Vec turn = with_angle({-z.y, z.x, 0}, z.z);
      out[3] = turn.x, out[4] = turn.y;
    } else if (rows == 6) {
      const Vec x = back * pose.rotation.column(0), y = back * pose.rotation.column(1),
                z = back * pose.rotation.column(2);
      const Vec turn = with_angle(Vec{y.z - z.y, z.x - x.z, x.y - y.x} * 0.5, (x.x + y.y + z.z - 1) / 2);
      out[3] = turn.x, out[4] = turn.y, out[5] = turn.z;
    }
  }

  // Writes [rows, dof]: the motion of the tool in the units of `error` by a motion of each joint.
  void slope(const ChainFrames& frames, double* out) const {
    const int dof = chain.dof();
    const Rotation back = frames.tool.rotation.transposed();
    for (int k = 0; k < dof; ++k) {
      const Vec& axis = frames.axes[k];
      const Vec turning = cross(axis, frames.tool.position - frames.points[k]);
      const Vec moved = (chain.slides[k] ? axis : turning) * (1 / chain.scale);
      const Vec turned = chain.slides[k] ? Vec{0, 0, 0} : back * axis;
      const double column[kMaxRows] = {moved.x, moved.y, moved.z, turned.x, turned.y, turned.z};
      for (int i = 0; i < rows; ++i) out[i * dof + k] = column[i];
    }
  }
};

}  // namespace mmp::ik
