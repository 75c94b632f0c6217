# TEST quick program seconds=60 needs=flesh
# test_command_skin.sh: `flesh skin`, the skin of a run, and refusals. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

"$flesh" mesh box --cells 6,2,2 --size 3,1,1 --out bar.msh >/dev/null || exit 1
"$flesh" mesh box --cells 9,3,3 --size 3.06,1.02,1.02 --origin -0.03,-0.01,-0.01 --out fine.msh >/dev/null || exit 1
"$flesh" mesh surface fine.msh skin.obj >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  material: {energy: S, constants: matched, young: 1e5, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {step: 1/60, end: 1/3}
output: {skin: {surface: skin.obj, formats: [obj, pc2, vtu]}}
END

compare_with_vtk() {
  /usr/bin/python3 "$source_folder/shared/check_skin.py" "$@" >vtk.txt
  status=$?
  cat vtk.txt
  [ "$status" -eq 0 ] || [ "$status" -eq 77 ]
}

a_run_writes_its_skin() {
  expect 0 "$flesh" run bar.yaml --out out || return 1
  has stdout.txt 'skin: .*skin.obj, 128 vertices, 128 outside the body, at most by 0.0332 m' || return 1
  [ "$(ls out/skin/skin_*.obj | wc -l)" -eq 21 ] && [ "$(ls out/skin/skin_*.vtu | wc -l)" -eq 21 ] || return 1
  compare_with_vtk out/skin out/frames/frames.pvd out/skin/binding.txt
}

check_tells_of_the_skin() {
  expect 0 "$flesh" check bar.yaml && has stdout.txt 'skin: .*skin.obj, 128 vertices, 128 outside'
}

# stl OBJ: prints the file's triangles as an STL text.
stl() {
  awk '$1 == "v" { v[++n] = $2 " " $3 " " $4 } BEGIN { print "solid" } END { print "endsolid" }
    $1 == "f" { print "facet normal 0 0 0\nouter loop\nvertex", v[$2] "\nvertex", v[$3] "\nvertex", v[$4] "\nendloop\nendfacet" }' "$1"
}

# An STL file gives the same as an OBJ file, as a skin and as an obstacle that the bar sags onto.
an_stl_gives_the_same() {
  printf 'v -1 -1 -0.3\nv 9 -1 -0.3\nv -1 9 -0.3\nv 9 9 -0.3\nf 1 2 4\nf 1 4 3\n' >floor.obj
  stl floor.obj >floor.stl
  stl skin.obj >skin.stl
  expect 0 "$flesh" run bar.yaml --out stl --set output.skin.surface=skin.stl --set 'effects.contact={mesh: floor.stl}' || return 1
  has stdout.txt 'skin: .*skin.stl, 128 vertices, 128 outside the body, at most by 0.0332 m' || return 1
  expect 0 "$flesh" run bar.yaml --out obj --set 'effects.contact={mesh: floor.obj}' || return 1
  ! cmp -s obj/state.txt out/state.txt && cmp obj/state.txt stl/state.txt
}

bind_and_apply_give_the_same() {
  expect 0 "$flesh" skin bind bar.msh skin.obj --out binding.txt || return 1
  has stdout.txt '128 outside the body' && cmp binding.txt out/skin/binding.txt || return 1
  expect 0 "$flesh" skin apply binding.txt skin.obj out --out applied --formats obj,pc2,vtu || return 1
  has stdout.txt 'applied: 21 frames of 128 vertices' || return 1
  cmp out/skin/skin.pc2 applied/skin.pc2 && cmp out/skin/skin_000020.obj applied/skin_000020.obj &&
    cmp out/skin/skin_000020.vtu applied/skin_000020.vtu
}

frames_keep_their_numbers() {
  expect 0 "$flesh" run bar.yaml --out sparse --quiet --set output.frame_interval=9 || return 1
  expect 0 "$flesh" skin apply binding.txt skin.obj sparse --out again && [ "$(ls sparse/skin/*.obj | wc -l)" -eq 4 ] ||
    return 1
  for file in sparse/skin/*.obj; do cmp "$file" "again/${file##*/}" || return 1; done
  expect 2 "$flesh" skin apply binding.txt skin.obj out/state.txt --out x &&
    has stderr.txt 'with a state file, --mesh must name its mesh'
}

a_state_is_enough() {
  expect 0 "$flesh" skin apply binding.txt skin.obj out/state.txt --mesh bar.msh --out single || return 1
  [ "$(ls single)" = skin_000000.obj ] && cmp single/skin_000000.obj out/skin/skin_000020.obj || return 1
  sed '$d' out/state.txt >short.txt
  expect 3 "$flesh" skin apply binding.txt skin.obj short.txt --mesh bar.msh --out single &&
    cmp single/skin_000000.obj out/skin/skin_000020.obj # a state that cannot be read removes no older skin
}

