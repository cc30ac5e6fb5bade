// What a node says of itself, about once a second.
#include <spdlog/spdlog.h>

#include "pocd/common/cpu_time.hpp"
#include "pocd_dds/node/node_impl.hpp"

namespace pocd::dds {

void Node::Impl::add_problems(IntakeStatus& input) {
  for (const std::uint64_t epoch : rivals.take()) {
    spdlog::warn(
        "{}: epoch {:016x} publishes map {} as well: subscribers follow one of the two and say "
        "that "
        "they are stale; give each node a node.map_id of its own",
        topics::kMapManifest.name, epoch, config.node.map_id);
  }
  if (rivals.manifests_heard() > 0) {
    input.problems.push_back(
        {topics::kMapManifest.name, "second_publisher", rivals.manifests_heard(), ""});
  }
  if (outputs.grid_too_large()) {
    input.problems.push_back({topics::kOccupancy.name, "grid_too_large", 1, ""});
  }
  if (outputs.grid_cut()) {
    input.problems.push_back({topics::kOccupancy.name, "outside_extent", 1, ""});
  }
  for (const auto& [topic, count] : outputs.broken()) {
    input.problems.push_back({topic, "output_failed", count, ""});
  }
  if (draws_failed > 0) input.problems.push_back({"rt/", "output_failed", draws_failed, ""});
  const std::uint64_t dropped_events = objects.dropped_events();
  if (dropped_events > 0) {
    input.problems.push_back({topics::kObjectEvents.name, "events_dropped", dropped_events, ""});
  }
  rivals.count_problems(problems);
  map.count_problems(problems);
  clock.count_problems(problems);
  keeper.count_problems(problems);
  if (feed) feed->count_problems(problems);
  if (desk) desk->count_problems(problems);
  const auto more = problems.entries();
  input.problems.insert(input.problems.end(), more.begin(), more.end());
}

NodeState Node::Impl::judge(const IntakeStatus& input, const WorkStatus& work,
                            const std::string& word) {
  HealthSigns signs;
  signs.write_failures = work.write_failures;
  signs.output_failures = outputs.failures() + draws_failed + graph->failures();
  for (const auto& [topic, count] : outputs.broken()) signs.output_failures += count;
  for (const auto& entry : input.problems) signs.problems += entry.count;
  signs.dropped = queue.dropped();
  const auto look = [&](const char* thread, double still_s, bool ended) {
    if (ended || still_s <= signs.still_s) return;
    signs.still_s = still_s;
    signs.still_thread = thread;
  };
  look("the pipeline", worker_pulse.still_s(), worked);
  look("the intake", intake->still_s(), ending);
  look("the writer of objects", teller_pulse.still_s(), told);
  look("Fast DDS's discovery", participant->still_s(), false);
  NodeState state;
  state.word = word;
  state.still_s = signs.still_s;
  state.verdict = health.judge(signs, Clock::now());
  state.ready = !ending && signs.still_s < config.node.stall_s;
  state.discovery_stalls = participant->stalls();
  return state;
}

void Node::Impl::send_status(const std::string& word) {
  IntakeStatus input = intake->status();
  add_problems(input);
  WorkStatus work;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    counts.processing_ms = busy_frames == 0 ? 0.0 : busy_ms / static_cast<double>(busy_frames);
    busy_ms = 0.0;
    busy_frames = 0;
    counts.latency_ms = latency.take_longest_ms();
    counts.intake_cpu_ms = input.cpu_ms;
    counts.take_cpu_ms = input.take_cpu_ms;
    counts.process_cpu_ms = process_cpu_ms();
    counts.write_failures = objects.failures() + map.failures() + frames.failures() +
                            (feed ? feed->failures() : 0) + (looks ? looks->failures() : 0) +
                            (desk ? desk->failures() : 0);
    counts.map = map.traffic();
    counts.objects = objects.count();
    counts.kept = keeper.on() ? std::make_optional(keeper.status()) : std::nullopt;
    work = counts;
  }
  map.send_manifest(work.objects, word == "stopped" && map.waiting() == 0,
                    work.kept.value_or(MemoryStatus{}));
  NodeReport report{input, work, queue.size(), queue.dropped(), judge(input, work, word), ending};
  failing = report.state.verdict.level >= 2;
  const pocd_msgs::msg::NodeHealth health = status->send(report, clock.now_ns());
  graph->update();
  if (on_status) on_status(report, health);
}

}  // namespace pocd::dds
