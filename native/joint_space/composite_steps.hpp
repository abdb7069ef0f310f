// Steps of all arms towards a target. Where arms would meet, one goes after the other.
//
// A straight edge in the joints of all arms is blocked as soon as two arms meet anywhere on it, so in a crowded cell
// nearly every edge is blocked. A step gives each arm its own straight line and a time slot: the
// arms of a slot move together while all others stand, at the beginning of their lines or at the end. An arm that finds
// no slot stays where it is. The length of a path is the same: it is the sum of the movement of all joints.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <vector>

#include "geometry/motion.hpp"
#include "geometry/static_world.hpp"
#include "geometry/upright_projection.hpp"
#include "runtime/clock.hpp"

namespace mmp {

// Slot of each arm on an edge: 0 if it stands, otherwise 1, 2, ... in the order of their motion.
using Slots = std::vector<uint16_t>;

// An arm that stands while others move.
template <class T>
struct Parked {
  int arm;
  std::vector<T> q;
};

template <class V>
class CompositeSteps {
 public:
  using T = Scalar<V>;
  // A step moves each arm by at most `range` (L2), and is tested at samples `step` apart (largest joint) [rad].
  CompositeSteps(StaticWorld<V>& world, std::vector<int> arms, const std::vector<Parked<T>>& parked, Levels<T> levels,
                 T range, T step)
      : world_(&world), levels_(levels), range_(range), step_(step), numbers_(std::move(arms)) {
    for (const auto& [arm, q] : parked) parked_.emplace_back(arm, world.cell->arms[arm], q);
    for (const int a : numbers_) {
      const auto& model = world.cell->arms[a];
      arms_.emplace_back(model, dof_);
      dof_ += model.dof;
    }
    for (auto& arm : arms_) arm.known.resize(arms_.size());
  }

  int dof() const { return dof_; }
  int count() const { return static_cast<int>(arms_.size()); }
  int offset(int a) const { return arms_[a].offset; }
  const ArmModel<T>& arm(int a) const { return *arms_[a].model; }

  // Returns the parked arm that was most often in the way, -1 if none was.
  int most_in_the_way() const {
    const auto most = std::ranges::max_element(parked_, {}, &ParkedArm::blocked);
    return most == parked_.end() || most->blocked == 0 ? -1 : most->number;
  }
  // Returns the parked arms that touch the others in a state.
  std::vector<int> parked_at(const T* q) {
    std::vector<int> out;
    aim(q, q);
    for (auto& parked : parked_) {
      const auto touches = [&](int a) {
        return box(a, kBefore).near(parked.box, levels_.margin) &&
               poses_touch(standing(a, kBefore), parked.pose, parked.box);
      };
      int a = 0;
      while (a < count() && !touches(a)) ++a;
      if (a < count()) out.push_back(parked.number);
    }
    return out;
  }

  // Moves a configuration of all joints inside the bounds of upright tools. Returns false if that fails.
  bool project(std::vector<T>& q) {
    for (auto& arm : arms_)
      if (!arm.upright(q.data() + arm.offset)) return false;
    return true;
  }

  // Moves the arms from a free state towards a target. They look for a slot in the order of their numbers, beginning
  // with `first`. Writes the state that is reached, and the slots. Returns whether any arm moves; none does if the
  // clock ends the step.
  bool operator()(const T* from, const T* target, int first, std::vector<T>& next, Slots& slots, const Clock& clock) {
    clock_ = &clock;
    aim(from, target);
    next.assign(from, from + dof_);
    slots.assign(arms_.size(), 0);
    std::vector<int> waiting;
    for (int k = 0; k < count() && !is_over(); ++k)
      if (const int a = (first + k) % count(); arms_[a].moves && !alone_touches(a)) waiting.push_back(a);
    const size_t movable = waiting.size();
    for (uint16_t slot = 1; fill_slot(slot, waiting, next, slots); ++slot) {
    }
    return waiting.size() < movable && !is_over();
  }

 private:
  enum Where { kBefore, kAfter, kMoving, kWheres };

