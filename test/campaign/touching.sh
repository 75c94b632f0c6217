#!/bin/sh
# touching.sh: runs scenes in which bodies touch, over forms, steps and seeds: after no step does a surface go through
# another (an exact test), no energy appears under backward Euler, and at most 1.1 % of the motion's energy under another
# method (METHOD=newmark).
#   sh test/campaign/touching.sh [build folder [steps of each run at most [scene ...]]]
# Prints a line for each run, and a table of the scenes at the end. RECORD=FILE keeps the lines there and skips runs that
# have one: an interrupted campaign resumes, and its table is of all runs. The exit code is 1 if surfaces went through each
# other in a run, or it gained energy or failed.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
touching=${1:-$here/../../build}/test/touching
most=${2:-100000}
[ $# -gt 2 ] && shift 2 && scenes=$* ||
  scenes='cubes two_bodies soft_and_stiff fold stack fist tube funnel'
own=$(mktemp)
one=$(mktemp)
trap 'rm -f "$own" "$one"' EXIT
trap 'exit 130' INT TERM
record=${RECORD:-$own}
touch "$record"
for seed in 0 1 2; do
  for form in S E Neo; do
    for step in 1/50 1/100 1/400; do
      for scene in $scenes; do
        run="$scene $seed $most $form $step"
        grep -qF "$run | " "$record" && continue
        path=$here/../../data/scenes/$scene.yaml
        [ "$scene" = cubes ] && path=$here/touching_cubes.yaml
        end=fine
        "$touching" "$path" "$seed" "$most" "body.material.energy=$form" \
          "time.method=${METHOD:-backward-euler}" "time.step=$step" >"$one" || end=failed
        sed "s#^[^ ]*/#$run | $end #" "$one" | tee -a "$record"
      done
    done
  done
done
awk -F' [|] ' '
  { split($1, run, " "); scene = run[1]; n = split($2, words, "[ ,]+"); runs[scene]++; runs["in all"]++
    failed[scene] += words[1] != "fine"; failed["in all"] += words[1] != "fine"
    if (!(scene in seen)) { seen[scene] = 1; order[++scenes] = scene }
    for (k = 2; k <= n; k++) {
      if (words[k] ~ /^(steps|pairs|crossings|rises)$/) {
        sum[scene, words[k]] += words[k-1]; sum["in all", words[k]] += words[k-1]
      }
      if (words[k] == "at" && words[k-1] > most[scene]) most[scene] = words[k-1]
      if (words[k] == "at" && words[k-1] > most["in all"]) most["in all"] = words[k-1]
      if (words[k] ~ /;$/) break
    } }
  END { order[++scenes] = "in all"
    print "| scene | runs | steps | pairs a step | most | crossings | steps that gain energy | runs that failed |"
    print "|---|---|---|---|---|---|---|---|"
    for (k = 1; k <= scenes; k++) { s = order[k]
      printf "| %s | %d | %d | %.0f | %d | %d | %d | %d |\n", s, runs[s], sum[s, "steps"],
        sum[s, "pairs"] / (sum[s, "steps"] + !sum[s, "steps"]), most[s], sum[s, "crossings"], sum[s, "rises"],
        failed[s] }
    exit failed["in all"] > 0 }' "$record"
