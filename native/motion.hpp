// One arm's trajectory on the common grid of steps, with its spheres worked out once for all that look at it.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "segments.hpp"

namespace mmp {

// Arrays run along time, so that a lane is a step: element i at step k stands at [i * stride + k].
template <class V>
class Motion {
 public:
  using T = Scalar<V>;
  int arm_index;
  const ArmModel<T>* arm;
  int last;  // index of the last step; the arm stays there for ever
  size_t stride;
  std::vector<T> q;                       // [last + 1][dof], row major
  std::vector<T> links, groups, spheres;  // centres [element][xyz][stride]
  std::vector<T> bulge;                   // [link][stride]: how far a centre may leave the chord from step k to k + 1

  Motion(const CellModel<T>& cell, int a, std::vector<T> positions)
      : arm_index(a),
        arm(&cell.arms[a]),
        last(static_cast<int>(positions.size()) / arm->dof - 1),
        q(std::move(positions)) {
    stride = static_cast<size_t>(last + 1 + 2 * width<V>);
    links.resize(arm->links.size() * 3 * stride);
    groups.resize(arm->groups.size() * 3 * stride);
    spheres.resize(arm->spheres.size() * 3 * stride);
    bulge.resize(arm->links.size() * stride);
    Pose<V> pose(*arm);
    for (int k = 0; k <= last; k += width<V>) fill(k, pose);
  }

  const T* at(int step) const { return q.data() + static_cast<size_t>(std::min(step, last)) * arm->dof; }

  // Element i of an array at steps k, k + 1, ...; past the end, where it stopped.
  Vec3<V> centers(const std::vector<T>& array, int i, int k) const {
    const T* p = array.data() + static_cast<size_t>(i) * 3 * stride;
    if (k >= last) return {splat<V>(p[last]), splat<V>(p[stride + last]), splat<V>(p[2 * stride + last])};
    return {load<V>(p + k), load<V>(p + stride + k), load<V>(p + 2 * stride + k)};
  }
  V bulge_at(int l, int k) const {
    return k >= last ? V{} : load<V>(bulge.data() + static_cast<size_t>(l) * stride + k);
  }

 private:
  void fill(int k, Pose<V>& pose) {
    V joints[kMaxDof], move[kMaxDof];
    for (int lane = 0; lane < width<V>; ++lane) {
      const T *here = at(k + lane), *next = at(k + lane + 1);
      for (int j = 0; j < arm->dof; ++j) {
        joints[j][lane] = here[j];
        move[j][lane] = next[j] - here[j];
      }
    }
    forward(joints, pose);
    const bool ends = k + width<V> > last;  // fill the tail with copies of the last step
    const auto put = [&](std::vector<T>& array, int i, const Vec3<V>& c) {
      T* p = array.data() + static_cast<size_t>(i) * 3 * stride + k;
      for (const V& v : {c.x, c.y, c.z}) {
        store<V>(p, v);
        if (ends) {
          store<V>(p + width<V>, splat<V>(v[width<V> - 1]));
        }
        p += stride;
      }
    };
    for (size_t l = 0; l < arm->links.size(); ++l) {
      const auto& link = arm->links[l];
      const int li = static_cast<int>(l);
      pose.detail(li);
      put(links, li, pose.link[l]);
      for (int g = link.groups.first; g < link.groups.first + link.groups.count; ++g) put(groups, g, pose.groups[g]);
      for (int s = link.spheres.first; s < link.spheres.first + link.spheres.count; ++s)
        put(spheres, s, pose.spheres[s]);
      // Between two steps a centre leaves its chord by at most 1/8 of its largest second derivative.
      V before{}, second{};
      for (int j = 0; j < link.frame; ++j) {
        const V m = abs(move[j]);
        second += (m * m + 2 * m * before) * arm->lever[l][j];
        before += m;
      }
      store<V>(bulge.data() + l * stride + k, second * T(0.125));
    }
  }
};

// Squared least distance of two points that go straight from d0 to d1 apart.
template <class V>
MMP_INLINE V chord_distance2(const Vec3<V>& d0, const Vec3<V>& d1) {
  const auto d = d1 - d0;
  const V dd = dot(d, d), zero{};
  const V t = min(max(-dot(d0, d) / max(dd, splat<V>(Scalar<V>(1e-12))), zero), splat<V>(1));
  const auto c = d0 + d * t;
  return dot(c, c);
}

// At which steps two motions are in conflict: the instants, in steps, ascending, at most one a step.
//
// At the steps themselves surfaces closer than `margin` are a conflict. Between them the chords of all sphere pairs are
// tested, less what the true paths may bulge out of them; what that leaves open goes to the prover, and a contact that
// it finds is an instant between two steps. Where there is no conflict `proof` is proved to be kept at every instant.
template <class V>
class PairCheck {
 public:
  using T = Scalar<V>;
  // With `bases`, one arm's moving links against the other's base as well; paths that are free alone never touch it.
  explicit PairCheck(StaticWorld<V>& world, bool bases = false) : prover_(world), first_(bases ? 0 : 1) {}

