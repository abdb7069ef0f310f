// One arm's trajectory on the common grid of steps, with its sphere centres computed once for all queries.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "geometry/box.hpp"
#include "geometry/link_distance.hpp"

namespace mmp {

inline constexpr int kForever = 1 << 28;  // [steps]
inline constexpr int kBlock = 8, kMaxBlocks = 64;

// Straight line of a point from one step to the next.
template <class V>
struct Chord {
  Vec3<V> from, along;
};

// Box in each lane.
template <class V>
struct LaneBoxes {
  V lo[3], hi[3];

  // Returns the lanes in which the boxes are closer than `reach`.
  MMP_INLINE unsigned near(const LaneBoxes& o, V reach) const {
    V gap2{};
    for (int x = 0; x < 3; ++x) {
      const V gap = max(V{}, max(lo[x] - o.hi[x], o.lo[x] - hi[x]));
      gap2 += gap * gap;
    }
    return bits<V>(gap2 < reach * reach);
  }
};

// Returns the boxes around two points of each lane.
template <class V>
MMP_INLINE LaneBoxes<V> around(const Vec3<V>& p, const Vec3<V>& q) {
  return {{min(p.x, q.x), min(p.y, q.y), min(p.z, q.z)}, {max(p.x, q.x), max(p.y, q.y), max(p.z, q.z)}};
}

// Arrays run along time, so that a lane is a step: element i at step k is at [i * stride + k].
template <class V>
class Motion {
 public:
  using T = Scalar<V>;
  int arm_index;
  const ArmModel<T>* arm;
  int last;  // index of the last step; the arm stays there forever
  size_t stride;
  std::vector<T> q;                    // [last + 1][dof], row major
  Unfilled<T> links, groups, spheres;  // centres [element][xyz][stride]
  Unfilled<T> frames;                  // [frame][12][stride], rotation and origin; only of arms with hulls
  Unfilled<T> step_boxes;              // [low xyz, high xyz][stride]: bounds all moving links from step k to step k + 1
  Unfilled<T> deviation;       // [link][stride]: largest distance of a centre from its chord between steps k and k + 1
  std::vector<Box<T>> boxes;   // [link]: bounds the link's centres at all steps
  Box<T> whole;                // bounds all spheres of all moving links at all steps
  std::vector<Box<T>> blocks;  // [link][block_count]: kBlock steps and the next one
  std::vector<T> max_deviation;  // [link]

  // `detailed`: computes groups and spheres too.
  Motion(const CellModel<T>& cell, int a, std::vector<T> positions, bool detailed = true)
      : Motion(cell, a, std::move(positions), Room{2 * width<V>}) {
    Pose<V> pose(*arm);
    fill_all(pose);
    if (detailed) detail(~0u, pose);
  }

  // Compact variant for access step by step: no padding for lanes beyond the last step. `detail` adds groups and
  // spheres. Both use `pose` as workspace.
  Motion(const CellModel<T>& cell, int a, std::vector<T> positions, Pose<V>& pose)
      : Motion(cell, a, std::move(positions), Room{width<V>}) {
    fill_all(pose);
  }

  // Computes groups and spheres of the links whose bits are set. `pose` must be as the last call left it.
  void detail(uint32_t wanted, Pose<V>& pose) {
    groups.resize(arm->groups.size() * 3 * stride);
    spheres.resize(arm->spheres.size() * 3 * stride);
    for (int k = 0; k <= last; k += width<V>) {
      if (last >= width<V>) forward(k, pose);
      for (size_t l = 0; l < arm->links.size(); ++l)
        if (wanted >> l & 1u) put_link(static_cast<int>(l), pose, k);
    }
  }
  // Makes groups and spheres of a link available; here the constructor or `detail` has done so.
  void need(int) const {}

  // Blocks of steps. The last block also holds all later steps.
  size_t block_count() const { return static_cast<size_t>(std::min(last / kBlock + 1, kMaxBlocks)); }
  int block_of(int k) const { return std::min(std::min(k, last) / kBlock, kMaxBlocks - 1); }

  const T* at(int step) const { return q.data() + static_cast<size_t>(std::min(step, last)) * arm->dof; }

  // Copies the steps of `part`, a motion of the same arm with the same ends, to `step` and later. The boxes stay
  // unchanged.
  void take_over(int step, const Motion& part) {
    const int n = part.last + 1;
    std::copy_n(part.q.begin(), static_cast<size_t>(n) * arm->dof, q.begin() + static_cast<size_t>(step) * arm->dof);
    const auto copy = [&](Unfilled<T>& to, const Unfilled<T>& from, int count) {
      for (size_t row = 0; row * stride < to.size(); ++row)
        std::copy_n(from.begin() + row * part.stride, count, to.begin() + row * stride + step);
    };
    copy(links, part.links, n);
    copy(groups, part.groups, n);
    copy(spheres, part.spheres, n);
    copy(frames, part.frames, n);
    copy(deviation, part.deviation, n - 1);
    copy(step_boxes, part.step_boxes, n - 1);
  }

