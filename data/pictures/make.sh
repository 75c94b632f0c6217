#!/bin/sh
# Makes the pages' pictures, which are in this folder, anew with the current program. Run it before a release:
#
#   sh data/pictures/make.sh                 all of them
#   sh data/pictures/make.sh gallery finger  these alone: `sh data/pictures/make.sh --list` prints the names
#
# FLESH names the program, build/drivers/flesh by default. `limb` takes an hour on two processors, all others together half
# an hour, half of it `speed`; each prints its seconds. `tutorials`, `accuracy`, `mesh_error`, `limb` and `speed` measure
# CPU times and need an otherwise idle machine. gnuplot is needed, Chromium for `report`, and CalculiX, FEniCSx, gmsh and
# Matplotlib for `limb`.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
pictures=$root/data/pictures
flesh=$(realpath "${FLESH:-$root/build/drivers/flesh}")
names='gallery tutorials hand finger forms accuracy mesh_error bands adapted hard starts shapes filters inclusion limb speed report'

# run SCENE [options]: runs data/scenes/SCENE.yaml into the folder SCENE.
run() {
  scene=$1
  shift
  "$flesh" run "data/scenes/$scene.yaml" --out "$scene" --quiet "$@"
}

# blocks PAGE: writes the files that the page shows in its code blocks.
blocks() {
  awk '/^```[a-z]+ [^ ]+$/ { file = $2; next } /^```/ { file = "" } file != "" { print > file }' "$root/$1"
}

# snap PICTURE SCENE [options]: runs the scene and draws it into PICTURE.png.
snap() {
  picture=$1 scene=$2
  shift 2
  run "$scene"
  "$flesh" snap "$scene" --bare --out "$pictures/$picture.png" "$@"
}

gallery() {
  snap gallery_hand_pull hand_pull --time 0,0.55,0.62,0.75 --colour J --width 210
  snap gallery_hand_ball hand_ball --time 0,1/4,0.8 --colour stress --width 250
  snap gallery_jelly_drop jelly_drop --time 0,0.4,0.8,1.5 --colour none --width 240
  snap gallery_twist twist --time 0,0.05,0.1 --colour stress --width 280
  snap gallery_inflated_sphere inflated_sphere --time 0,0.8 --colour stress --width 280
  snap gallery_limb limb --time 0,0.15,2 --colour none --width 300
  snap gallery_fist fist --time 0,0.4,0.8,1.2 --colour J --width 210
  snap gallery_fold fold --time 0,1.5,3,4 --colour none --width 210
  snap gallery_funnel funnel --time 0,0.6,1.2,2 --colour none --width 210
  snap gallery_soft_and_stiff soft_and_stiff --time 0,0.1,0.2,0.6 --colour stress --width 210
  snap gallery_tube tube --time 0,0.6,1.2,2 --colour stress --width 210
  snap gallery_muscle_spindle muscle_spindle --time 0,0.5,1.5,2.5 --colour none --width 200
  snap gallery_tentacle tentacle --time 0,0.5,0.95,1.6 --colour none --width 220
  snap gallery_limb_antagonists limb_antagonists --time 0.3,0.9,1.6,2.4 --colour none --width 240
  snap floating floating --time 0,2,3,8 --colour none --width 300 --camera 10,15
  snap welded welded --time 0,0.5,2 --colour stress --edges --width 300
  snap peel peel --time 0,0.5,0.75,1 --colour stress --width 220
  snap hinged hinged --time 0,0.6,1.2 --colour stress --edges --width 300
}

