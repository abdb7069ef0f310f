// Deadline, cancel flag and pending Python signals of a long call.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>

namespace mmp {

class Clock {
 public:
  using Steady = std::chrono::steady_clock;

  // Less than -1e9 s would overflow the system clock.
  explicit Clock(double seconds) : bounded_(seconds < 1e9) {
    const std::chrono::duration<double> left(std::max(seconds, -1e9));
    if (bounded_) end_ = Steady::now() + std::chrono::duration_cast<Steady::duration>(left);
  }

  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }
  bool expired() const {
    if (cancelled()) return true;
    if (!bounded_ && !poll_) return false;
    const auto now = Steady::now();
    if (bounded_ && now >= end()) return true;
    if (poll_) poll_(*this, now);
    return false;
  }
  double remaining() const {
    if (!bounded_) return std::numeric_limits<double>::infinity();
    return std::chrono::duration<double>(end() - Steady::now()).count();
  }

  // The clock expires so much earlier; 0 s at first.
  void reserve(double seconds) {
    const std::chrono::duration<double> time(std::clamp(seconds, 0.0, 1e9));
    reserved_.store(std::chrono::duration_cast<Steady::duration>(time).count(), std::memory_order_relaxed);
  }

  // Returns true at most once per `interval`, to one of the threads that share the clock.
  bool due(Steady::time_point now, Steady::duration interval) const {
    const auto ticks = now.time_since_epoch().count();
    auto next = next_poll_.load(std::memory_order_relaxed);
    return ticks >= next &&
           next_poll_.compare_exchange_strong(next, ticks + interval.count(), std::memory_order_relaxed);
  }

  // Set by the binding: handles pending Python signals, and throws their exceptions.
  using Poll = void (*)(const Clock&, Steady::time_point now);
  Poll poll_ = nullptr;

 private:
  Steady::time_point end() const { return end_ - Steady::duration(reserved_.load(std::memory_order_relaxed)); }

  bool bounded_;
  Steady::time_point end_{};
  std::atomic<Steady::rep> reserved_{0};
  mutable std::atomic<Steady::rep> next_poll_{0};
  std::atomic<bool> cancelled_{false};
};

}  // namespace mmp
