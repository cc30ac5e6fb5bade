#!/usr/bin/env bash
# The whole evaluation in one command: every method, scenario and seed, then our method under faults of the
# sensors, the scenes beyond the warehouse circuit, and the table top. Tables and pictures go to
# output/evaluation, and are there for what is done should the rest be cut off.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() {
  echo "usage: evaluate.sh [--quick] [--ablation | --tune] [ARGUMENT of pocd_evaluate...]"
  echo "  --quick     few scenarios, one seed"
  echo "  --ablation  instead: our method with each improvement off, and as published with each on"
  echo "  --tune      instead: search the thresholds of the other methods on the training scenes"
  echo "example: evaluate.sh --quick --methods pocd,submaps"
}

bin=install/bin
[[ -x $bin/pocd_evaluate ]] || { echo "evaluate.sh: build first, launch_scripts/build.sh" >&2 && exit 1; }
common=(--config config/simulated.yaml --jobs "$(nproc)")

case "${1:-}" in
  --help | -h) usage && exit 0 ;;
  --tune)
    shift
    training=()
    for file in config/sim/training/*.yaml; do training+=(--run "$file"); done
    exec "$bin/pocd_tune" "${common[@]}" "${training[@]}" --seeds 101 \
      --methods static_tsdf,voxel_correction,tracked_objects,submaps --output output/tuning "$@" ;;
  --ablation)
    shift
    exec "$bin/pocd_evaluate" "${common[@]}" --variants config/evaluation/ablation.yaml --no-reference \
      --no-pictures --scenario 0,1-4,2-2 --seeds 1 --output output/ablation "$@" ;;
esac

"$bin/pocd_evaluate" "${common[@]}" --variant published=config/published.yaml \
  --output output/evaluation "$@"
for fault in pose_jumps mask_gaps depth_holes; do
  echo "nothing changes, with $fault:"
  "$bin/pocd_evaluate" "${common[@]}" --scenario 0 --fault "$fault" --methods pocd --no-pictures \
    --no-reference --output "output/evaluation/fault_$fault"
done
echo "scenes beyond the circuit:"
"$bin/pocd_evaluate" "${common[@]}" --suite config/evaluation/beyond.yaml --no-reference --seeds 1 \
  --variant published=config/published.yaml --output output/evaluation/beyond
echo "table top with toy cars:"
"$bin/pocd_evaluate" --jobs "$(nproc)" --config config/toycar.yaml --suite config/evaluation/toytable.yaml \
  --voxel-size 0.06 --min-height 0.72 --max-height 1.2 --output output/evaluation/toytable
