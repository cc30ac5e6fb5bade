#!/usr/bin/env bash
# Compares the bytes of every ROS 2 type with those of another serialiser; then records a short simulated
# run with all of the component's topics, and has other people's readers decode it.
# usage: run.sh BIN_DIR WORK_DIR WRITE_MESSAGES. Exit code 77: skipped, there is no npm or no network.
set -euo pipefail

bin=$1 work=$2 write_messages=$3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
if ! command -v npm >/dev/null || ! command -v node >/dev/null; then
  echo "interop: skipped, npm and node are not installed"
  exit 77
fi
mkdir -p "$work"
cp "$here/package.json" "$here"/*.js "$work"
cd "$work"
if ! npm install --no-audit --no-fund --loglevel=error >npm.log 2>&1; then
  echo "interop: skipped, npm cannot fetch its packages:"
  tail -n 3 npm.log
  exit 77
fi

rm -rf messages && mkdir messages
"$write_messages" messages
node check_cdr.js messages

# A domain that no other test uses, as TestDomain of test/support takes one; nobody else on the network hears it.
locks=${TMPDIR:-/tmp}/pocd_test_domains_$(id -u)
mkdir -p "$locks"
for domain in $(seq 100 199); do
  exec 9>"$locks/$domain"
  flock -n 9 && break
done
export ROS_DOMAIN_ID=$domain SKIP_DEFAULT_XML=1
export FASTRTPS_DEFAULT_PROFILES_FILE=$here/../../launch_scripts/loopback.xml
pids=()
trap '((${#pids[@]} == 0)) || kill "${pids[@]}" 2>/dev/null || true' EXIT
# Waits for a line in a log: the processes say when they are ready.
wait_for() {
  for _ in $(seq 600); do
    grep -q "$1" "$2" && return 0
    sleep 0.1
  done
  echo "interop: no '$1' in $2:"
  cat "$2"
  exit 1
}
rm -f run.mcap
"$bin/pocd_record" --output run.mcap >record.log 2>&1 &
recorder=$!
pids+=("$recorder")
wait_for "recording on domain" record.log
"$bin/pocd_node" --config "$here/../../config/simulated.yaml" --robot robot1 --robot robot2 \
  --set node.outputs.markers_hz=5 >node.log 2>&1 &
node_pid=$!
pids+=("$node_pid")
wait_for "recording /pocd/objects/markers" record.log
# The player waits for the node only; the run is long enough for the recorder to find every topic.
"$bin/pocd_play" --dataset sim --input "$here/../../config/sim/demo.yaml" --max-frames 300 --clock \
  >play.log 2>&1 &
player=$!
pids+=("$player")
for topic in /robot1/depth/image_raw /robot1/segmentation /robot1/odom /robot2/depth/camera_info \
  /tf_static /clock; do
  wait_for "recording $topic" record.log
done
wait "$player" || { cat play.log; exit 1; }
kill -TERM "$node_pid" && wait "$node_pid" || { cat node.log; exit 1; }
kill -TERM "$recorder" && wait "$recorder" || { cat record.log; exit 1; }
pids=()
"$bin/pocd_info" --verify run.mcap
node check.js run.mcap | tee check.log
for topic in /robot1/depth/image_raw /robot1/segmentation /robot1/odom /robot2/depth/camera_info \
  /tf_static /clock pocd/map/tiles pocd/map/deltas pocd/map/manifest pocd/health pocd/frames \
  /diagnostics /pocd/map /pocd/surface /rmf_obstacles; do
  grep -q "^$topic: " check.log || { echo "interop: $topic was not recorded"; exit 1; }
done
