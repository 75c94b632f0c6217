# make_starts.sh: makes the start states of swing.yaml, swing_coarse.yaml and twist.yaml again. The swing: the bar let
# go from rest, after 0.4 s of long backward-Euler steps, which leave its slow motion alone.
#
#   sh data/scenes/make_starts.sh            FLESH names the program; default flesh
set -eu
cd "$(dirname -- "$0")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for scene in swing swing_coarse; do
  "${FLESH:-flesh}" run $scene.yaml --set start=null --set time.method=backward-euler --set time.step=1/50 \
    --set time.end=0.4 --out "$work" --no-frames --quiet
  {
    echo "# Where $scene.yaml starts: x y z vx vy vz; made by make_starts.sh"
    grep -v '^#' "$work/state.txt"
  } >${scene}_start.txt
done
# And that of twist.yaml: each cross-section turned about the bar's axis, a full turn at the end.
"${FLESH:-flesh}" run whip.yaml --set time.end=0 --out "$work" --no-frames --quiet
{
  echo "# Where twist.yaml starts: x y z vx vy vz; made by make_starts.sh"
  grep -v '^#' "$work/state.txt" | awk '{
    angle = 2 * atan2(0, -1) * $1 / 4; y = $2 - 0.5; z = $3 - 0.5
    printf "%.17g %.17g %.17g 0 0 0\n", $1, 0.5 + y * cos(angle) - z * sin(angle), 0.5 + y * sin(angle) + z * cos(angle)
  }'
} >twist_start.txt
