#!/usr/bin/env bash
# How long frames take through the component on a bus: plays recorded robots (640 x 480, colour, depth and
# segmentation) over loopback in real time to pocd_node on two cores, and prints the time from the last image
# of a frame received to its map delta written, frames lost, and where CPU time went; without and with a
# pocd_mirror that follows the map on the same cores. By hand, not a test.
# usage: bus_latency.sh BIN_DIR CONFIG SCENARIO [SECONDS (20) [ROBOTS ...]]
# With ROBOTS: so many robots at 15 Hz, one number after the other; how many one node carries.
set -euo pipefail

bin=$1 config=$2 scenario=$3 seconds=${4:-20} fleets=("${@:5}")
here=$(dirname "${BASH_SOURCE[0]}")
work=$(mktemp -d "${TMPDIR:-/tmp}/bus_latency.XXXXXX")
export SKIP_DEFAULT_XML=1
bus=(--domain $((100 + $$ % 100)) --profiles "$here/../../launch_scripts/loopback.xml")
node=""
trap '[[ -z $node ]] || kill -9 "$node" 2>/dev/null; rm -rf "$work"' EXIT

# column FILE NUMBER: p50, p95, p99 and largest value.
quantiles() {
  tail -n +2 "$1" | cut -d, -f"$2" | sort -g | awk '{v[NR] = $1} END {
    if (NR == 0) {print "no frames"; exit}
    printf "p50 %.1f  p95 %.1f  p99 %.1f  max %.1f ms\n", v[int(0.50 * (NR - 1)) + 1],
      v[int(0.95 * (NR - 1)) + 1], v[int(0.99 * (NR - 1)) + 1], v[NR]}'
}

# ROBOTS RATE_HZ LIMIT_MS FOLLOWERS: plays $work/run.mcap to a node, with so many copies of the map beside it.
measure() {
  local robots=$1 rate=$2 limit_ms=$3 followers=$4 names=() mirrors=() sent taken health in_step=0
  for ((i = 1; i <= robots; ++i)); do names+=(--robot "robot$i"); done
  sent=$("$bin/pocd_info" "$work/run.mcap" | awk '/depth\/image_raw/ {for (f = 1; f <= NF; ++f) if ($f ~ /^[0-9]+$/) {n += $f; break}} END {print n}')
  taskset -c 0,1 "$bin/pocd_node" "${bus[@]}" --config "$config" "${names[@]}" \
    --set node.color=required --set node.segmentation=required --set node.map_period_s=0 \
    --set threads=2 --latency "$work/latency.csv" >"$work/node.log" 2>&1 &
  node=$!
  for ((i = 0; i < followers; ++i)); do
    taskset -c 0,1 "$bin/pocd_mirror" "${bus[@]}" --until-end --timeout $((seconds + 60)) >"$work/mirror.log" 2>&1 &
    mirrors+=($!)
  done
  taskset -c 0,1 "$bin/pocd_play" "${bus[@]}" "$work/run.mcap" >"$work/play.log" 2>&1
  sleep 1
  health=$("$bin/pocd_health" "${bus[@]}" || true)
  kill -TERM "$node"
  wait "$node" || true
  node=""
  for mirror in "${mirrors[@]}"; do
    if wait "$mirror"; then in_step=$((in_step + 1)); fi
  done
  taken=$(($(wc -l <"$work/latency.csv") - 1))
  echo "$robots robot(s) at $rate Hz, $followers copies of the map ($in_step in step at the end), load average $(cut -d' ' -f1 /proc/loadavg)"
  echo "  frames sent $sent, through to a delta $taken, lost $((sent - taken))"
  echo "  by robot: $(tail -n +2 "$work/latency.csv" | cut -d, -f1 | sort -V | uniq -c | awk '{printf "%s %d  ", $2, $1}')"
  echo "  $health"
  echo "  last image to delta written (wanted: p99 <= $limit_ms ms): $(quantiles "$work/latency.csv" 6)"
  echo "    of that waiting for the other robot and the queue: $(quantiles "$work/latency.csv" 3)"
  echo "    pipeline:                                         $(quantiles "$work/latency.csv" 4)"
  echo "    writing:                                          $(quantiles "$work/latency.csv" 5)"
  sed -n 's/.*CPU per frame/  CPU per frame/p' "$work/node.log"
}

record() {
  "$bin/make_robot_recording" "$scenario" "$work/run.mcap" "$1" "$2" "$seconds"
  cat "$work/run.mcap" >/dev/null  # from memory
}

# ROBOTS RATE_HZ LIMIT_MS: alone, then with somebody who follows the map.
measure_both() {
  record "$1" "$2"
  measure "$@" 0
  measure "$@" 1
}

if ((${#fleets[@]} > 0)); then
  for robots in "${fleets[@]}"; do
    record "$robots" 15
    measure "$robots" 15 66 0
  done
else
  measure_both 2 15 66
  measure_both 1 30 33
fi
