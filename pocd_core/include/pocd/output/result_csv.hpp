// Results as CSV files with a header line. Lengths in metres, angles in radians, map frame; text is
// quoted where it has to be. docs/pocd_map.md explains every column.
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "pocd/input/frame.hpp"
#include "pocd/objects/frame_result.hpp"

namespace pocd {

/// Name of a class in outputs.
using ClassNameOf = std::function<std::string(ClassId)>;

/// A CSV file being written. Throws InputError naming the file when it cannot be opened or written.
class CsvFile {
 public:
  CsvFile(const std::filesystem::path& file, const std::string& header);

  void row(const std::vector<std::string>& cells);
  /// Flushes and checks that every byte was taken.
  void close();

 private:
  std::filesystem::path path_;
  std::ofstream out_;
};

/// id, class, class name, s, box, belief, times: one line per object in the given order.
void write_objects_csv(const std::vector<ObjectSnapshot>& objects, const ClassNameOf& class_name,
                       const std::filesystem::path& file);

/// One line per event with the evidence that caused it.
class EventsCsv {
 public:
  explicit EventsCsv(const std::filesystem::path& file);
  void add(const ObjectEvent& event, const std::string& class_name);
  void close() { file_.close(); }

 private:
  CsvFile file_;
};

/// One line per frame and stage.
class TimingCsv {
 public:
  explicit TimingCsv(const std::filesystem::path& file);
  void add(const Frame& frame, const std::vector<StageTiming>& timings);
  void close() { file_.close(); }

 private:
  CsvFile file_;
};

}  // namespace pocd
