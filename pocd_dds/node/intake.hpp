// Everything that comes in: robots as they come and go, their readers, merged into one order,
// handed to the queue.
#pragma once

#include <atomic>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "pocd/input/frame_merger.hpp"
#include "pocd/input/input_topics.hpp"
#include "pocd_dds/entities/bus_watch.hpp"
#include "pocd_dds/node/frame_queue.hpp"
#include "pocd_dds/node/latency_log.hpp"
#include "pocd_dds/node/pulse.hpp"
#include "pocd_dds/node/robot_input.hpp"
#include "pocd_dds/node/roster.hpp"

namespace pocd::dds {

struct RobotStatus {
  std::string name;
  bool live = false;
  std::uint64_t frames = 0, dropped = 0, lost = 0;
  std::string waiting_for;         ///< "" or what its frames wait for, or why it is not waited for
  std::uint64_t images = 0;        ///< depth images that came
  std::uint64_t rate_limited = 0;  ///< of them, beyond node.max_frame_rate_hz
  bool silent = false;             ///< is there, and has sent none for node.silent_wait_s
};

/// A robot that has gone, and why.
struct RobotDeparture {
  std::string name;
  std::string reason;
  StampNs wall_ns = 0;  ///< when it was noticed
};

struct IntakeStatus {
  std::vector<RobotStatus> robots;
  std::vector<RobotDeparture> departures;                   ///< the last few, latest last
  std::uint64_t departed_frames = 0, departed_dropped = 0;  ///< of robots that are not listed
  std::vector<ProblemCounter::Entry> problems;
  /// CPU time so far: taking images from the bus and converting them, and all of the thread [ms].
  double take_cpu_ms = 0.0, cpu_ms = 0.0;
  std::uint64_t visits = 0;  ///< turns that robots' inputs got, all robots together
};

/// Runs a thread of its own from construction to stop().
class Intake {
 public:
  /// `watch` has listened on the participant from its first moment. It, `queue` and `latency` must
  /// outlive the intake. Throws InputError for a bad topic or colour.
  Intake(const std::shared_ptr<Participant>& participant, const NodeConfig& node,
         const PipelineConfig& pipeline, BusWatch& watch, FrameQueue& queue, LatencyLog& latency);
  ~Intake();

  /// Takes what has arrived until now, hands every frame that it makes to the queue, and closes it.
  void stop();
  /// The thread has ended early; stop() still has to be called, and rethrow() says why.
  bool failed() const { return failed_; }
  /// After stop().
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }
  /// A frame was taken out of the queue.
  void room_made() { wakeup_.wake(); }
  /// As it was at most kIdle ago.
  IntakeStatus status() const;
  /// How long the thread has not ended a turn.
  double still_s() const { return pulse_.still_s(); }

 private:
  struct Robot {
    std::unique_ptr<Wakeup> wakeup;  ///< what has arrived is this robot's
    std::unique_ptr<RobotInput> input;
    bool named = false;      ///< by the configuration: stays when it has gone
    bool announced = false;  ///< the roster has it
  };

  void run();
  void step(bool last);
  /// A robot's turn, after its look(). Who has nothing new gets one every kIdle only: a sample must
  /// not cost a look at the whole fleet.
  void visit(const std::string& name, RobotInput& input, const std::set<std::string>& moved);
  /// True when something has changed.
  bool follow_roster();
  void check_type(const BusEvent& event);
  void follow(const std::vector<RosterChange>& changes);
  void meet(const std::string& name, const RobotConfig& config, bool named);
  void come(const std::string& name);
  void go(const RosterChange& change);
  /// While there is room, those who were turned away before.
  void meet_those_turned_away();
  /// True when nothing of the robot is left here and it is to be erased.
  bool see_off(const Robot& robot);
  void hand_over(bool last);
  void update_status();

  const std::shared_ptr<Participant> participant_;
  const NodeConfig node_;
  BusWatch& watch_;
  FrameQueue& queue_;
  LatencyLog& latency_;
  Wakeup wakeup_, tf_wakeup_{wakeup_};
  Pulse pulse_;
  const LabelTable labels_;
  ProblemCounter problems_;
  const InputTopics topics_;
  Roster roster_;
  TransformTree transforms_;            ///< of the topics that all robots share
  std::unique_ptr<TransformInput> tf_;  ///< null when every robot has its own
  const StreamContext context_;
  std::map<std::string, Robot> robots_;
  std::set<std::string> turned_away_;  ///< on the bus, but there was no room
  std::deque<RobotDeparture> departures_;
  double departed_take_cpu_ms_ = 0.0;
  std::uint64_t departed_frames_ = 0, departed_dropped_ = 0;
  std::uint64_t visits_ = 0;
  std::chrono::steady_clock::time_point swept_{};  ///< when all robots were last visited
  std::set<std::string> far_ahead_;  ///< with kMostBehind frames or more that wait for others
  FrameMerger<Frame> merger_;
  std::atomic<bool> stopping_{false}, failed_{false};
  std::exception_ptr failure_;
  mutable std::mutex status_mutex_;
  IntakeStatus status_;
  std::thread thread_;
};

}  // namespace pocd::dds
