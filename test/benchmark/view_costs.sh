#!/usr/bin/env bash
# What clients of pocd_view cost: a node goes on with the memory of a large place, and ten clients and a page open it; then
# ten clients follow two robots in a small one. By hand, not a test; it needs npm and, for the page, chromium.
# usage: view_costs.sh BUILD_DIR BIN_DIR OUTPUT_DIR [AREA_M2 (10000)] [CLIENTS (10)]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=$(realpath "$1") bin=$(realpath "$2") area=${4:-10000} clients=${5:-10}
mkdir -p "$3" && output=$(realpath "$3")
export SKIP_DEFAULT_XML=1 ROS_DOMAIN_ID=98 FASTRTPS_DEFAULT_PROFILES_FILE=$PWD/launch_scripts/loopback.xml
cp test/view/package.json test/view/*.js "$output"
(cd "$output" && npm install --no-audit --no-fund --loglevel=error >npm.log)

processes=()
trap 'kill "${processes[@]}" 2>/dev/null || true' EXIT
# Starts pocd_view and waits for its address.
view() {
  rm -f "$output/address"  # of the server before
  "$bin/pocd_view" --port 0 "$@" >"$output/address" 2>"$output/pocd_view.log" &
  server=$! && processes+=("$server")
  until [[ -s "$output/address" ]]; do sleep 0.05; done
  address=$(cat "$output/address") port=${address##*:} && port=${port%%/*}
}
# The place is kept for the next run. That the test finds it slow to open, on a busy machine, does not matter here.
if [[ ! -d "$output/large_$area" ]]; then
  rm -rf "$output/making"
  POCD_AREA_M2=$area POCD_KEEP_MEMORY="$output/making" "$build/pocd_test/unit/memory/test_memory" \
    --gtest_filter='*ALargePlace*' >"$output/large.log" || grep -q "restored in" "$output/large.log"
  mv "$output/making" "$output/large_$area"
fi
"$bin/pocd_node" --config config/simulated.yaml --set node.memory.folder="$output/large_$area" >"$output/node.log" 2>&1 &
node=$! && processes+=("$node")
start=$(date +%s.%N)
view
node "$output/costs.js" "$port" --until-drawn
cpu() { awk '{print ($14 + $15) / 100}' "/proc/$server/stat"; }
rss() { sed -n 's/^VmRSS:[^0-9]*\([0-9]*\) kB/\1/p' "/proc/$server/status"; }
echo "$area m2: pocd_view has fetched and drawn all of the map after $(echo "$(date +%s.%N) - $start" | bc | cut -c1-5) s, $(cpu) s of CPU, $(($(rss) / 1024)) MB"
node "$output/costs.js" "$port" "$server" "$clients" 10
if command -v chromium >/dev/null; then
  node "$output/first_picture.js" "$(command -v chromium)" "$address" "$output/large.png"
fi
kill "$server" "$node" && wait "$server" "$node" || true

echo "two robots in a small place (config/sim/demo.yaml), at their pace:"
"$bin/pocd_node" --config config/simulated.yaml --robot robot1 --robot robot2 >"$output/node.log" 2>&1 &
node=$! && processes+=("$node")
view
"$bin/pocd_play" --dataset sim --input config/sim/demo.yaml --no-color >"$output/play.log" 2>&1 &
play=$! && processes+=("$play")
sleep 5
before=$(cpu)
node "$output/costs.js" "$port" "$server" "$clients" 25 | tail -n 1
