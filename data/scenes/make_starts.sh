# make_starts.sh: makes the start states of swing.yaml, swing_coarse.yaml and twist.yaml anew.
#
#   sh data/scenes/make_starts.sh            FLESH names the program; default flesh
set -eu
cd "$(dirname -- "$0")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
flesh=${FLESH:-flesh}

# The swings: the bar is let go from rest, in ever shorter backward-Euler steps. These damp all motion that is fast
# compared with the step, so that the remaining motion comes ever closer to a slow one.
for scene in swing swing_coarse; do
  start=start=null
  for stage in 1/50:0.3 1/200:0.45 1/800:0.6; do
    "$flesh" run $scene.yaml --set "$start" --set time.method=backward-euler --set solver.newton_tolerance=1e-11 \
      --set time.step=${stage%:*} --set time.end=${stage#*:} --out "$work" --no-frames --quiet
    cp "$work/state.txt" "$work/reached.txt"
    start=start.state=$work/reached.txt
  done
  {
    echo "# Where $scene.yaml starts: x y z vx vy vz; made by make_starts.sh"
    grep -v '^#' "$work/state.txt"
  } >${scene}_start.txt
done

# The twist: each cross-section turned about the bar's axis, a full turn at the end.
"$flesh" run whip.yaml --set time.end=0 --out "$work" --no-frames --quiet
{
  echo "# Where twist.yaml starts: x y z vx vy vz; made by make_starts.sh"
  grep -v '^#' "$work/state.txt" | awk '{
    angle = 2 * atan2(0, -1) * $1 / 4; y = $2 - 0.5; z = $3 - 0.5
    printf "%.17g %.17g %.17g 0 0 0\n", $1, 0.5 + y * cos(angle) - z * sin(angle), 0.5 + y * sin(angle) + z * cos(angle)
  }'
} >twist_start.txt