a_ply_is_a_skin_too() {
  "$flesh" mesh surface fine.msh skin.ply >/dev/null || return 1
  expect 0 "$flesh" run bar.yaml --out ply --set output.skin.surface=skin.ply --set time.end=1/30 || return 1
  [ "$(ls ply/skin/*.obj | wc -l)" -eq 3 ]
}

an_older_skin_is_removed() {
  expect 0 "$flesh" run bar.yaml --out ply --set output.skin=null --set time.end=1/60 || return 1
  [ ! -e ply/skin ] && [ -e ply/frames/frames.pvd ]
}

without_a_skin_nothing_is_said_of_it() {
  ! grep -q skin ply/scene.yaml &&
    [ "$(ls ply | sort | tr '\n' ' ')" = 'frames history.csv result.json scene.yaml state.txt ' ]
}

an_interrupted_run_leaves_a_whole_cache() {
  "$flesh" run bar.yaml --out cut --set time.end=1000 --quiet >/dev/null 2>&1 &
  pid=$!
  wait_until "$pid" [ -e cut/skin/skin_000002.obj ] || return 1
  [ ! -e cut/skin/skin.pc2 ] || return 1 # it gets this name when it is whole
  kill -INT "$pid"
  wait "$pid"
  [ "$?" -eq 130 ] || return 1
  [ "$(head -c 11 cut/skin/skin.pc2)" = POINTCACHE2 ] || return 1
  samples=$(od -An -j28 -N4 -td4 cut/skin/skin.pc2 | tr -d ' ')
  [ "$samples" -eq "$(ls cut/skin/skin_*.obj | wc -l)" ] &&
    [ "$(wc -c <cut/skin/skin.pc2)" -eq $((32 + 12 * 128 * samples)) ] && ! find cut -name '*.part-*' | grep .
}

what_is_wrong_is_said() {
  expect 2 "$flesh" skin && has stderr.txt 'the commands are bind and apply' || return 1
  expect 2 "$flesh" skin bind bar.msh skin.obj && has stderr.txt '\--out is missing' || return 1
  expect 2 "$flesh" skin apply binding.txt skin.obj out --out x --formats obj,stl &&
    has stderr.txt "--formats has 'stl'; it must be a list of some of obj, pc2, vtu" || return 1
  expect 3 "$flesh" skin bind bar.msh none.obj --out b.txt && has stderr.txt 'none.obj: cannot be opened' || return 1
  [ ! -e b.txt ] || return 1
  expect 3 "$flesh" skin apply binding.txt skin.obj out/state.txt --mesh fine.msh --out x &&
    has stderr.txt 'binding.txt:2: the binding is for a mesh of 63 nodes' || return 1
  expect 3 "$flesh" skin apply binding.txt skin.obj data --out x && has stderr.txt 'no such folder of a run' || return 1
  expect 2 "$flesh" run bar.yaml --set 'output.skin.formats=[obj, stl]' &&
    has stderr.txt 'it must be a list of some of obj, pc2, vtu' || return 1
  expect 3 "$flesh" run bar.yaml --set output.skin.surface=none.obj && has stderr.txt 'output.skin.surface' || return 1
  printf 'v 0 0 0\nf 1 1\n' >bad.obj
  expect 3 "$flesh" run bar.yaml --out bad --set output.skin.surface=bad.obj &&
    has stderr.txt 'output.skin.surface: .*bad.obj:2: face 1 has 2 corners' || return 1
  [ ! -e bad/frames/frame_000000.vtu ] || return 1
  # `flesh check` refuses what a run refuses.
  expect 3 "$flesh" check bar.yaml --set output.skin.surface=bad.obj && has stderr.txt 'output.skin.surface: .*bad.obj:2' &&
    expect 0 "$flesh" check bar.yaml --set output.skin.surface=bad.obj --set output.frame_interval=0 || return 1
  # A binding that could not be read again is not written.
  printf 'v 1e300 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >far.obj
  expect 3 "$flesh" skin bind bar.msh far.obj --out far.txt && has stderr.txt 'vertex 0 of the skin is too far outside' &&
    [ ! -e far.txt ]
}

run_tests a_run_writes_its_skin an_stl_gives_the_same check_tells_of_the_skin bind_and_apply_give_the_same frames_keep_their_numbers a_state_is_enough a_ply_is_a_skin_too \
  an_older_skin_is_removed without_a_skin_nothing_is_said_of_it an_interrupted_run_leaves_a_whole_cache \
  what_is_wrong_is_said
