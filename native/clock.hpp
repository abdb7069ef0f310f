// When to stop: a deadline, a cancel flag, and signals that Python has pending.
#pragma once

#include <atomic>
#include <chrono>
#include <limits>

namespace mmp {

class Clock {
 public:
  using Steady = std::chrono::steady_clock;

  explicit Clock(double seconds) : bounded_(seconds < 1e9) {
    if (bounded_)
      end_ = Steady::now() + std::chrono::duration_cast<Steady::duration>(std::chrono::duration<double>(seconds));
  }

  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }
  bool expired() const {
    if (cancelled()) return true;
    if (bounded_ && Steady::now() >= end_) return true;
    return poll_ && poll_(*this);
  }
  double remaining() const {
    if (!bounded_) return std::numeric_limits<double>::infinity();
    return std::chrono::duration<double>(end_ - Steady::now()).count();
  }

  // Set by the binding: asks Python for pending signals now and then; true ends the run.
  using Poll = bool (*)(const Clock&);
  Poll poll_ = nullptr;
  mutable Steady::time_point next_poll_{};

 private:
  bool bounded_;
  Steady::time_point end_{};
  std::atomic<bool> cancelled_{false};
};

}  // namespace mmp
