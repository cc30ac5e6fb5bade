#!/usr/bin/env bash
# The whole evaluation in one command: every method, scenario and seed, then our method under faults of the
# sensors. Tables and pictures go to output/evaluation. Hours of CPU; --quick takes minutes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if [[ "${1:-}" == --help || "${1:-}" == -h ]]; then
  echo "usage: evaluate.sh [--quick] [ARGUMENT of pocd_evaluate...]"
  echo "example: evaluate.sh --quick --methods pocd,submaps"
  exit 0
fi

evaluate=install/bin/pocd_evaluate
[[ -x $evaluate ]] || { echo "evaluate.sh: build first, launch_scripts/build.sh" >&2 && exit 1; }
common=(--config config/simulated.yaml --jobs "$(nproc)")

"$evaluate" "${common[@]}" --variant published=config/published.yaml \
  --output output/evaluation "$@"
for fault in pose_jumps mask_gaps depth_holes; do
  echo "nothing changes, with $fault:"
  "$evaluate" "${common[@]}" --scenario 0 --fault "$fault" --methods pocd --no-pictures \
    --output "output/evaluation/fault_$fault"
done