  // Returns element i of an array at steps k, k + 1, ...; after the end, its final position.
  MMP_INLINE Vec3<V> centers(const Unfilled<T>& array, int i, int k) const {
    const T* p = array.data() + static_cast<size_t>(i) * 3 * stride;
    if (k >= last) return {splat<V>(p[last]), splat<V>(p[stride + last]), splat<V>(p[2 * stride + last])};
    return {load<V>(p + k), load<V>(p + stride + k), load<V>(p + 2 * stride + k)};
  }
  // Returns its chord from steps k, k + 1, ... to the next ones.
  MMP_INLINE Chord<V> chord(const Unfilled<T>& array, int i, int k) const {
    const auto from = centers(array, i, k);
    if (k >= last) return {from, {V{}, V{}, V{}}};
    return {from, centers(array, i, k + 1) - from};
  }
  // Returns its chord from step k to the next one, in every lane.
  MMP_INLINE Chord<V> chord_at(const Unfilled<T>& array, int i, int k) const {
    const T* p = array.data() + static_cast<size_t>(i) * 3 * stride + std::min(k, last);
    const auto next = [&](size_t x) { return splat<V>(p[x * stride + 1] - p[x * stride]); };
    return {{splat<V>(p[0]), splat<V>(p[stride]), splat<V>(p[2 * stride])}, {next(0), next(1), next(2)}};
  }
  // Returns the hulls of a link at a step.
  PosedHulls hulls_at(int l, int k) const {
    const auto& link = arm->links[l];
    PosedHulls out{arm->hulls.data() + link.hulls.first, link.hulls.count, {}};
    if (link.frame == 0) return out;
    const T* p = frames.data() + static_cast<size_t>(link.frame) * 12 * stride + std::min(k, last);
    for (int i = 0; i < 9; ++i) out.pose.r[i] = double(p[static_cast<size_t>(i) * stride]);
    for (int i = 0; i < 3; ++i) out.pose.p[i] = double(p[static_cast<size_t>(9 + i) * stride]);
    return out;
  }
  // Returns the boxes around all moving links from steps k, k + 1, ... to the next ones.
  MMP_INLINE LaneBoxes<V> boxes_at(int k) const {
    LaneBoxes<V> out;
    for (int x = 0; x < 3; ++x) {
      const T *lo = step_boxes.data() + x * stride, *hi = lo + 3 * stride;
      out.lo[x] = k >= last ? splat<V>(lo[last]) : load<V>(lo + k);
      out.hi[x] = k >= last ? splat<V>(hi[last]) : load<V>(hi + k);
    }
    return out;
  }
  // Returns the box around all moving links from step k to the next one, in every lane.
  MMP_INLINE LaneBoxes<V> box_at(int k) const {
    LaneBoxes<V> out;
    const T* p = step_boxes.data() + std::min(k, last);
    for (int x = 0; x < 3; ++x) {
      out.lo[x] = splat<V>(p[x * stride]);
      out.hi[x] = splat<V>(p[(3 + x) * stride]);
    }
    return out;
  }
  V deviation_at(int l, int k) const {
    return k >= last ? V{} : load<V>(deviation.data() + static_cast<size_t>(l) * stride + k);
  }

 protected:
  void put(Unfilled<T>& array, int i, const Vec3<V>& c, int k) {
    const bool ends = k + width<V> > last && beyond_;  // fills the tail with copies of the last step
    T* p = array.data() + static_cast<size_t>(i) * 3 * stride + k;
    for (const V& v : {c.x, c.y, c.z}) {
      store<V>(p, v);
      if (ends) store<V>(p + width<V>, splat<V>(v[width<V> - 1]));
      p += stride;
    }
  }

  void put_link(int l, Pose<V>& pose, int k) {
    const auto& link = arm->links[l];
    pose.detail(l);
    for (int g = link.groups.first; g < link.groups.first + link.groups.count; ++g) put(groups, g, pose.groups[g], k);
    for (int s = link.spheres.first; s < link.spheres.first + link.spheres.count; ++s)
      put(spheres, s, pose.spheres[s], k);
  }

  MMP_NOINLINE void put_frames(const Pose<V>& pose, int k) {
    for (int f = 1; f <= arm->dof; ++f) {
      const auto& frame = pose.frames[f];
      for (int row = 0; row < 3; ++row)
        put(frames, 4 * f + row, {frame.r[3 * row], frame.r[3 * row + 1], frame.r[3 * row + 2]}, k);
      put(frames, 4 * f + 3, frame.p, k);
    }
  }

