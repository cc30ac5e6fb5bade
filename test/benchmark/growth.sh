#!/usr/bin/env bash
# Which call sites of a node hold more and more memory: a node under heaptrack in a site in a hurry. By hand.
#   visits: every two seconds a subscriber comes, every eight seconds two robots; half of them are killed
#   laps:   two robots drive the same laps again and again, at five times their speed; their clocks begin anew with each
# usage: growth.sh BIN_DIR OUTPUT_DIR visits|laps [SECONDS (600)]
# Prints what is in use after a tenth, a quarter, half and all of the time, by call site, most growth first.
# Exit code: 0, 1 the node has ended, 3 void: it heard nobody any more (docs/operating.md).
set -euo pipefail
[[ $# -ge 3 && $3 =~ ^(visits|laps)$ ]] || { sed -n '2,7s/^# //p' "$0" >&2 && exit 2; }
bin=$(realpath "$1") kind=$3 seconds=${4:-600}
mkdir -p "$2"
output=$(realpath "$2")
self=$(realpath "$0")
cd "$(dirname "$self")/../.."
# What killed processes leave is not others', where that is allowed (soak.sh).
if [[ -z ${POCD_GROWTH_ALONE:-} ]] && unshare --mount mount -t tmpfs growth /dev/shm 2>/dev/null; then
  POCD_GROWTH_ALONE=yes exec unshare --mount bash -c 'mount -t tmpfs -o size=4g growth /dev/shm && exec "$@"' - "$self" "$bin" "$output" "$kind" "$seconds"
fi
command -v heaptrack >/dev/null || { echo "growth: heaptrack is not installed" >&2 && exit 2; }
export ROS_DOMAIN_ID=${ROS_DOMAIN_ID:-212}
export FASTRTPS_DEFAULT_PROFILES_FILE=$PWD/launch_scripts/loopback.xml
rm -rf "$output"/{memory,heaptrack.*,log} && mkdir -p "$output/log"
node=
# shellcheck disable=SC2046  # words are process numbers
cleanup() { kill -KILL $node $(jobs -p) 2>/dev/null || true; }
trap cleanup EXIT

for pair in 0 1 2 3; do
  sed -e 's/^frame_rate_hz: .*/frame_rate_hz: 2/' -e "s/name: robot1/name: unit$((2 * pair))/" -e "s/name: robot2/name: unit$((2 * pair + 1))/" \
    -e 's/^sensor: .*/sensor: stereo\ncamera: {width: 320, height: 240, fx: 230, fy: 230, cx: 159.5, cy: 119.5}/' \
    config/sim/demo.yaml >"$output/pair$pair.yaml"
done
heaptrack -o "$output/heaptrack" "$bin/pocd_node" --config config/simulated.yaml --set "node.memory.folder=$output/memory" \
  >"$output/log/node" 2>&1 &
while [[ -z $node ]]; do # heaptrack starts it
  sleep 0.2
  kill -0 $! || exit 1
  for pid in $(pgrep -x pocd_node); do grep -qz "folder=$output/memory$" "/proc/$pid/cmdline" && node=$pid; done
done
"$bin/pocd_mirror" >"$output/log/mirror" 2>&1 &

play() { "$bin/pocd_play" --dataset sim --input "$output/pair$1.yaml" --no-color "${@:2}" >>"$output/log/play" 2>&1; }
robots() { grep -c "is on the bus" "$output/log/node" || true; }
SECONDS=0
heard=0 moved=0
for ((i = 0; SECONDS < seconds; ++i)); do
  kill -0 "$node" 2>/dev/null || { echo "growth: the node has ended: $(tail -n 2 "$output/log/node")" >&2 && exit 1; }
  now=$(robots)
  [[ $now == "$heard" ]] || moved=$SECONDS
  heard=$now
  ((SECONDS - moved < 60)) || { echo "growth: void: after $SECONDS s the node has heard of no new robot for a minute" >&2 && exit 3; }
  if [[ $kind == laps ]]; then
    play $((i % 4)) --speed 5
    continue
  fi
  if ((i % 2)); then
    timeout --signal KILL 4 "$bin/pocd_mirror" --timeout 20 >>"$output/log/visitors" 2>&1 &
  else
    "$bin/pocd_mirror" --timeout 4 >>"$output/log/visitors" 2>&1 &
  fi
  if ((i % 8 == 4)); then
    timeout --signal KILL 8 "$bin/pocd_play" --dataset sim --input "$output/pair$((i / 4 % 4)).yaml" --no-color >>"$output/log/play" 2>&1 &
  elif ((i % 8 == 0)); then
    play $((i / 4 % 4)) --max-frames 16 &
  fi
  sleep 2
done
# Killed, it holds what it held: a node that ends in order gives all of it back.
kill -KILL "$node"
until ! kill -0 "$node" 2>/dev/null; do sleep 0.1; done
sleep 3 # heaptrack writes the rest
echo "robots that came: $(robots), that were killed: $(grep -c "no sign of life" "$output/log/node" || true)"
python3 test/benchmark/heap_sites.py "$output"/heaptrack.* $((seconds / 10)) $((seconds / 4)) $((seconds / 2)) "$seconds"
