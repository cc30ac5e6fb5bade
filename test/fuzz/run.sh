#!/usr/bin/env bash
# Fuzzes the reader of recordings under the address and undefined behaviour sanitizers.
# usage: run.sh [SECONDS] (300). Needs clang-14 and libclang-rt-14-dev; not part of the tests.
set -euo pipefail

seconds=${1:-300}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
core=$here/../../pocd_core
clang=$(command -v clang++-14 || true)
if [[ -z $clang ]]; then
  echo "fuzz/run.sh: clang++-14 is missing (apt-get install clang-14 libclang-rt-14-dev)" >&2
  exit 1
fi
work=${POCD_FUZZ_DIR:-$(mktemp -d)}
mkdir -p "$work/corpus"
sources=("$here/fuzz_mcap.cpp" "$core/src/common/check.cpp")
for name in byte_source cdr compression mcap_open mcap_reader mcap_records ros_messages; do
  sources+=("$core/src/recording/$name.cpp")
done
"$clang" -std=c++17 -g -O1 -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
  -I"$core/include" -isystem /usr/include/eigen3 "${sources[@]}" -lzstd -llz4 -lz -o "$work/fuzz_mcap"
cd "$work"
./fuzz_mcap -max_total_time="$seconds" -max_len=16384 -rss_limit_mb=512 -timeout=10 \
  -print_final_stats=1 "$work/corpus" "$here/seeds"
