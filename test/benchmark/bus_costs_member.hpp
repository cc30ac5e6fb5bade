// Those who listen to the component, as processes of their own, and what they tell at their end.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bus_costs_network.hpp"
#include "pocd_dds/entities/participant.hpp"
#include "run_command.hpp"

namespace pocd::benchmark {

struct MemberOptions {
  int domain = 0;
  std::string profiles;
  /// robot: objects, events and health; everything: all topics but the surface; surface: that, and
  /// ends when it has come; tiles, snapshot: a mirror that ends when it is in step; follow: a
  /// mirror that goes on
  std::string kind = "robot";
  int participants = 1;
  double lease_s = 5.0;
};
dds::BusOptions bus_options(const MemberOptions& options);

/// The process that Member starts: listens until it gets SIGTERM, then writes its report; SIGUSR1
/// begins a new one.
int run_member(const MemberOptions& options);

struct TopicTraffic {
  double messages = 0.0, bytes = 0.0;
};

/// What members tell: "topic NAME MESSAGES BYTES" (of the first participant), "NAME VALUE".
struct MemberReport {
  std::map<std::string, TopicTraffic> topics;
  std::map<std::string, double> values;
};

class Member {
 public:
  explicit Member(const MemberOptions& options);

  bool running() const { return process_.running(); }
  /// Has found the component: those who listen when all readers have their writers, a mirror when
  /// it is in step.
  bool ready() const { return process_.out().find("ready") != std::string::npos; }
  /// What was counted until now is forgotten.
  void restart() { process_.signal(SIGUSR1); }
  ProcessCost cost() const { return process_cost(process_.pid()); }
  /// Ends it if it has not ended. Throws std::runtime_error with what it said when it failed.
  MemberReport finish();

 private:
  Process process_;
};

}  // namespace pocd::benchmark