  void fill(int k, Pose<V>& pose) {
    V joints[kMaxDof], move[kMaxDof], beyond{};
    for (int lane = 0; lane < width<V>; ++lane) {
      const T *here = at(k + lane), *next = at(k + lane + 1);
      for (int j = 0; j < arm->dof; ++j) {
        joints[j][lane] = here[j];
        move[j][lane] = next[j] - here[j];
      }
    }
    for (int j = 0; j < arm->dof; ++j) {
      if (arm->slides(j)) beyond += beyond_limits<V>(*arm, j, joints[j], joints[j] + move[j]);
      move[j] = abs(move[j]);
    }
    mmp::forward(joints, pose);
    if (!frames.empty()) put_frames(pose, k);
    for (size_t l = 0; l < arm->links.size(); ++l) {
      put(links, static_cast<int>(l), pose.link[l], k);
      // Between two steps a centre leaves its chord by at most 1/8 of its largest second derivative.
      const V second = curvature<V>(*arm, static_cast<int>(l), 0, move, beyond);
      T* p = deviation.data() + l * stride + k;
      store<V>(p, second * T(0.125));
      if (k + width<V> > last && beyond_) store<V>(p + width<V>, V{});
    }
  }

  // Computes the boxes of steps k, k + 1, ...; needs the next one.
  void enclose(int k) {
    const bool ends = k + width<V> > last;
    for (int x = 0; x < 3; ++x) {
      V lo = splat<V>(T(1e30)), hi = -lo;
      for (size_t l = 1; l < arm->links.size(); ++l) {
        if (arm->links[l].spheres.count == 0) continue;
        const V r = arm->links[l].bound.r + load<V>(deviation.data() + l * stride + k);
        const T* p = links.data() + (l * 3 + x) * stride + k;
        const V here = load<V>(p), next = load<V>(p + 1);
        lo = min(lo, min(here, next) - r);
        hi = max(hi, max(here, next) + r);
      }
      T *low = step_boxes.data() + x * stride + k, *high = low + 3 * stride;
      store<V>(low, lo);
      store<V>(high, hi);
      if (ends) store<V>(low + width<V>, splat<V>(lo[width<V> - 1]));
      if (ends) store<V>(high + width<V>, splat<V>(hi[width<V> - 1]));
    }
  }

 private:
  // Padding after the last step: for loads that begin at it, or only for loads that end with it.
  struct Room {
    int elements;
  };

  Motion(const CellModel<T>& cell, int a, std::vector<T> positions, Room room)
      : arm_index(a),
        arm(&cell.arms[a]),
        last(static_cast<int>(positions.size()) / arm->dof - 1),
        stride(static_cast<size_t>(last + 1 + room.elements)),
        q(std::move(positions)),
        links(arm->links.size() * 3 * stride),
        frames(arm->hulls.empty() ? 0 : static_cast<size_t>(arm->dof + 1) * 12 * stride),
        step_boxes(room.elements > width<V> ? 6 * stride : 0),
        deviation(arm->links.size() * stride),
        boxes(arm->links.size()),
        blocks(arm->links.size() * block_count()),
        max_deviation(arm->links.size()),
        beyond_(room.elements > width<V>) {}

  void fill_all(Pose<V>& pose) {
    for (int k = 0; k <= last; k += width<V>) fill(k, pose);
    for (int k = 0; k <= last && !step_boxes.empty(); k += width<V>) enclose(k);
    bound();
  }

  void forward(int k, Pose<V>& pose) const {
    V joints[kMaxDof];
    for (int lane = 0; lane < width<V>; ++lane)
      for (int j = 0; j < arm->dof; ++j) joints[j][lane] = at(k + lane)[j];
    mmp::forward(joints, pose);
  }

  void bound() {
    const int count = static_cast<int>(block_count());
    for (size_t l = 0; l < boxes.size(); ++l) {
      const T* p = links.data() + l * 3 * stride;
      boxes[l] = {};
      for (int b = 0; b < count; ++b) {
        const int first = b * kBlock, end = b + 1 == count ? last + 1 : std::min(first + kBlock, last) + 1;
        auto& block = blocks[l * count + b];
        for (int x = 0; x < 3; ++x) {
          const auto [lo, hi] = std::minmax_element(p + x * stride + first, p + x * stride + end);
          block.lo[x] = *lo;
          block.hi[x] = *hi;
          boxes[l].lo[x] = std::min(boxes[l].lo[x], *lo);
          boxes[l].hi[x] = std::max(boxes[l].hi[x], *hi);
        }
      }
      const T* b = deviation.data() + l * stride;
      max_deviation[l] = *std::max_element(b, b + last + 1);
      const T r = arm->links[l].bound.r + max_deviation[l];
      for (int x = 0; l > 0 && arm->links[l].spheres.count > 0 && x < 3; ++x) {
        whole.lo[x] = std::min(whole.lo[x], boxes[l].lo[x] - r);
        whole.hi[x] = std::max(whole.hi[x], boxes[l].hi[x] + r);
      }
    }
  }

  bool beyond_;  // loads extend beyond the last step
};

}  // namespace mmp