  // An arm in one step. Poses and boxes are computed when they are first asked for.
  struct Arm {
    const ArmModel<T>* model;
    int offset;
    bool moves = false;
    UprightProjection<V> upright;
    std::vector<T> from, to;
    std::vector<Pose<V>> moving, standing;  // [batch of samples], [before, after]
    int posed = 0;                          // number of batches whose poses are known
    bool stands[2] = {};                    // whether a standing pose is known
    Box<T> box[kWheres];
    bool boxed[kWheres] = {};
    std::vector<std::array<int8_t, kWheres>> known;  // [other arm]: whether they touch, -1 if that is not known

    Arm(const ArmModel<T>& arm, int at) : model(&arm), offset(at), upright(arm), from(arm.dof), to(arm.dof) {}
  };

  struct ParkedArm {
    int number;
    Pose<V> pose;
    Box<T> box;
    int blocked = 0;  // how often it was in the way

    ParkedArm(int a, const ArmModel<T>& arm, const std::vector<T>& at) : number(a), pose(arm) {
      V q[kMaxDof];
      for (int j = 0; j < arm.dof; ++j) q[j] = splat<V>(at[j]);
      forward(q, pose);
      enclose(pose, box);
    }
  };

  bool is_over() const { return clock_->expired(); }

  // Sets the ends of every arm's line, and the number of samples.
  void aim(const T* from, const T* target) {
    T longest = 0;
    for (auto& arm : arms_) {
      std::copy_n(from + arm.offset, arm.model->dof, arm.from.begin());
      arm.moves = set_end(arm, target + arm.offset);
      longest = std::max(longest,
                         longest_move(std::pair<const T*, const T*>(arm.from.data(), arm.to.data()), arm.model->dof));
      arm.posed = 0;
      std::fill_n(arm.stands, 2, false);
      std::fill_n(arm.boxed, kWheres, false);
      for (auto& known : arm.known) known.fill(-1);
    }
    const int samples = std::max(1, static_cast<int>(std::min(std::ceil(longest / step_), T(kForever))));
    batches_ = (samples + width<V> - 1) / width<V>;
    samples_ = samples;
  }

  // Returns whether the arm's line has a length.
  bool set_end(Arm& arm, const T* target) {
    const int dof = arm.model->dof;
    const T longest = longest_move(std::pair<const T*, const T*>(arm.from.data(), target), dof);
    T d2 = 0;
    for (int j = 0; j < dof; ++j) d2 += (target[j] - arm.from[j]) * (target[j] - arm.from[j]);
    const T share = longest > T(0) ? std::min(range_ / std::sqrt(d2), arm.upright.longest_step() / longest) : T(1);
    if (share >= T(1)) {
      std::copy_n(target, dof, arm.to.begin());
      return longest > T(0);
    }
    for (int j = 0; j < dof; ++j) arm.to[j] = arm.from[j] + share * (target[j] - arm.from[j]);
    if (arm.upright(arm.to.data())) return true;
    arm.to = arm.from;
    return false;
  }

  // Puts waiting arms into a slot and moves them. Returns whether there were any.
  bool fill_slot(uint16_t slot, std::vector<int>& waiting, std::vector<T>& next, Slots& slots) {
    std::vector<int> left;
    for (const int a : waiting) {
      if (is_over()) return false;
      if (is_clear(a, slot, slots)) {
        slots[a] = slot;
        std::copy_n(arms_[a].to.begin(), arms_[a].model->dof, next.begin() + arms_[a].offset);
      } else {
        left.push_back(a);
      }
    }
    std::swap(waiting, left);
    return waiting.size() < left.size();
  }

  // Returns whether arm a can move in a slot: clear of the arms that move in it, and of all others where they stand.
  bool is_clear(int a, uint16_t slot, const Slots& slots) {
    for (int b = 0; b < count(); ++b)
      if (b != a && touches(a, b, slots[b] == 0 ? kBefore : slots[b] == slot ? kMoving : kAfter)) return false;
    return true;
  }

  // Returns whether arm a touches arm b somewhere on its line.
  bool touches(int a, int b, Where where) {
    auto& known = arms_[a].known[b][where];
    if (known < 0) {
      known = boxes_are_near(a, b, where) && any_sample_touches(a, b, where);
      if (where == kMoving) arms_[b].known[a][where] = known;
    }
    return known != 0;
  }
  bool boxes_are_near(int a, int b, Where where) { return box(a, kMoving).near(box(b, where), levels_.margin); }
  bool any_sample_touches(int a, int b, Where where) {
    for (int k = 0; k < batches_; ++k)
      if (poses_touch(moving(a, k), where == kMoving ? moving(b, k) : standing(b, where), box(b, where))) return true;
    return false;
  }

