#!/usr/bin/env bash
# Two simulated robots on the bus, the component, and a subscriber that mirrors its map. Between laps
# boxes are moved, removed and added. Prints what the system said changed beside what really changed.
# On a terminal the live page is up meanwhile, and stays until Ctrl-C.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

output=output/demo
scenario=config/sim/demo.yaml
view=true
[[ -t 1 ]] || view=false
case "$*" in
  "") ;;
  --no-view) view=false ;;
  --help | -h) echo "usage: demo.sh [--no-view]   (results in $output)" && exit 0 ;;
  *)
    echo "usage: demo.sh [--no-view]   (results in $output)" >&2
    exit 2
    ;;
esac

launch_scripts/install_dependencies.sh
launch_scripts/build.sh
export PATH="$PWD/install/bin:$PATH"
rm -rf "$output"
mkdir -p "$output"

# A quiet corner of the bus: loopback only, profiles of the working directory not loaded, and a
# domain of its own so that demonstrations beside each other do not hear each other.
export SKIP_DEFAULT_XML=1
domain=$((100 + $$ % 100))
bus=(--domain "$domain" --profiles launch_scripts/loopback.xml)

processes=()
stop_all() {
  trap - EXIT
  ((${#processes[@]} == 0)) || kill -INT "${processes[@]}" 2>/dev/null || true
  wait || true
}
trap stop_all EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

failed() {
  echo "demo.sh: $1 failed, its log:" >&2
  tail -n 20 "$output/$1.log" >&2
  exit 1
}

# From the stamp at which the second lap begins, changes are drawn into the picture.
pocd_mirror "${bus[@]}" --until-end --changes-since 14 --output "$output" >"$output/pocd_mirror.log" 2>&1 &
mirror=$! && processes+=("$mirror")
pocd_node "${bus[@]}" --config config/simulated.yaml --robot robot1 --robot robot2 --lossless \
  >"$output/pocd_node.log" 2>&1 &
node=$! && processes+=("$node")

if $view; then
  # Another program may have the usual port.
  for port in 8080 0; do
    pocd_view "${bus[@]}" --port "$port" >"$output/pocd_view.address" 2>"$output/pocd_view.log" &
    page=$!
    for ((tenth = 0; tenth < 100; ++tenth)); do
      [[ -s "$output/pocd_view.address" ]] && break 2
      kill -0 "$page" 2>/dev/null || break
      sleep 0.1
    done
    kill "$page" 2>/dev/null || true
  done
  [[ -s "$output/pocd_view.address" ]] || failed pocd_view
  processes+=("$page")
  echo "live page: $(cat "$output/pocd_view.address")"
fi
echo "two robots drive three laps on domain $domain ..."
pocd_play "${bus[@]}" --dataset sim --input "$scenario" --no-color --lossless --fast \
  >"$output/pocd_play.log" 2>&1 &
play=$! && processes+=("$play")
# The player waits for a node; one that could not start never comes.
status=0
wait -n -p ended "$play" "$node" || status=$?
[[ $ended == "$play" ]] || failed pocd_node
((status == 0)) || failed pocd_play
kill -INT "$node"
wait "$node" || failed pocd_node
# It ends with the node, unless it has never heard of one.
for ((tenth = 0; tenth < 600; ++tenth)); do
  kill -0 "$mirror" 2>/dev/null || break
  sleep 0.1
done
kill -INT "$mirror" 2>/dev/null || true
wait "$mirror" || failed pocd_mirror
processes=()
! $view || processes=("$page")

tail -n 1 "$output/pocd_mirror.log"
echo
pocd_demo_report --scenario "$scenario" --events "$output/events.csv" | tee "$output/report.txt"
echo
echo "picture of the map: $output/birdseye.png (dashed red: where objects were; blue: new ones)"
echo "surface: $output/map.ply   events: $output/events.csv   logs: $output/*.log"
if $view; then
  echo
  echo "the page stays up at $(cat "$output/pocd_view.address"); Ctrl-C ends it"
  trap 'exit 0' INT
  wait "$page" || failed pocd_view
fi
