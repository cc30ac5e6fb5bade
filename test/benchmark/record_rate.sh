#!/usr/bin/env bash
# How fast pocd_record is: plays uncompressed images at a rate over loopback for a minute and records them
# with zstd on two cores. By hand, not a test.
# usage: record_rate.sh BIN_DIR MAKE_IMAGE_RECORDING [MB_PER_S (60)] [SECONDS (60)]
set -euo pipefail

bin=$1 make=$2 rate=${3:-60} seconds=${4:-60}
work=$(mktemp -d "${TMPDIR:-/tmp}/record_rate.XXXXXX")
export ROS_DOMAIN_ID=91 SKIP_DEFAULT_XML=1
recorder=""
trap '[[ -z $recorder ]] || kill -9 "$recorder" 2>/dev/null; rm -rf "$work"' EXIT
"$make" "$work/source.mcap" "$seconds" "$rate"
cat "$work/source.mcap" >/dev/null  # from memory, so that only the recorder uses the disk
taskset -c 0,1 "$bin/pocd_record" --output "$work/out.mcap" >"$work/record.log" 2>&1 &
recorder=$!
sleep 1
taskset -c 0,1 "$bin/pocd_play" "$work/source.mcap" --wait-for '*' >"$work/play.log" 2>&1
ticks=$(awk '{print $14 + $15}' "/proc/$recorder/stat")
kill -TERM "$recorder"
wait "$recorder" || true
recorder=""
tail -n 1 "$work/play.log"
tail -n 1 "$work/record.log"
echo "CPU of pocd_record: $(awk -v t="$ticks" -v hz="$(getconf CLK_TCK)" -v s="$seconds" \
  'BEGIN {printf "%.0f %% of one core", 100 * t / hz / s}')"
"$bin/pocd_info" "$work/out.mcap" | sed -n '/size\|messages/p'
