#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test. The last line is
# "N passed, N failed" (and ", N skipped"); the exit code is 0 only when tests ran and none failed.
#
# With --sanitize thread, the tests of the component's threads run under ThreadSanitizer; with --sanitize
# address, all tests under AddressSanitizer and UndefinedBehaviorSanitizer. Only the tests that --only selects
# are built, and only the programs that --programs names (thread: those of the tests that it runs without --only).
# With --and-sanitized, a part of the tests runs again under the sanitizers, and all are counted together.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() {
  cat >&2 <<'TEXT'
usage: test.sh [--werror] [--core] [--only PATTERN] [--and-sanitized]
       test.sh --sanitize thread|address [--core] [--only PATTERN] [--programs NAME,NAME...|all]
  PATTERN: regular expression of names
  --core   only the core and its tests: needs no Fast DDS
TEXT
  exit 2
}

sanitizer="" only="" werror="" programs="" core="" and_sanitized=""
while [[ $# -gt 0 ]]; do
  case "$1" in
    --werror) werror=--werror ;;
    --core) core=--core ;;
    --only) shift && only=${1:?--only needs a pattern} ;;
    --sanitize) shift && sanitizer=${1:?--sanitize needs thread or address} ;;
    --programs) shift && programs=${1:?--programs needs a list of names with commas, or all} ;;
    --and-sanitized) and_sanitized=1 ;;
    *) usage ;;
  esac
  shift
done
[[ "$sanitizer" =~ ^(|thread|address)$ ]] || {
  echo "test.sh: --sanitize $sanitizer, expected thread or address" >&2
  exit 2
}
[[ -n "$sanitizer" && -n "$and_sanitized" ]] && usage

rules=$PWD/test/support/sanitizers
# Reports are files: many are made by processes that a test started, whose stderr and exit code it may not look at.
reports=$PWD/build/sanitizer_reports
common="exitcode=66 log_path=$reports/report"
# A report ends the process with an exit code that no test takes for success.
export TSAN_OPTIONS="suppressions=$rules/thread.supp $common second_deadlock_stack=1"
# Fast DDS 2.9.1 deletes parts of each writer as their base class: nothing on a bus would end without a report.
export ASAN_OPTIONS="$common detect_stack_use_after_return=1 new_delete_type_mismatch=0"
export UBSAN_OPTIONS="print_stacktrace=1 log_path=$reports/report"
export LSAN_OPTIONS="suppressions=$rules/leak.supp print_suppressions=0"

passed=0 failed=0 skipped=0 status=0
attribute() { sed -n "s/.*<testsuites .*\b$1=\"\([0-9]*\)\".*/\1/p" "$2"; }

# One executable: by its report where there is one, else as a single test.
count() {
  local results=$1 name=$2 outcome=$3 report="$1/gtest/$2.xml" bad omitted
  if [[ -s "$report" ]]; then
    bad=$(($(attribute failures "$report") + $(attribute errors "$report")))
    omitted=$(grep -c 'result="skipped"' "$report" || true)
    passed=$((passed + $(attribute tests "$report") - $(attribute disabled "$report") - bad - omitted))
    skipped=$((skipped + omitted))
    [[ "$outcome" == failed && $bad -eq 0 ]] && bad=1  # crashed or too slow
    failed=$((failed + bad))
    return 0
  fi
  case "$outcome" in
    passed) passed=$((passed + 1)) ;;
    skipped) skipped=$((skipped + 1)) ;;
    *) failed=$((failed + 1)) ;;
  esac
}

# What ctest has noted in results/Testing. Google tests write one report each into results/gtest.
count_all() {
  local results=$1 outcome="" name="" file line
  for file in "$results"/Testing/*/Test.xml; do
    [[ -f "$file" ]] || continue
    while IFS= read -r line; do
      case "$line" in
        *'<Test Status="passed">'*) outcome=passed ;;
        *'<Test Status="'*) outcome=failed ;;
        *'<Value>SKIP_'*) outcome=skipped ;;
        *'<Name>'*'</Name>'*) name=${line#*<Name>} && name=${name%</Name>*} ;;
        *'</Test>'*) [[ -n "$outcome" ]] && count "$results" "$name" "$outcome" && outcome="" ;;
      esac
    done <"$file"
  done
}

# run_tests SANITIZER CORE ONLY PROGRAMS: builds what is selected, runs it and adds to the counts.
run_tests() {
  local sanitizer=$1 core=$2 only=$3 programs=$4
  local build=build base=() build_arguments=(--tests ${core:+"$core"}) cmake_arguments=() ctest_arguments=() before
  [[ -n "$only" ]] && ctest_arguments=(--tests-regex "$only")
  if [[ -n "$sanitizer" ]]; then
    build=build/$sanitizer
    base=(--build-base "$build" --install-base "install/$sanitizer")
    [[ "$programs" == all ]] && programs=""
    build_arguments+=(--sanitize "$sanitizer")
    cmake_arguments=("-DPOCD_PROGRAMS=${programs//,/;}" "-DPOCD_TEST_SELECT=$only" -DPOCD_TEST_TIMEOUT=2400)
  else
    build_arguments+=(${werror:+"$werror"})
  fi
  launch_scripts/build.sh "${build_arguments[@]}" -- "${cmake_arguments[@]}"

  local results=$build/pocd_test
  rm -rf "$results/gtest" "$results/Testing" "$reports"
  mkdir -p "$reports"
  colcon --log-level error test --base-paths test --merge-install "${base[@]}" --packages-select pocd_test \
    --event-handlers console_direct+ --return-code-on-test-failure \
    --ctest-args --output-on-failure "${ctest_arguments[@]}" || status=$?
  before=$((passed + failed))
  count_all "$results"
  if [[ -n "$(ls "$reports")" ]]; then
    head --lines 200 "$reports"/* >&2
    echo "test.sh: $(ls "$reports" | wc -l) processes with reports of a sanitizer" >&2
    status=1
  fi
  if ((passed + failed == before)); then
    echo "test.sh: no test ran" >&2
    status=1
  fi
}

# Everything that has threads of its own, and the programs that it starts.
if [[ "$sanitizer" == thread ]]; then
  programs=${programs:-pocd_map,pocd_node,pocd_play,pocd_mirror,pocd_health,pocd_doctor}
  only=${only:-'^(unit_(common|mirror|node)|integration_(fleet|health|library_guards|many_robots|map_bus|mirror|node|two_nodes|type_versions))$'}
fi

launch_scripts/install_dependencies.sh
run_tests "$sanitizer" "$core" "$only" "$programs"
if [[ -n "$and_sanitized" ]]; then
  # The threads of the node's and the mirror's halves of the map's topics; what reads other people's recordings.
  run_tests thread "" '^(unit_(common|mirror|node)|integration_(map_bus|many_robots))$' none
  run_tests address --core '^unit_recording$' none
fi

summary="$passed passed, $failed failed"
((skipped > 0)) && summary+=", $skipped skipped"
echo "$summary"
((failed == 0 && status == 0))
