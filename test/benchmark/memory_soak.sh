#!/usr/bin/env bash
# An hour in the small warehouse with a memory: two robots at 2 Hz, a change in each lap. Says every few
# seconds how much memory the process and its folder hold, and verifies the folder. By hand, not a test.
# usage: memory_soak.sh BIN_DIR OUTPUT_DIR [LAPS (300)]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

bin=$1 output=$2 laps=${3:-300}
rm -rf "$output" && mkdir -p "$output"
{
  sed -e 's/^frame_rate_hz: .*/frame_rate_hz: 2/' -e '/^visits:/,$d' config/sim/demo.yaml
  echo "visits:"
  echo "  - name: lap 0"
  carton=middle_2
  for ((lap = 1; lap < laps; ++lap)); do
    printf '  - name: lap %d\n    changes:\n' "$lap"
    if ((lap % 2)); then
      printf '      - {move: middle_1, by: [0.5, 0, 0]}\n      - {remove: %s}\n' "$carton"
    else
      carton=carton_$lap
      printf '      - {move: middle_1, by: [-0.5, 0, 0]}\n'
      printf '      - {add: {name: %s, kind: carton, at: [0.9, 0, 0]}}\n' "$carton"
    fi
  done
} >"$output/soak.yaml"

"$bin/pocd_map" --dataset sim --input "$output/soak.yaml" --config config/simulated.yaml \
  --output "$output/run" --memory "$output/memory" >"$output/log" 2>&1 &
run=$!
trap 'kill "$run" 2>/dev/null || true' EXIT
echo "seconds,process_mb,file_kb,wal_kb"
for ((t = 0; ; t += 5)); do
  sleep 5
  rss=$(sed -n 's/^VmRSS:[^0-9]*\([0-9]*\) kB/\1/p' "/proc/$run/status" 2>/dev/null || true)
  [[ -n "$rss" ]] || break
  size() { stat -c %s "$1" 2>/dev/null || echo 0; }
  echo "$((t + 5)),$((rss / 1024)),$(($(size "$output/memory/memory.sqlite") / 1024)),$(($(size \
    "$output/memory/memory.sqlite-wal") / 1024))"
done
wait "$run"
trap - EXIT
tail -n 3 "$output/log"
"$bin/pocd_memory" verify "$output/memory"
"$bin/pocd_memory" info "$output/memory"
