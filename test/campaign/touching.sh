#!/bin/sh
# Scenes in which bodies touch, over forms, steps and seeds: no surface goes through another after any step (exact), and
# no energy appears under backward Euler.
#   sh test/campaign/touching.sh [build folder [steps of each run at most [scene ...]]]
# A line for each run, their sum at the end. Exit code 1 where a run crossed, gained energy or failed.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
touching=${1:-$here/../../build}/test/touching
most=${2:-100000}
[ $# -gt 2 ] && shift 2 && scenes=$* ||
  scenes='cubes two_bodies soft_and_stiff fold stack fist funnel'
lines=$(mktemp)
trap 'rm -f "$lines"' EXIT
failed=0
for seed in 0 1 2; do
  for form in S E Neo; do
    for step in 1/50 1/100 1/400; do
      for scene in $scenes; do
        path=$here/../../data/scenes/$scene.yaml
        [ "$scene" = cubes ] && path=$here/touching_cubes.yaml
        "$touching" "$path" "$seed" "$most" "body.material.energy=$form" \
          time.method=backward-euler "time.step=$step" >"$lines.one" || failed=$((failed + 1))
        cat "$lines.one" >>"$lines"
        sed 's|^[^ ]*/||' "$lines.one"
      done
    done
  done
done
rm -f "$lines.one"
awk -v failed="$failed" '{for (k = 2; k <= NF; k++) { if ($k == "steps,") steps += $(k-1); if ($k == "crossings,") crossed += $(k-1) }}
  END { printf "%d runs, %d steps, %d crossings, %d runs that crossed, gained energy or failed\n", NR, steps, crossed, failed }' "$lines"
[ "$failed" = 0 ]
