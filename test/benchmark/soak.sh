#!/usr/bin/env bash
# A site in real time on a real bus: robots come, end or die, and come again; subscribers come and go; a second
# node is restarted and killed. Two nodes, a mirror and a recorder are measured every ten seconds; the node, the
# mirror and the recorder that are never restarted have to stay as large as they were. By hand, not a test.
# usage: soak.sh BIN_DIR OUTPUT_DIR [MINUTES (60)]
# Writes soak.csv, heap.csv (what of the node's and the recorder's heap is in use), and soak.png where gnuplot is
# installed. Exit code: 0 all is flat, 1 something grew or failed, 3 void: Fast DDS's discovery hung (docs/operating.md).
set -euo pipefail
[[ $# -ge 2 ]] || { sed -n '2,7s/^# //p' "$0" >&2 && exit 2; }
bin=$(realpath "$1") minutes=${3:-60}
mkdir -p "$2"
output=$(realpath "$2")
self=$(realpath "$0")
cd "$(dirname "$self")/../.."

# Shared memory of its own, where that is allowed: what killed processes leave is counted, others' is not.
if [[ -z ${POCD_SOAK_ALONE:-} ]]; then
  export POCD_SOAK_ALONE=no
  if unshare --mount mount -t tmpfs soak /dev/shm 2>/dev/null; then
    export POCD_SOAK_ALONE=yes
    exec unshare --mount bash -c 'mount -t tmpfs -o size=4g soak /dev/shm && exec "$@"' - "$self" "$bin" "$output" "$minutes"
  fi
  echo "soak: /dev/shm is shared with all that runs here" >&2
fi
export ROS_DOMAIN_ID=${ROS_DOMAIN_ID:-211}
export FASTRTPS_DEFAULT_PROFILES_FILE=$PWD/launch_scripts/loopback.xml
rm -rf "$output"/{soak.csv,heap.csv,log,memory,ring,mirror} && mkdir -p "$output"/{log,memory,ring}
declare -A pids=()
cleanup() { kill -KILL $(jobs -p) 2>/dev/null || true; }
trap cleanup EXIT
start() { # NAME PROGRAM ARGUMENT...
  local name=$1 program=$2
  shift 2
  "$bin/$program" "$@" >>"$output/log/$name" 2>&1 &
  pids[$name]=$!
}

# Slow, small cameras: the machine is to be idle most of the time, also when it does other work.
scenario() { # ROBOT...: the small warehouse with these two robots
  sed -e 's/^frame_rate_hz: .*/frame_rate_hz: 2/' -e "s/name: robot1/name: $1/" -e "s/name: robot2/name: $2/" \
    -e 's/^sensor: .*/sensor: stereo\ncamera: {width: 320, height: 240, fx: 230, fy: 230, cx: 159.5, cy: 119.5}/' \
    config/sim/demo.yaml
}
for pair in 0 1 2 3; do scenario "unit$((2 * pair))" "unit$((2 * pair + 1))" >"$output/pair$pair.yaml"; done
scenario dock1 dock2 >"$output/dock.yaml"

port=$((20000 + RANDOM % 20000))
start node pocd_node --config config/simulated.yaml --metrics "$port" --set "node.memory.folder=$output/memory/node"
dock() {
  start dock pocd_node --config config/simulated.yaml --name dock --robot dock1 --robot dock2 --set node.map_id=1 \
    --set node.outputs.namespace=dock --set "node.memory.folder=$output/memory/dock"
}
dock
start mirror pocd_mirror --output "$output/mirror"
start recorder pocd_record --output "$output/ring/run.mcap" --ring 100

metric() { # NAME TEXT
  sed -n "s/^$1{[^}]*} \([0-9.e+]*\)$/\1/p" <<<"$2" | head -n 1
}
measure() { # NAME: resident anonymous memory [kB], threads, file handles
  local status
  status=$(cat "/proc/${pids[$1]}/status" 2>/dev/null || true)
  echo "$(sed -n 's/^RssAnon:[^0-9]*\([0-9]*\) kB/\1/p' <<<"$status"),$(
    sed -n 's/^Threads:[^0-9]*//p' <<<"$status"),$(ls "/proc/${pids[$1]}/fd" 2>/dev/null | wc -l)"
}
sample() {
  local text
  text=$(curl -s -m 5 "http://127.0.0.1:$port/metrics" || true)
  echo "$SECONDS,$(measure node),$(measure mirror),$(measure recorder),$(measure dock),$(
    metric pocd_queue_frames "$text"),$(metric pocd_map_messages_waiting "$text"),$(
    metric pocd_frames_processed_total "$text"),$(metric pocd_frames_dropped_total "$text"),$(
    metric pocd_objects "$text"),$(metric pocd_robots "$text"),$(ls /dev/shm | wc -l),$(
    du -sk /dev/shm | cut -f1),$(du -sk "$output/ring" | cut -f1),$(du -sk "$output/memory/node" | cut -f1)"
}
heap() { # what is in use and what is free between it, from time to time: it is read as a whole
  echo "$SECONDS $(python3 test/benchmark/heap_use.py "${pids[node]}" 2>/dev/null) $(
    python3 test/benchmark/heap_use.py "${pids[recorder]}" 2>/dev/null)" | tr ' ' ,
}
echo "seconds,node_used_kb,node_free_kb,recorder_used_kb,recorder_free_kb" >"$output/heap.csv"
columns=seconds
for process in node mirror recorder dock; do columns+=",${process}_kb,${process}_threads,${process}_fds"; done
echo "$columns,queue,map_waiting,frames,dropped,objects,robots,shm_files,shm_kb,ring_kb,memory_kb" >"$output/soak.csv"

