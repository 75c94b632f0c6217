# TEST full program seconds=300 needs=flesh
# TEST name=test_full_disk_quick quick program excerpt needs=flesh args: quick
# test_full_disk.sh: every command that writes, on disks that are too small for it; `quick` tries a few commands and disks.
# FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
export source_folder work
. "$source_folder/shared/full_disk.sh"
can_mount || {
  echo '1..0 # SKIP no disk can be mounted here'
  exit 0
}

"$flesh" mesh box --cells 6,2,2 --size 3,1,1 --out bar.msh >/dev/null || exit 1
"$flesh" mesh surface bar.msh skin.obj >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  material: {energy: S, constants: matched, young: 1e5, poisson: 0.45}
effects: [{inertia: {}}, {gravity: {}}, {pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}}]
time: {step: 1/60, end: 1/15}
END
cat >spec.yaml <<'END'
scene: bar.yaml
keep: true
axes: [{key: body.material.poisson, name: nu, values: [0.3, 0.4]}]
END
"$flesh" run bar.yaml --out run --quiet || exit 1
"$flesh" sweep spec.yaml --out sweep --quiet || exit 1
"$flesh" skin bind bar.msh skin.obj --out binding.txt >/dev/null || exit 1
steps() { seq "$1" "$2" "$3"; } # FROM BY TO

a_few_disks_fill() {
  fills run '0 4 8 12 28 64 84 400' "$flesh" run bar.yaml --out disk/out --quiet &&
    fills accuracy '0 12 6000' "$flesh" accuracy bar.yaml --out disk/out --quick --methods newmark --steps 1/60 \
      --reference-seconds 0.01 || return 1
  command -v gnuplot >/dev/null || return 0
  fills material '200 4000' "$flesh" material --out disk/out --energies S
}
run_fills() { fills run "$(steps 0 4 120) 400" "$flesh" run bar.yaml --out disk/out --quiet; }
run_with_a_skin_fills() {
  fills skin "$(steps 0 12 200) 600" "$flesh" run bar.yaml --out disk/out --quiet \
    --set output.skin.surface=skin.obj --set 'output.skin.formats=[obj, pc2, vtu]' --save-state disk/state.txt
}
run_with_checkpoints_fills() {
  fills checkpoints "$(steps 0 8 400) 1000" "$flesh" run bar.yaml --out disk/out --quiet --checkpoint 1steps
}
meshes_fill() {
  fills convert '0 4 8 12 100' "$flesh" mesh convert bar.msh disk/bar.node &&
    fills box '0 4 8 16 200' "$flesh" mesh box --cells 9,3,3 --size 3,1,1 --out disk/box.msh &&
    fills surface '0 4 100' "$flesh" mesh surface bar.msh disk/bar.obj
}
skins_fill() {
  fills bind '0 4 8 100' "$flesh" skin bind bar.msh skin.obj --out disk/binding.txt &&
    fills apply '0 4 8 16 24 40 400' "$flesh" skin apply binding.txt skin.obj run --out disk/out --formats obj,pc2,vtu
}
pictures_fill() {
  fills snap '0 4 8 16 200' "$flesh" snap run --out disk/snap.png --width 200 &&
    fills film '0 4 8 16 24 400' "$flesh" film run --out disk/film --width 100 &&
    fills report '0 4 64 400 600 2000' "$flesh" report run --out disk/report.html || return 1
  command -v gnuplot >/dev/null || return 0
  fills plot '0 4 8 12 16 20 40 200' "$flesh" plot run --y 'energy_*' --out disk/plot.svg
}
material_fills() {
  command -v gnuplot >/dev/null || return 0
  fills material '0 4 64 128 200 260 300 340 400 480 560 4000' "$flesh" material --out disk/out --energies S
}
drift_fills() {
  command -v gnuplot >/dev/null || return 0
  fills drift '0 4 16 40 60 80 100 120 140 170 200 2000' "$flesh" drift bar.yaml --out disk/out --energies S --poisson 0.3 \
    --jobs 1
}
accuracy_fills() {
  command -v gnuplot >/dev/null || return 0
  fills accuracy '0 4 12 20 28 36 44 60 76 92 108 140 180 240 300 6000' "$flesh" accuracy bar.yaml --out disk/out --quick \
    --methods newmark,ida --steps 1/60,1/120 --tolerances 1e-2 --reference-seconds 0.01
}
hardcases_fills() {
  command -v gnuplot >/dev/null || return 0
  fills hardcases '0 4 16 32 48 64 80 96 128 160 2000' "$flesh" hardcases --out disk/out --quick --cases jitter20 --energies S \
    --poisson 0.45 --jobs 1
}
bench_fills() {
  command -v gnuplot >/dev/null || return 0
  fills bench '0 4 8 16 40 80 2000' "$flesh" bench --out disk/out --cells 48 --cases swing --poisson 0.45 --steps 1 --repeats 1
}
sweep_fills() {
  fills sweep "$(steps 0 24 244) 300 360 420 480 2000" "$flesh" sweep spec.yaml --out disk/out --jobs 1 --quiet &&
    fills export '0 4 100' "$flesh" sweep export sweep/sweep.db --out disk/table.csv &&
    fills merge '0 4 16 64 100 2000' "$flesh" sweep merge disk/merged.db sweep/sweep.db || return 1
  command -v gnuplot >/dev/null || return 0
  fills plot '0 4 8 12 16 20 24 400' "$flesh" sweep plot sweep/sweep.db --x nu --y newton --out disk/plot.png
}

if [ "${1-}" = quick ]; then
  run_tests a_few_disks_fill
  exit
fi
run_tests run_fills run_with_a_skin_fills run_with_checkpoints_fills meshes_fill skins_fill pictures_fill material_fills drift_fills \
  accuracy_fills hardcases_fills bench_fills sweep_fills
