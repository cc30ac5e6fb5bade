// A queue between threads that ends in order: what was put in before close() still comes out.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace pocd::dds {

/// Bounded by the sum of what its items weigh. Thread-safe.
template <class Item>
class ClosableQueue {
 public:
  explicit ClosableQueue(std::size_t capacity) : capacity_(capacity) {}

  /// Beyond the capacity, too.
  void push(Item item, std::size_t weight) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      put(std::move(item), weight);
    }
    filled_.notify_one();
  }
  /// False, and nothing put in, when there is no room.
  bool push_if_room(Item item, std::size_t weight) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (weight_ + weight > capacity_) return false;
      put(std::move(item), weight);
    }
    filled_.notify_one();
    return true;
  }
  /// When full, the oldest items make room; `dropped` is called with each of them.
  template <class Dropped>
  void push_making_room(Item item, std::size_t weight, const Dropped& dropped) {
    const auto oldest = [](const auto&) { return std::size_t{0}; };
    push_making_room(std::move(item), weight, oldest, dropped);
  }
  /// The same with those that `choose` picks: it gets the items (pairs of item and weight, oldest
  /// first) and gives an index.
  template <class Choose, class Dropped>
  void push_making_room(Item item, std::size_t weight, const Choose& choose,
                        const Dropped& dropped) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      while (!items_.empty() && weight_ + weight > capacity_) dropped(take_at(choose(items_)));
      put(std::move(item), weight);
    }
    filled_.notify_one();
  }

  /// Waits for an item. Nothing after `time`, or at once when the queue is closed and empty.
  std::optional<Item> pop(std::chrono::milliseconds time) {
    std::unique_lock<std::mutex> lock(mutex_);
    filled_.wait_for(lock, time, [this] { return closed_ || !items_.empty(); });
    if (items_.empty()) return std::nullopt;
    return take_at(0);
  }
  void close() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
    }
    filled_.notify_all();
  }
  /// Closed, and everything was taken out.
  bool finished() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return closed_ && items_.empty();
  }

  bool has_room() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return weight_ < capacity_;
  }
  std::size_t size() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return items_.size();
  }
  std::size_t weight() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return weight_;
  }

 private:
  void put(Item item, std::size_t weight) {
    weight_ += weight;
    items_.emplace_back(std::move(item), weight);
  }
  Item take_at(std::size_t index) {
    const auto taken = items_.begin() + static_cast<std::ptrdiff_t>(index);
    Item item = std::move(taken->first);
    weight_ -= taken->second;
    items_.erase(taken);
    return item;
  }

  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<std::pair<Item, std::size_t>> items_;
  std::size_t weight_ = 0;
  bool closed_ = false;
};

}  // namespace pocd::dds
