// Boxes around bodies, for broad phases.
#pragma once

#include <algorithm>

#include "simd/lanes.hpp"

namespace mmp {

// Box along the axes of the world [m].
template <class T>
struct Box {
  T lo[3] = {T(1e30), T(1e30), T(1e30)}, hi[3] = {T(-1e30), T(-1e30), T(-1e30)};

  // Returns whether the boxes are closer than `reach`.
  bool near(const Box& o, T reach) const {
    T gap2 = 0;
    for (int x = 0; x < 3; ++x) {
      const T gap = std::max(T(0), std::max(lo[x] - o.hi[x], o.lo[x] - hi[x]));
      gap2 += gap * gap;
    }
    return gap2 < reach * reach;
  }

  // Returns whether a point of some lane is closer to the box than `reach`.
  template <class V>
  bool near(const Vec3<V>& point, const V& reach) const {
    const V* at[] = {&point.x, &point.y, &point.z};
    V gap2{};
    for (int x = 0; x < 3; ++x) {
      const V gap = max(V{}, max(splat<V>(lo[x]) - *at[x], *at[x] - splat<V>(hi[x])));
      gap2 += gap * gap;
    }
    return bits<V>(gap2 < reach * reach) != 0;
  }

  void include(int axis, T low, T high) {
    lo[axis] = std::min(lo[axis], low);
    hi[axis] = std::max(hi[axis], high);
  }
  // Grows the box around balls, one per lane.
  template <class V>
  void include(const Vec3<V>& center, T radius) {
    const V* at[] = {&center.x, &center.y, &center.z};
    for (int x = 0; x < 3; ++x)
      for (int lane = 0; lane < width<V>; ++lane) include(x, (*at[x])[lane] - radius, (*at[x])[lane] + radius);
  }
};

}  // namespace mmp
