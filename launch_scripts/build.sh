#!/usr/bin/env bash
# Builds the workspace with colcon into build/ and install/ (one merged prefix, Release), or, with a
# sanitizer, into build/thread and install/thread or build/address and install/address.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() {
  cat <<'TEXT'
usage: build.sh [--core] [--tests] [--werror] [--sanitize thread|address] [-- CMAKE_ARGUMENT...]
  --core      only pocd_core (library, pocd_map, pocd_parameters): needs no Fast DDS
  --tests     also the tests and benchmarks; with --core, those of the core
  --werror    warnings are errors
  --sanitize  thread: ThreadSanitizer; address: AddressSanitizer and UndefinedBehaviorSanitizer
example: build.sh --tests -- -DCMAKE_BUILD_TYPE=Debug
TEXT
}

core="" tests=""
werror=OFF
base=() sanitizer=()
while [[ $# -gt 0 ]]; do
  case "$1" in
    --core) core=1 ;;
    --tests) tests=1 ;;
    --werror) werror=ON ;;
    --sanitize)
      shift
      flags="-g1 -fno-omit-frame-pointer"
      case "${1:-}" in
        thread) flags+=" -fsanitize=thread" ;;
        address) flags+=" -fsanitize=address,undefined -fno-sanitize-recover=undefined" ;;
        *) usage >&2 && exit 2 ;;
      esac
      base=(--build-base "build/$1" --install-base "install/$1")
      sanitizer=("-DCMAKE_CXX_FLAGS=$flags" "-DCMAKE_C_FLAGS=$flags" "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG"
        -DPOCD_BENCHMARKS=OFF)
      ;;
    --help | -h) usage && exit 0 ;;
    --) shift && break ;;
    *) usage >&2 && exit 2 ;;
  esac
  shift
done

# Only here: what a program leaves in output/, as npm does, may look like a package, too.
packages=(pocd_core) integration=OFF
[[ -z "$core" ]] && packages+=(pocd_msgs pocd_dds) && integration=ON
[[ -n "$tests" ]] && packages+=(test)

# A compiler of PCL code takes up to 2 GB: no more at once than fit.
available_gb=$(($(sed -n 's/^MemAvailable: *\([0-9]*\) kB/\1/p' /proc/meminfo) / 1048576))
jobs=$(nproc)
((jobs > available_gb / 2)) && jobs=$((available_gb / 2))
((jobs < 1)) && jobs=1

# MAKEFLAGS keeps colcon from adding a limit by load average, which on a busy machine means one job.
export CMAKE_GENERATOR=Ninja CMAKE_BUILD_PARALLEL_LEVEL=$jobs MAKEFLAGS="-j$jobs"
if ! colcon --log-level error build --base-paths "${packages[@]}" \
  --merge-install --executor sequential "${base[@]}" \
  --cmake-args "-DPOCD_WERROR=$werror" "-DPOCD_TEST_INTEGRATION=$integration" --no-warn-unused-cli "${sanitizer[@]}" "$@"; then
  # Ninja reports compiler errors on stdout, which colcon keeps in a file.
  failed=$(ls -t log/latest_build/*/stdout_stderr.log 2>/dev/null | head -n 1)
  if [[ -n "$failed" ]]; then
    grep -A 12 -E 'FAILED:|CMake Error' "$failed" | head -n 60 >&2 || tail -n 30 "$failed" >&2
  fi
  echo "build.sh: failed, see above${failed:+ and $failed}" >&2
  exit 1
fi