  void operator()(const Motion<V>& a, const Motion<V>& b, Levels<T> levels, std::vector<double>& instants) {
    const int last = std::max(a.last, b.last);
    instants.clear();
    open_.clear();
    for (int k = 0; k <= last; k += width<V>) block(a, b, k, last, levels, instants);
    refine(a, b, levels, last, instants);
  }

 private:
  void block(const Motion<V>& a, const Motion<V>& b, int k, int last, Levels<T> levels, std::vector<double>& instants) {
    Mask<V> hit{}, open{};
    for (size_t i = first_; i < a.arm->links.size(); ++i) {
      const int la = static_cast<int>(i);
      const auto a0 = a.centers(a.links, la, k), a1 = a.centers(a.links, la, k + 1);
      const V bulge_a = a.bulge_at(la, k) + levels.proof;
      for (size_t j = i == 0 ? 1 : first_; j < b.arm->links.size(); ++j) {
        const int lb = static_cast<int>(j);
        const V slack = bulge_a + b.bulge_at(lb, k);
        const V far = max(slack, splat<V>(levels.margin)) + (a.arm->links[i].bound.r + b.arm->links[j].bound.r);
        const V d2 = chord_distance2<V>(a0 - b.centers(b.links, lb, k), a1 - b.centers(b.links, lb, k + 1));
        if (bits<V>(d2 < far * far)) links(a, la, b, lb, k, slack, levels, hit, open);
      }
    }
    const unsigned h = bits<V>(hit), o = bits<V>(open);
    for (int lane = 0; lane < width<V> && k + lane <= last; ++lane) {
      if (h >> lane & 1u) instants.push_back(k + lane);
      if (o >> lane & 1u) open_.push_back(k + lane);
    }
  }

  void links(const Motion<V>& a, int la, const Motion<V>& b, int lb, int k, V slack, Levels<T> levels, Mask<V>& hit,
             Mask<V>& open) {
    const auto &A = a.arm->links[la], &B = b.arm->links[lb];
    const V far = max(slack, splat<V>(levels.margin));
    for (int ga = A.groups.first; ga < A.groups.first + A.groups.count; ++ga) {
      const auto a0 = a.centers(a.groups, ga, k), a1 = a.centers(a.groups, ga, k + 1);
      for (int gb = B.groups.first; gb < B.groups.first + B.groups.count; ++gb) {
        const V limit = far + (a.arm->groups[ga].r + b.arm->groups[gb].r);
        const V d2 = chord_distance2<V>(a0 - b.centers(b.groups, gb, k), a1 - b.centers(b.groups, gb, k + 1));
        if (!bits<V>(d2 < limit * limit)) continue;
        const Range sa = a.arm->group_spheres[ga], sb = b.arm->group_spheres[gb];
        for (int i = sa.first; i < sa.first + sa.count; ++i) {
          const auto p0 = a.centers(a.spheres, i, k), p1 = a.centers(a.spheres, i, k + 1);
          for (int j = sb.first; j < sb.first + sb.count; ++j) {
            const T radii = a.arm->spheres[i].r + b.arm->spheres[j].r;
            const auto d0 = p0 - b.centers(b.spheres, j, k), d1 = p1 - b.centers(b.spheres, j, k + 1);
            const V wide = slack + radii;
            hit |= dot(d0, d0) < splat<V>((levels.margin + radii) * (levels.margin + radii));
            open |= chord_distance2<V>(d0, d1) < wide * wide;
          }
        }
      }
    }
  }

  void refine(const Motion<V>& a, const Motion<V>& b, Levels<T> levels, int last, std::vector<double>& instants) {
    const auto hit = [&](int k) { return std::binary_search(instants.begin(), instants.end(), double(k)); };
    std::erase_if(open_, [&](int k) { return k == last || hit(k) || hit(k + 1); });
    if (open_.empty()) return;
    std::vector<SegmentResult<T>> results(open_.size());
    const auto of = [&](const Motion<V>& m) {
      return [&](int s) { return std::pair<const T*, const T*>(m.at(open_[s]), m.at(open_[s] + 1)); };
    };
    prover_.pair(a.arm_index, b.arm_index, static_cast<int>(open_.size()), of(a), of(b), levels, first_ == 0,
                 results.data());
    for (size_t s = 0; s < open_.size(); ++s)
      if (!results[s].free) instants.push_back(open_[s] + double(results[s].contact));
    std::sort(instants.begin(), instants.end());
  }

  Prover<V> prover_;
  size_t first_;
  std::vector<int> open_;
};

}  // namespace mmp
