# swing_start.sh: makes the start states of swing.yaml and swing_coarse.yaml again: the bar let go from rest, after
# 0.4 s of long backward-Euler steps, which leave its slow motion alone.
#
#   sh data/scenes/swing_start.sh            FLESH names the program; default flesh
set -eu
cd "$(dirname -- "$0")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for scene in swing swing_coarse; do
  "${FLESH:-flesh}" run $scene.yaml --set start=null --set time.method=backward-euler --set time.step=1/50 \
    --set time.end=0.4 --out "$work" --no-frames --quiet
  {
    echo "# Where $scene.yaml starts: x y z vx vy vz; made by swing_start.sh"
    grep -v '^#' "$work/state.txt"
  } >${scene}_start.txt
done