  // Returns whether the arm touches itself, static bodies or parked arms on its line.
  bool alone_touches(int a) {
    const auto none = [](int) { return V{}; };
    const auto touch = [](const Contacts<V>& c) { return bits<V>(c.touching) != 0; };
    for (int k = 0; k < batches_; ++k) {
      auto& pose = moving(a, k);
      if (pose.arm->upright && bits<V>(upright_room(pose) < splat<V>(levels_.margin + levels_.upright))) return true;
      Contacts<V> out;
      world_->contacts(numbers_[a], pose, levels_, none, none, touch, out);
      if (touch(out)) return true;
    }
    return parked_touch(a);
  }
  bool parked_touch(int a) {
    for (auto& parked : parked_) {
      if (!box(a, kMoving).near(parked.box, levels_.margin)) continue;
      for (int k = 0; k < batches_; ++k) {
        if (!poses_touch(moving(a, k), parked.pose, parked.box)) continue;
        ++parked.blocked;
        return true;
      }
    }
    return false;
  }

  // `around_b`: box around the second arm.
  bool poses_touch(Pose<V>& a, Pose<V>& b, const Box<T>& around_b) {
    Contacts<V> out;
    for (size_t i = a.arm->links.size(); i-- > 1;) {
      if (!around_b.near(a.link[i], splat<V>(a.arm->links[i].bound.r + levels_.margin))) continue;
      for (size_t j = b.arm->links.size(); j-- > 1;) {
        contact(a, static_cast<int>(i), b, static_cast<int>(j), levels_.margin, V{}, out);
        if (bits<V>(out.touching)) return true;
      }
    }
    return false;
  }
  // Returns the poses of a batch of samples. Each batch spreads its lanes over the whole line, so that the first one
  // finds most contacts.
  Pose<V>& moving(int a, int batch) {
    auto& arm = arms_[a];
    if (batch >= static_cast<int>(arm.moving.size())) arm.moving.reserve(batches_);
    for (; arm.posed <= batch; ++arm.posed) {
      if (static_cast<int>(arm.moving.size()) == arm.posed) arm.moving.emplace_back(*arm.model);
      V at, q[kMaxDof];
      for (int lane = 0; lane < width<V>; ++lane)
        at[lane] = T(std::min(arm.posed + 1 + lane * batches_, samples_)) / T(samples_);
      for (int j = 0; j < arm.model->dof; ++j) q[j] = arm.from[j] + at * (arm.to[j] - arm.from[j]);
      forward(q, arm.moving[arm.posed]);
    }
    return arm.moving[batch];
  }
  Pose<V>& standing(int a, Where where) {
    auto& arm = arms_[a];
    while (arm.standing.size() < 2) arm.standing.emplace_back(*arm.model);
    if (!arm.stands[where]) {
      arm.stands[where] = true;
      V q[kMaxDof];
      for (int j = 0; j < arm.model->dof; ++j) q[j] = splat<V>(where == kBefore ? arm.from[j] : arm.to[j]);
      forward(q, arm.standing[where]);
    }
    return arm.standing[where];
  }

  // Returns a box around the moving links.
  const Box<T>& box(int a, Where where) {
    auto& arm = arms_[a];
    if (!arm.boxed[where]) {
      arm.boxed[where] = true;
      arm.box[where] = {};
      if (where == kMoving)
        for (int k = 0; k < batches_; ++k) enclose(moving(a, k), arm.box[where]);
      else enclose(standing(a, where), arm.box[where]);
    }
    return arm.box[where];
  }
  static void enclose(const Pose<V>& pose, Box<T>& box) {
    for (size_t l = 1; l < pose.arm->links.size(); ++l) box.include(pose.link[l], pose.arm->links[l].bound.r);
  }

  StaticWorld<V>* world_;
  const Clock* clock_ = nullptr;  // of the step that is made
  Levels<T> levels_;
  T range_, step_;
  std::vector<int> numbers_;
  std::deque<Arm> arms_;
  std::deque<ParkedArm> parked_;
  int dof_ = 0, batches_ = 1, samples_ = 1;
};

}  // namespace mmp
