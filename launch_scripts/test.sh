#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test. The last line is
# "N passed, N failed" (and ", N skipped"); the exit code is 0 only when tests ran and none failed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

build_arguments=(--tests)
ctest_arguments=()
while [[ $# -gt 0 ]]; do
  case "$1" in
    --werror) build_arguments+=(--werror) ;;
    --only) shift && ctest_arguments+=(--tests-regex "${1:?--only needs a pattern}") ;;
    *)
      echo "usage: test.sh [--werror] [--only PATTERN]   (PATTERN: regular expression of names)" >&2
      exit 2
      ;;
  esac
  shift
done

launch_scripts/install_dependencies.sh
launch_scripts/build.sh "${build_arguments[@]}"

# Google tests write one report each into gtest/; ctest writes Test.xml about all executables.
results=build/pocd_test
rm -rf "$results/gtest" "$results/Testing"
status=0
colcon --log-level error test --merge-install --packages-select pocd_test \
  --event-handlers console_direct+ --return-code-on-test-failure \
  --ctest-args --output-on-failure --parallel "$(nproc)" "${ctest_arguments[@]}" || status=$?

passed=0 failed=0 skipped=0
attribute() { sed -n "s/.*<testsuites .*\b$1=\"\([0-9]*\)\".*/\1/p" "$2"; }

# One executable: by its report where there is one, else as a single test.
count() {
  local name=$1 outcome=$2 report="$results/gtest/$1.xml" bad omitted
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

outcome="" name=""
for file in "$results"/Testing/*/Test.xml; do
  [[ -f "$file" ]] || continue
  while IFS= read -r line; do
    case "$line" in
      *'<Test Status="passed">'*) outcome=passed ;;
      *'<Test Status="'*) outcome=failed ;;
      *'<Value>SKIP_'*) outcome=skipped ;;
      *'<Name>'*'</Name>'*) name=${line#*<Name>} && name=${name%</Name>*} ;;
      *'</Test>'*) [[ -n "$outcome" ]] && count "$name" "$outcome" && outcome="" ;;
    esac
  done <"$file"
done

if ((passed + failed == 0)); then
  echo "test.sh: no test ran" >&2
  status=1
fi
summary="$passed passed, $failed failed"
((skipped > 0)) && summary+=", $skipped skipped"
echo "$summary"
((failed == 0 && status == 0))
