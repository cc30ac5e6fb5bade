// What the memory of a warehouse holds, for the page without a bus and without a node.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "pocd/memory/memory_reader.hpp"
#include "view/board.hpp"
#include "view/object_feed.hpp"
#include "view/source.hpp"

namespace pocd::view {

/// The map and the objects of the last step, and the log of events. A memory keeps no map of
/// before, and no robots. Thread-safe.
class Remembered : public Source {
 public:
  /// Reads objects and log; a thread of its own draws the map. `board` must outlive it. Throws
  /// InputError when the folder holds no memory or one that cannot be read.
  Remembered(const std::filesystem::path& folder, Board& board);
  ~Remembered() override;
  Remembered(const Remembered&) = delete;
  Remembered& operator=(const Remembered&) = delete;

  std::optional<std::string> history(const std::string& uuid) const override {
    return objects_.history(uuid);
  }
  std::string then(double stamp_s) const override {
    return objects_.then(stamp_from(stamp_s), false);
  }

 private:
  void read_log();
  void draw();
  void say_status(double read);

  const std::string name_;
  Board& board_;
  ObjectFeed objects_;
  MemoryReader reader_;  // of the constructor, then of the thread
  MemoryInfo info_;
  std::uint64_t epoch_ = 0;  // of the last run
  std::size_t standing_ = 0;
  std::vector<std::string> damage_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace pocd::view
