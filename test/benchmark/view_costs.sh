#!/usr/bin/env bash
# What clients of pocd_view cost: a node goes on with the memory of a large place, and ten clients and a page open it.
# Prints the table of docs/view.md. By hand, not a test; it needs npm and, for the page, chromium.
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
printf '| %s m2 | |\n|---|---|\n' "$area"
echo "| \`pocd_view\`, until all of the map is fetched and drawn | $(echo "$(date +%s.%N) - $start" | bc | cut -d. -f1) s, $(cpu | cut -d. -f1) s of CPU, $(($(rss) / 1024)) MB |"
node "$output/costs.js" "$port" "$server" "$clients" 10
if command -v chromium >/dev/null; then
  node "$output/first_picture.js" "$(command -v chromium)" "$address" "$output/large.png" 2>>"$output/chromium.log"
else
  echo "| a page in Chromium | not measured: it is not installed |"
fi
echo "load of the machine meanwhile: $(cut -d' ' -f1 /proc/loadavg)" >&2
kill "$server" "$node" && wait "$server" "$node" || true
