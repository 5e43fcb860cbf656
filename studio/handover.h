// Hands values from one thread to another, one at a time.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

namespace studio {

// The giver goes on only once its value is taken, so it works one value ahead of the taker, never
// two.
template <class T>
class Handover {
 public:
  // Waits until the value is taken. False, and nothing given, once closed.
  bool give(T value) {
    std::unique_lock lock(mutex_);
    if (closed_) return false;
    value_ = std::move(value);
    changed_.notify_all();
    changed_.wait(lock, [&] { return closed_ || !value_; });
    return !value_;
  }

  // Waits until the taker has dealt with what it took and asks again, or until a time. False once
  // closed.
  bool wait_for_taker(std::optional<std::chrono::steady_clock::time_point> until = std::nullopt) {
    std::unique_lock lock(mutex_);
    const auto asks = [&] { return closed_ || asks_; };
    if (until) {
      changed_.wait_until(lock, *until, asks);
    } else {
      changed_.wait(lock, asks);
    }
    return !closed_;
  }

  // Waits for a value. Nothing once closed and empty.
  std::optional<T> take() {
    std::unique_lock lock(mutex_);
    asks_ = true;
    changed_.notify_all();
    changed_.wait(lock, [&] { return closed_ || value_; });
    asks_ = false;
    std::optional<T> value = std::exchange(value_, std::nullopt);
    changed_.notify_all();
    return value;
  }

  // Nothing more will be given; what waits may still be taken.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<T> value_;
  bool asks_ = false;
  bool closed_ = false;
};

}  // namespace studio
