#!/bin/sh
# Runs the scenes of the gallery in drivers/scenes.md and draws its pictures again.
#   sh data/scenes/make_gallery.sh [path of the flesh program]
set -eu
flesh=$(realpath "${1:-$(dirname "$0")/../../build/drivers/flesh}")
cd "$(dirname "$0")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# draw SCENE OPTIONS...: data/pictures/gallery_SCENE.png of a whole run.
draw() {
  scene=$1
  shift
  "$flesh" run "$scene.yaml" --out "$work/$scene" --quiet
  "$flesh" snap "$work/$scene" --bare --out "../pictures/gallery_$scene.png" "$@"
}
draw hand_pull --time 0,0.55,0.62,0.75 --colour J --width 210
draw hand_ball --time 0,1/4,0.8 --colour stress --width 250
draw jelly_drop --time 0,0.4,0.8,1.5 --colour none --width 240
draw twist --time 0,0.05,0.1 --colour stress --width 280
draw inflated_sphere --time 0,0.8 --colour stress --width 280
draw limb --time 0,0.15,2 --colour none --width 300
draw fist --time 0,0.4,0.8,1.2 --colour J --width 210
draw fold --time 0,1.5,3,4 --colour none --width 210
draw funnel --time 0,0.6,1.2,2 --colour none --width 210
draw soft_and_stiff --time 0,0.1,0.2,0.6 --colour stress --width 210
draw tube --time 0,0.6,1.2,2 --colour stress --width 210
draw muscle_spindle --time 0,0.5,1.5,2.5 --colour none --width 200
draw tentacle --time 0,0.5,0.95,1.6 --colour none --width 220
draw limb_antagonists --time 0.3,0.9,1.6,2.4 --colour none --width 240
"$flesh" run floating.yaml --out "$work/floating" --quiet
"$flesh" snap "$work/floating" --bare --out ../pictures/floating.png --time 0,2,3,8 --colour none --width 300 --camera 10,15
"$flesh" run welded.yaml --out "$work/welded" --quiet
"$flesh" snap "$work/welded" --bare --out ../pictures/welded.png --time 0,0.5,2 --colour stress --edges --width 300
"$flesh" run peel.yaml --out "$work/peel" --quiet
"$flesh" snap "$work/peel" --bare --out ../pictures/peel.png --time 0,0.5,0.75,1 --colour stress --width 220
"$flesh" run hinged.yaml --out "$work/hinged" --quiet
"$flesh" snap "$work/hinged" --bare --out ../pictures/hinged.png --time 0,0.6,1.2 --colour stress --edges --width 300