tutorials() {
  for page in "$root"/drivers/tutorials/*.md; do blocks "${page#"$root/"}"; done
  "$flesh" accuracy pluck.yaml --quick --methods backward-euler,newmark,adaptive,ida --out pluck
  cp pluck/work_time.png tutorial_accuracy.png
  "$flesh" plot pluck/steps/adaptive_1e-3.csv --x t --y h --log y --out tutorial_steps.png
  "${flesh%/*}/examples/example_bar_kinsol" equilibrium.txt
  "$flesh" mesh box --cells 8,2,2 --size 2,0.5,0.5 --out bar.mesh
  "$flesh" snap hanging.yaml --colour stress --edges --bare --out tutorial_own_program.png
  "$flesh" sweep locking.yaml --out locking
  "$flesh" sweep plot locking/sweep.db --x nu --y sag_mm --by "printf('%s, %d tets', element, tets)" \
    --title 'Sag of a bar, mm' --out tutorial_sweep.png
  "$flesh" plot memory.csv --x ranks --y memory --by run --log xy --out tutorial_ranks.png
  "$flesh" run character.yaml --out character
  "$flesh" snap character --time 0,1/4,0.63,1 --colour stress --width 260 --bare \
    --out tutorial_character.png
  cp tutorial_*.png "$pictures"
}

hand() {
  "$flesh" drift data/scenes/hand_pull.yaml --poisson 0.45 --solvers guarded --out hand
  cp hand/shapes_hand_pull_0.45_guarded.png "$pictures/hand_pull.png"
}

finger() {
  "$flesh" drift data/scenes/finger_pull_fine.yaml --poisson 0.45 --out finger
  cp finger/volume_finger_pull_fine_0.45.png "$pictures/volume_finger.png"
}

forms() {
  "$flesh" material --out forms
  cp forms/flatten.png "$pictures/material_flatten.png"
}

accuracy() {
  "$flesh" accuracy data/scenes/swing.yaml --out accuracy
  cp accuracy/work_time.png "$pictures/accuracy_swing.png"
}

# Error and cost of meshes of the README's bar, in equilibrium at a Poisson's ratio of 0.49.
mesh_error() {
  blocks README.md
  sed 's/bar_16x4x4/bar_8x2x2/' bar.yaml >bar_coarse.yaml
  "$flesh" accuracy bar.yaml --mesh --coarser bar_coarse.yaml --mesh-seconds 30 --set effects.inertia=null \
    --set body.material.poisson=0.49 --set 'effects.gravity.acceleration=[0, 0, -0.2]' --out mesh_error
  cp mesh_error/work_mesh.png "$pictures/accuracy_mesh.png"
}

# The error bars of a swing.
bands() {
  run swing_coarse --method newmark --error --set body.element=tet10-mean --set body.refine=1 --set time.step=1/120 \
    --set 'output.probes[0].name=tip' --set 'output.probes[0].point=[4,0.5,0.5]'
  "$flesh" plot swing_coarse --y tip.position_z --width 720 --height 420 --out "$pictures/error_bands.png"
  rm "$pictures/error_bands.gp"
}

# Meshes that are adapted until the displacement of a bar's tip has an error of 1 %.
adapted() {
  blocks drivers/error_bars.md
  "$flesh" run adapted.yaml --to 1%:tip.position_z --out adapted --quiet
  "$flesh" snap adapted/to/[036] --error tip.position_z --range 0,5e-5 --edges --bare --width 300 --out "$pictures/adapted.png"
}

# Young's modulus in half a block, cut through its inclusion: the true map, and the one that a fit of its surface finds.
inclusion() {
  "$flesh" fit data/fits/inclusion.yaml --out inclusion --quiet
  python3 - <<'END'
lines = open("data/fits/inclusion_block.mesh").read().split("\n")
at, tets = lines.index("Vertices") + 2, lines.index("Tetrahedra") + 2
y = [float(line.split()[1]) for line in lines[at:at + int(lines[at - 1])]]
count = int(lines[tets - 1])
behind = [t for t in range(count) if sum(y[int(n) - 1] for n in lines[tets + t].split()[:4]) > 4 * 0.03]
kept = [lines[tets + t] for t in behind]
open("half.mesh", "w").write("\n".join(lines[:tets - 1] + [str(len(kept))] + kept + lines[tets + count:]))
for name, path in ("truth", "data/fits/inclusion_truth.csv"), ("found", "inclusion/map.csv"):
    rows = [line for line in open(path) if line[0].isdigit()]
    with open(name + ".csv", "w") as file:
        print("tet,young [Pa]", *(f"{k},{rows[t].split(',')[1].strip()}" for k, t in enumerate(behind)), sep="\n", file=file)
END
  for map in truth found; do
    "$flesh" run data/fits/inclusion_scene.yaml --set body.mesh=half.mesh --set body.material_map=$map.csv \
      --set effects.traction=null --out $map --quiet
  done
  "$flesh" snap truth found --bare --colour young --range 2e4,1e5 --edges --width 300 --camera 10,12 --out "$pictures/inclusion.png"
}

hard() {
  "$flesh" hardcases --energies S,E,D,B --poisson 0.45,0.49,0.499 --out hard
  cp hard/matrix.png "$pictures/hardcases_matrix.png"
}

starts() {
  "$flesh" hardcases --cases starts --energies S --poisson 0.49 --out starts
  cp starts/frames_starts.png "$pictures/hardcases_starts.png"
}

shapes() {
  meshes=
  for mesh in graded_block slivers finger_coarse plate_with_holes; do
    meshes=$meshes${meshes:+,}data/meshes/$mesh.msh
  done
  "$flesh" hardcases --shapes --meshes "$meshes" --energies S --poisson 0.49 --solvers without-untangle --max-seconds 100 \
    --out shapes --cases "jitter100,throw1,throw100,noise10,scramble,half_turn,inside_out,plane,twist5,feet_jitter70,\
feet_scramble,feet_line,feet_point,feet_mirrored,feet_half_turn,feet_stop,crash1000,crush,pull_through"
  cp shapes/sheet_*.png "$pictures/hardcases_shapes.png"
}

filters() {
  FLESH=$flesh sh "$root/test/campaign/filters.sh" filters 0.006
  cp filters/rest/profiles.png "$pictures/hardcases_profiles.png"
  cp filters/loads/profiles.png "$pictures/hardcases_profiles_loads.png"
}

limb() {
  FLESH=$flesh /usr/bin/python3 "$root/drivers/others/limb.py" --out limb
  FLESH=$flesh /usr/bin/python3 "$root/drivers/others/limb.py" --out limb --sizes 7,5.5,4.3 --solvers flesh
  FLESH=$flesh /usr/bin/python3 "$root/drivers/others/limb.py" --out limb --table
  cp limb/limb.png "$pictures/others_limb.png"
}

speed() {
  FLESH=$flesh sh "$root/drivers/speed.sh"
  cp "$root/out/speed/roofline.png" "$root/out/speed/growth.png" "$pictures"
}

# The five hands of drivers/report.md.
report() {
  for energy in S E B Neo D; do
    constants=matched
    [ $energy != D ] || constants=raw
    "$flesh" run data/scenes/hand_pull.yaml --set body.material.energy=$energy \
      --set body.material.constants=$constants --out hands/$energy --quiet
  done
  "$flesh" report hands/S hands/E hands/B hands/Neo hands/D --title 'A finger pulled, in five energies' --out report.html
  chromium --headless=new --no-sandbox --disable-dev-shm-usage --use-angle=swiftshader --enable-unsafe-swiftshader \
    --hide-scrollbars --window-size=1100,1240 --virtual-time-budget=20000 --screenshot="$pictures/report.png" \
    "file://$PWD/report.html" 2>report.log || { cat report.log >&2; exit 1; }
}

[ "${1:-}" != --list ] || { echo "$names"; exit; }
for name in "$@"; do
  case " $names " in
    *" $name "*) ;;
    *)
      echo "make.sh: '$name' is unknown; it must be --list or some of $names" >&2
      exit 2
      ;;
  esac
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
ln -s "$root/data" data
[ $# -gt 0 ] || eval "set -- $names"
for name in "$@"; do
  begin=$(date +%s)
  "$name" >"$name.log" 2>&1 || { cat "$name.log" >&2; exit 1; }
  echo "$name: $(($(date +%s) - begin)) s"
done
