#include "pocd/output/result_csv.hpp"

#include <array>
#include <cstdio>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

/// RFC 4180: quotes where a separator or quote is in the text. A line break becomes a blank: a row
/// is a line.
std::string quoted(std::string text) {
  for (char& c : text) c = c == '\r' || c == '\n' ? ' ' : c;
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + '"';
}

/// Micrometres and microradians: finer than any camera, short enough to read.
std::string length(double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.6f", value);
  return text.data();
}

std::string number(double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

using Cells = std::vector<std::string>;

void append(Cells& cells, const Cells& more) {
  cells.insert(cells.end(), more.begin(), more.end());
}

Cells box_cells(const OrientedBox& box) {
  const Eigen::Vector3d& p = box.pose.position_W;
  return {length(p.x()),          length(p.y()),
          length(p.z()),          length(box.pose.yaw_rad),
          length(box.size_m.x()), length(box.size_m.y()),
          length(box.size_m.z())};
}

Cells belief_cells(const Belief& belief) {
  return {number(belief.stationarity()), number(belief.alpha), number(belief.beta),
          number(belief.mu), number(belief.sigma)};
}

constexpr const char* kObjectsHeader =
    "id,class,class_name,stationarity_class,x,y,z,yaw,size_x,size_y,size_z,box_z,stationarity,"
    "alpha,beta,"
    "mu,sigma,first_seen_ns,last_seen_ns,observations,last_robot";
constexpr const char* kEventsHeader =
    "sequence,stamp_ns,kind,object_id,class,class_name,robot,frame,x,y,z,yaw,size_x,size_y,size_z,"
    "previous_x,previous_y,previous_z,previous_yaw,absorbed,rule,delta,measured_stationarity_class,"
    "k,c1,c2,"
    "visible_share,seen_through_share,measurement_sigma,stationarity_before,alpha_before,"
    "beta_before,mu_before,sigma_before,stationarity_after,alpha_after,beta_after,mu_after,"
    "sigma_after,arrival";

}  // namespace

CsvFile::CsvFile(const std::filesystem::path& file, const std::string& header)
    : path_(file), out_(file, std::ios::binary) {
  if (!out_) throw InputError(file.string() + ": cannot be written");
  out_ << header << '\n';
}

void CsvFile::row(const std::vector<std::string>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) out_ << (i > 0 ? "," : "") << quoted(cells[i]);
  out_ << '\n';
}

void CsvFile::close() {
  out_.close();
  if (!out_) throw InputError(path_.string() + ": cannot be written in full");
}

void write_objects_csv(const std::vector<ObjectSnapshot>& objects, const ClassNameOf& class_name,
                       const std::filesystem::path& file) {
  CsvFile csv(file, kObjectsHeader);
  for (const ObjectSnapshot& object : objects) {
    Cells cells{std::to_string(to_index(object.id)), std::to_string(object.class_id),
                class_name(object.class_id), std::to_string(object.stationarity_class)};
    const Pose4 pose = object.pose();
    append(cells,
           {length(pose.position_W.x()), length(pose.position_W.y()), length(pose.position_W.z()),
            length(pose.yaw_rad), length(object.box.size_m.x()), length(object.box.size_m.y()),
            length(object.box.size_m.z()), length(object.box.pose.position_W.z())});
    append(cells, belief_cells(object.belief));
    append(cells, {std::to_string(object.first_seen_ns), std::to_string(object.last_seen_ns),
                   std::to_string(object.observations), object.last_robot});
    csv.row(cells);
  }
  csv.close();
}

EventsCsv::EventsCsv(const std::filesystem::path& file) : file_(file, kEventsHeader) {}

void EventsCsv::add(const ObjectEvent& event, const std::string& class_name) {
  const Evidence& evidence = event.evidence;
  Cells cells{std::to_string(event.sequence),
              std::to_string(event.stamp_ns),
              to_string(event.kind),
              std::to_string(to_index(event.object)),
              std::to_string(event.class_id),
              class_name,
              event.robot,
              std::to_string(event.frame_sequence)};
  append(cells, box_cells(event.box));
  Cells previous(4);  // empty: the object was nowhere before
  if (event.previous_box) {
    previous = box_cells(*event.previous_box);
    previous.resize(4);
  }
  append(cells, previous);
  append(cells,
         {event.absorbed ? std::to_string(to_index(*event.absorbed)) : "", evidence.rule,
          number(evidence.delta_m), std::to_string(evidence.stationarity_class), number(evidence.k),
          number(evidence.c1), number(evidence.c2), number(evidence.visible_share),
          number(evidence.seen_through_share), number(evidence.measurement_sigma_m)});
  append(cells, belief_cells(evidence.before));
  append(cells, belief_cells(evidence.after));
  // Last, for readers that go by position. Empty: no ADDED, and so no arrival.
  cells.push_back(event.kind == EventKind::kAdded ? to_string(event.arrival) : "");
  file_.row(cells);
}

TimingCsv::TimingCsv(const std::filesystem::path& file)
    : file_(file, "frame,stamp_ns,robot,stage,wall_ms,cpu_ms") {}

void TimingCsv::add(const Frame& frame, const std::vector<StageTiming>& timings) {
  for (const StageTiming& timing : timings) {
    file_.row({std::to_string(frame.sequence), std::to_string(frame.stamp_ns), frame.robot,
               timing.stage, number(timing.wall_ms), number(timing.cpu_ms)});
  }
}

}  // namespace pocd