alive() { kill -0 "${pids[$1]}" 2>/dev/null; }
fail() {
  echo "soak: after $SECONDS s: $*" >&2
  exit 1
}
hung() { # no growth and no fault of ours can be seen any more
  [[ $(metric pocd_discovery_stalls_total "$(curl -s -m 5 "http://127.0.0.1:$port/metrics")") == [1-9]* ]] ||
    grep -q "discovery has not ended a turn" "$output"/log/{node,mirror,recorder} || return 0
  echo "soak: after $SECONDS s: void: Fast DDS's discovery hangs (Fast-DDS #6502): $(
    grep -h "discovery has not ended a turn" "$output"/log/{node,mirror,recorder} | head -n 1)" >&2
  exit 3
}
SECONDS=0
round=0 moved=0 frames=""
until ((SECONDS >= 60 * minutes)); do
  # Every ten seconds something happens; what, the number of the round decides, so that two runs are alike.
  pair=$((round / 4 % 4))
  if ((round % 4 == 0)); then # robots, who drive for some 40 s unless they die
    # Not beside themselves: on a machine with much to do they would become more and more.
    [[ -n ${pids[pair$pair]:-} ]] && alive "pair$pair" ||
      start "pair$pair" pocd_play --dataset sim --input "$output/pair$pair.yaml" --no-color
    ((round % 8)) || { [[ -n ${pids[dock_robots]:-} ]] && alive dock_robots ||
      start dock_robots pocd_play --dataset sim --input "$output/dock.yaml" --no-color --max-frames 200; }
  fi
  ((round % 12 == 3)) && kill -KILL "${pids[pair$pair]}" 2>/dev/null || true
  if ((round % 6 == 0)); then # subscribers: for twenty seconds, every other one is killed
    if ((round / 6 % 2)); then
      timeout --signal KILL 12 "$bin/pocd_mirror" --timeout 20 >>"$output/log/visitors" 2>&1 &
    else
      "$bin/pocd_mirror" --timeout 20 >>"$output/log/visitors" 2>&1 &
    fi
  fi
  ((round % 10 == 0)) && { "$bin/pocd_health" --timeout 10 >>"$output/log/health" 2>&1 || true; }
  if ((round % 30 == 29)); then # the other node: stopped in order, and killed
    kill "-$(((round / 30) % 2 ? 9 : 15))" "${pids[dock]}" && { wait "${pids[dock]}" 2>/dev/null || true; }
    dock
  fi
  sample >>"$output/soak.csv"
  for name in node mirror recorder; do alive "$name" || fail "$name has ended: $(tail -n 2 "$output/log/$name")"; done
  hung
  ((round % 12)) || heap >>"$output/heap.csv"
  # A node that hears nobody any more is flat, too.
  now=$(tail -n 1 "$output/soak.csv" | cut -d, -f16)
  [[ $now == "$frames" ]] || moved=$SECONDS
  frames=$now
  ((SECONDS - moved < 180)) || fail "the node has processed no frame for three minutes, of robots that come and go"
  round=$((round + 1))
  while ((SECONDS < 10 * round)); do sleep 1; done
done

# To the end in order: the mirror has the node's last map.
for name in "${!pids[@]}"; do [[ $name == pair* || $name == dock_robots ]] && kill "${pids[$name]}" 2>/dev/null || true; done
kill -TERM "${pids[node]}" "${pids[dock]}" && wait "${pids[node]}" || fail "the node ended with an error"
sleep 3
kill -INT "${pids[mirror]}" && wait "${pids[mirror]}" || fail "the mirror is not in step: $(tail -n 1 "$output/log/mirror")"
kill -INT "${pids[recorder]}" && wait "${pids[recorder]}" || fail "the recorder: $(tail -n 2 "$output/log/recorder")"

if command -v gnuplot >/dev/null; then
  gnuplot >/dev/null 2>&1 <<TEXT || echo "soak: gnuplot failed" >&2
set terminal pngcairo size 1000,900 font ",10"
set output "$output/soak.png"
set datafile separator ","
set datafile columnheaders
set key outside right
set multiplot layout 4,1
set xlabel "minutes"
set yrange [0:]
set ylabel "anonymous memory [MB]"
f = "$output/soak.csv"
plot for [c in "node mirror recorder dock"] f using (column("seconds")/60):(column(c."_kb")/1024) with lines title c
set ylabel "threads"
plot for [c in "node mirror recorder dock"] f using (column("seconds")/60):(column(c."_threads")) with lines title c
set ylabel "file handles"
plot for [c in "node mirror recorder dock"] f using (column("seconds")/60):(column(c."_fds")) with lines title c
set ylabel "count"
plot for [c in "queue map_waiting robots objects shm_files"] f using (column("seconds")/60):(column(c)) with lines title c noenhanced
unset multiplot
TEXT
fi

# The first quarter is for coming up to size; of the rest, the last third beside the first.
awk -F, '
  NR == 1 { for (i = 1; i <= NF; ++i) name[i] = $i; next }
  { ++rows; for (i = 1; i <= NF; ++i) value[rows, i] = $i }
  function mean(i, from, to,   r, sum) { for (r = from; r <= to; ++r) sum += value[r, i]; return sum / (to - from + 1) }
  END {
    if (rows < 12) { print "too few samples to judge: " rows; exit 1 }
    a = int(rows / 4) + 1; third = int((rows - a + 1) / 3)
    for (i = 2; i <= NF; ++i) {
      early = mean(i, a, a + third - 1); late = mean(i, rows - third + 1, rows); most = 0
      for (r = a; r <= rows; ++r) if (value[r, i] > most) most = value[r, i]
      room = name[i] ~ /_kb$/ ? early / 10 + 8192 : name[i] ~ /_threads$/ ? 2 : name[i] ~ /_fds$/ ? 4 : \
        name[i] ~ /^shm_files$/ ? early / 4 + 8 : -1
      if (name[i] ~ /^(dock_|memory_kb)/) room = -1  # restarted; keeps a log of events
      verdict = room < 0 ? "" : late - early > room ? "GREW" : "flat"
      if (verdict == "GREW") bad = 1
      printf "%-18s %10.0f -> %10.0f  most %10.0f  %s\n", name[i], early, late, most, verdict
    }
    exit bad
  }' "$output/soak.csv"
