#!/usr/bin/env bash
# The whole evaluation in one command: every method, scenario and seed, then our method under faults of the
# sensors, the scenes beyond the warehouse circuit, and the table top. Tables and pictures go to
# output/evaluation, and are there for what is done should the rest be cut off.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() {
  echo "usage: evaluate.sh [--quick | --ablation | --tune | --sensors] [ARGUMENT of pocd_evaluate...]"
  echo "  --quick     only the methods side by side, few scenarios, one seed"
  echo "  --ablation  instead: our method with each improvement that is a setting off"
  echo "  --sensors   instead: our method with other cameras, rates and errors than those it was made with"
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
  --sensors)
    shift
    # NAME=CHANGE[,CHANGE...] of every scenario
    for change in as_simulated= \
      exact=$(printf 'sensor.%s=0,' depth_base_m depth_quadratic_per_m random_hole_share hole_blobs_per_frame \
        edge_hole_px label_border_px label_blobs_per_frame alias_share position_error_m rotation_error_deg) \
      depth_noise_x2=sensor.depth_base_m=0.004,sensor.depth_quadratic_per_m=0.005,sensor.random_hole_share=0.05 \
      pose_error_x2=sensor.position_error_m=0.05,sensor.rotation_error_deg=0.6 \
      mask_errors_x3=sensor.label_border_px=6,sensor.label_blobs_per_frame=4,sensor.alias_share=0.3 \
      camera_640x480=width=640,height=480,fx=525,fy=525,cx=319.5,cy=239.5 \
      camera_320x180=width=320,height=180,fx=230,fy=230,cx=159.5,cy=89.5 \
      frames_5_per_s=frame_rate_hz=5 \
      frames_30_per_s=frame_rate_hz=30; do
      name=${change%%=*}
      IFS=, read -ra keys <<<"${change#*=}"
      echo "$name:"
      "$bin/pocd_evaluate" "${common[@]}" --scenario 0,1-4,2-2,3-1,1-8 --seeds 1 --methods pocd --no-reference \
        --no-pictures "${keys[@]/#/--sim=}" --output "output/sensors/$name" "$@"
    done
    exit ;;
esac

"$bin/pocd_evaluate" "${common[@]}" --output output/evaluation "$@"
[[ ${1:-} == --quick ]] && exit
for fault in pose_jumps mask_gaps depth_holes; do
  echo "nothing changes, with $fault:"
  "$bin/pocd_evaluate" "${common[@]}" --scenario 0 --fault "$fault" --methods pocd --no-pictures \
    --no-reference --output "output/evaluation/fault_$fault"
done
echo "scenes beyond the circuit:"
"$bin/pocd_evaluate" "${common[@]}" --suite config/evaluation/beyond.yaml --no-reference --seeds 1 \
  --output output/evaluation/beyond
echo "table top with toy cars:"
"$bin/pocd_evaluate" --jobs "$(nproc)" --config config/toycar.yaml \
  --method-config config/evaluation/published_toycar.yaml --suite config/evaluation/toytable.yaml \
  --voxel-size 0.06 --min-height 0.72 --max-height 1.2 --output output/evaluation/toytable
