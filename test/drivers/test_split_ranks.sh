# test_split_ranks.sh: `mpirun -n N flesh run` of split meshes: the bits of the same run of the whole mesh, frames in parts,
# states, what is refused, and how it ends. FLESH names the program, MPIRUN the launcher. `quick` takes few cases.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$source_folder/shared/ranks.sh"
case ${1-} in quick) quick=1 ;; *) quick= ;; esac

"$flesh" mesh box --cells 12,4,3 --size 3,1,1 --out bar.msh >/dev/null || exit 1
cat >bar.yaml <<'END'
body: {mesh: bar.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [0.01, 2, 2]], until: 0.1}
  - traction: {box: [[2.99, -1, -1], [4, 2, 2]], traction: [0, 300, 100]}
  - prescribed_motion: {nodes: [200], axes: [z], motion: [{time: 0}, {time: 1, translation: [0, 0, 0.3]}]}
  - viscosity: {shear: 20, bulk: 5}
time: {step: 1/60, end: 0.15}
output: {frame_interval: 4}
END

split() { "$flesh" mesh split bar.msh --parts "$1" --out "parts_$1" >/dev/null; }

# On as many ranks the parts are the same in either case, and so are all bits.
runs_are_those_of_the_whole() {
  numbers=${quick:+3}
  for ranks in ${numbers:-2 3 5}; do
    split "$ranks" && expect 0 on_ranks "$ranks" "$flesh" run bar.yaml --quiet --out "whole_$ranks" &&
      expect 0 on_ranks "$ranks" "$flesh" run bar.yaml --quiet --set "body.mesh=parts_$ranks/index.txt" \
        --out "split_$ranks" --save-state "state_$ranks.txt" || return 1
    cmp "whole_$ranks/history.csv" "split_$ranks/history.csv" && cmp "whole_$ranks/state.txt" "split_$ranks/state.txt" &&
      cmp "state_$ranks.txt" "split_$ranks/state.txt" || return 1
    python3 - "$ranks" <<'END' || return 1
import json, sys
ranks = int(sys.argv[1])
whole, split = [json.load(open(f"{kind}_{ranks}/result.json")) for kind in ("whole", "split")]
assert split["status"] == "complete" and split["figures"]["steps"] == whole["figures"]["steps"] == 9, split
assert split["inputs"]["mesh"]["volume"] - whole["inputs"]["mesh"]["volume"] < 1e-12
for key in "nodes", "tets", "surface_triangles": assert split["inputs"]["mesh"][key] == whole["inputs"]["mesh"][key], key
assert [p["tets"] for p in split["ranks"]["parts"]] == [p["tets"] for p in whole["ranks"]["parts"]]
assert list(split["effects"]) == list(whole["effects"]) if isinstance(split["effects"], dict) else \
    len(split["effects"]) == len(whole["effects"])
END
  done
}

# A scrambled bar's equilibrium, too, in which tets are inverted between parts.
tangles_are_untangled() {
  "$flesh" mesh box --cells 9,3,3 --size 3,1,1 --out knot.mesh >/dev/null &&
    "$flesh" mesh split knot.mesh --parts 3 --out knot_parts >/dev/null || return 1
  awk 'BEGIN { srand(5) } /^Vertices/ { getline count; for (; count > 0; count--) { getline
         if ($1 < 1e-9) print $1, $2, $3, 0, 0, 0; else print 3 * rand(), rand(), rand(), 0, 0, 0 } }' knot.mesh >knot.txt
  cat >knot.yaml <<'END'
body: {mesh: knot.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.49}}
effects: [pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}]
start: {state: knot.txt}
time: {method: static, step: 1, end: 1}
END
  expect 0 on_ranks 3 "$flesh" run knot.yaml --quiet --no-frames --out knot &&
    expect 0 on_ranks 3 "$flesh" run knot.yaml --quiet --no-frames --set body.mesh=knot_parts/index.txt --out knot_split &&
    cmp knot/state.txt knot_split/state.txt || return 1
  for folder in knot knot_split; do
    has "$folder/result.json" '"untanglings": 1,' && has "$folder/result.json" '"final_inverted": 0,' || return 1
  done
}

# The frames' parts have each tet once and, put together, the places of the state.
frames_are_in_parts() {
  split 3 && expect 0 on_ranks 3 "$flesh" run bar.yaml --quiet --set body.mesh=parts_3/index.txt --out split_3 || return 1
  for step in 000000 000004 000008 000009; do [ -e "split_3/frames/frame_$step.pvtu" ] || return 1; done
  python3 - <<'END'
import re, struct
def arrays(path):
    data = open(path, "rb").read()
    begin = data.index(b'<AppendedData encoding="raw">')
    at = data.index(b"_", begin) + 1
    found = {}
    for type_, name, offset in re.findall(rb'<DataArray type="(\w+)" Name="(\w+)".*?offset="(\d+)"', data[:begin]):
        place = at + int(offset)
        size = struct.unpack("<Q", data[place:place + 8])[0]
        code, width = {b"Float64": ("d", 8), b"Int32": ("i", 4), b"Int64": ("q", 8), b"UInt8": ("B", 1)}[type_]
        found[name.decode()] = struct.unpack(f"<{size // width}{code}", data[place + 8:place + 8 + size])
    return found
index = open("split_3/frames/frames.pvd").read()
names = re.findall(r'file="(\S+)"', index)
assert names == [f"frame_{step:06d}.pvtu" for step in (0, 4, 8, 9)], names
pieces = re.findall(r'<Piece Source="(\S+)"', open(f"split_3/frames/{names[-1]}").read())
assert len(pieces) == 3, pieces
state = [[float(word) for word in line.split()] for line in open("split_3/state.txt") if line[0] != "#"]
tets, nodes = [], set()
for piece in pieces:
    part = arrays(f"split_3/frames/{piece}")
    tets += part["tet"]
    assert min(part["J"]) > 0 and len(part["J"]) == len(part["tet"]) == len(part["region"])
    for k, node in enumerate(part["node"]):
        assert list(part["Points"][3 * k:3 * k + 3]) == state[node][:3] and \
            list(part["velocity"][3 * k:3 * k + 3]) == state[node][3:], node
        nodes.add(node)
assert sorted(tets) == list(range(12 * 4 * 3 * 6)) and nodes == set(range(13 * 5 * 4))
END
  "$flesh" snap split_3 --frame 9 --out split.png >/dev/null && cp -r split_3 last && rm -r last/frames && "$flesh" snap last --out last.png >/dev/null && cmp split.png last.png || return 1
  rm split_3/frames/frame_000009_00001.vtu && expect 3 "$flesh" snap split_3 --frame 9 --out lost.png &&
    has stderr.txt 'frame_000009_00001.vtu: cannot be opened'
}

# A state is that of the whole, whoever wrote it.
states_go_on_on_others() {
  split 3
  expect 0 on_ranks 3 "$flesh" run bar.yaml --quiet --no-frames --set body.mesh=parts_3/index.txt --set time.end=0.1 \
    --out begun && [ ! -e begun/frames ] || return 1
  set -- --quiet --no-frames --start-state begun/state.txt --set solver.newton_tolerance=1e-9
  expect 0 "$flesh" run bar.yaml "$@" --out alone &&
    expect 0 on_ranks 3 "$flesh" run bar.yaml "$@" --set body.mesh=parts_3/index.txt --out parted || return 1
  python3 "$source_folder/shared/compare_runs.py" alone parted 1e-6 &&
    sed 3d begun/state.txt >short.txt &&
    expect 3 on_ranks 3 "$flesh" run bar.yaml --start-state short.txt --set body.mesh=parts_3/index.txt --out never &&
    has stderr.txt 'the file ends after 259 rows; a state has one for each of the mesh.s 260 nodes'
}

# One process reads all parts; statics and nearly incompressible ten-node tets go as well as others.
others_read_an_index() {
  split 3
  "$flesh" run bar.yaml --quiet --no-frames --out alone && "$flesh" run bar.yaml --quiet --no-frames --out again \
    --set body.mesh=parts_3/index.txt && cmp alone/history.csv again/history.csv || return 1
  "$flesh" mesh convert bar.msh ten.msh --order 2 >/dev/null && "$flesh" mesh split ten.msh --parts 2 --out ten >/dev/null &&
    expect 0 on_ranks 2 "$flesh" run bar.yaml --quiet --no-frames --out ten_whole --set body.mesh=ten.msh \
      --set body.material.poisson=0.499 --set effects.inertia=null --set effects.viscosity=null --set time.end=null &&
    expect 0 on_ranks 2 "$flesh" run bar.yaml --quiet --no-frames --out ten_split --set body.mesh=ten/index.txt \
      --set body.material.poisson=0.499 --set effects.inertia=null --set effects.viscosity=null --set time.end=null &&
    cmp ten_whole/history.csv ten_split/history.csv && cmp ten_whole/state.txt ten_split/state.txt &&
    has ten_split/result.json '"preconditioner": "volume-projection"'
}

# Boxes that were made in parts, with regions' densities and materials by the tags of the whole.
boxes_are_made_in_parts() {
  "$flesh" mesh box --cells 12,4,3 --size 3,1,1 --parts 4 --out blocks >/dev/null &&
    expect 0 on_ranks 4 "$flesh" run bar.yaml --no-frames --out blocks_4 --set body.mesh=blocks/index.txt \
      --set solver.newton_tolerance=1e-9 --set 'body.regions=[{tags: [0], density: 1100}]' &&
    has stdout.txt 'mesh: .*blocks/index.txt, 260 nodes, 864 tets, 3 m^3' && has stdout.txt 'ranks: 4' &&
    "$flesh" run bar.yaml --quiet --no-frames --out alone --set solver.newton_tolerance=1e-9 \
      --set 'body.regions=[{tags: [0], density: 1100}]' && python3 "$source_folder/shared/compare_runs.py" alone blocks_4 1e-6
}

# refused CODE WORDS ARGUMENT...: by one sentence of one rank, before anything is written.
refused() {
  code=$1 words=$2
  shift 2
  expect "$code" on_ranks 3 "$flesh" run bar.yaml --set body.mesh=parts_3/index.txt "$@" --out refused || return 1
  has stderr.txt "$words" && [ "$(grep -c "^flesh run: " stderr.txt)" -eq 1 ] && [ ! -e refused/history.csv ]
}

what_needs_the_whole_is_refused() {
  split 3 && split 2
  refused 2 'is split for 2 ranks, and there are 3; start 2' --set body.mesh=parts_2/index.txt &&
    refused 2 'effects\[3\].prescribed_motion.*no node or surface triangle of the mesh is chosen' \
      --set effects.traction=null --set 'effects.prescribed_motion.nodes=' \
      --set 'effects.prescribed_motion.box=[[9, 9, 9], [10, 10, 10]]' &&
    refused 2 'of a split mesh, ranks write no checkpoints' --checkpoint 1steps || return 1
  [ -z "$quick" ] || return 0
  refused 2 'force needs the whole body' --set 'effects.force={box: [[2, 0, 0], [4, 1, 1]], force: [0, 1, 0]}' &&
    refused 2 'output.probes needs the whole body' --set 'output.probes=[{name: tip, point: [3, 1, 1]}]' &&
    refused 2 'output.fields, but displacement and velocity, needs' --set 'output.fields=[stress]' &&
    refused 2 'a split mesh is not refined' --set body.refine=1 &&
    refused 2 'body.element has ten' --set body.element=tet10 &&
    refused 2 'nodes\[0\] is 260; the mesh has the nodes 0 to 259' --set 'effects.prescribed_motion.nodes=[260]' &&
    refused 2 'no tet of the mesh has that tag' --set 'effects.pin.regions=[4]' &&
    refused 2 'it must be a region tag of the mesh: 0' --set 'body.regions=[{tags: [5], density: 3}]'
}

# Their pressures are in no state of a split mesh.
incompressible_tets_are_refused() {
  "$flesh" mesh box --cells 3,1,1 --size 3,1,1 --order 2 --out curved.msh >/dev/null &&
    "$flesh" mesh split curved.msh --parts 3 --out parts_of_ten >/dev/null || return 1
  refused 2 'incompressible tets (poisson 0.5) cannot be kept' --set body.mesh=parts_of_ten/index.txt \
    --set body.material.poisson=0.5 --set body.element=tet10-mean --set 'effects.prescribed_motion.nodes=[20]'
}

bad_parts_are_refused() {
  split 3 && mv parts_3/part_00001.bin kept && refused 3 'part 1 of the split mesh of .* cannot be opened' || return 1
  head -c 3000 kept >parts_3/part_00001.bin && refused 3 'part_00001.bin: the part has 3000 bytes; by the index' || return 1
  printf '\377' | dd of=kept bs=1 seek=999 conv=notrunc 2>dd.txt && mv kept parts_3/part_00001.bin &&
    refused 3 'part_00001.bin: the part is damaged'
}

# A rank that is asked to stop stops all, in order, with the state and the frames so far.
a_signal_ends_all() {
  split 3
  begin_on 3 "$flesh" run bar.yaml --set body.mesh=parts_3/index.txt --out endless --set time.end=1e4 --quiet
  wait_until "$launched" test -s endless/frames/frame_000004.pvtu || return 1
  kill -TERM "$(cat pid_1)" || return 1
  wait "$launched"
  [ $? -eq 143 ] || { echo 'not 143'; cat stderr.txt; return 1; }
  has stderr.txt 'interrupted by SIGTERM at t = ' && has endless/result.json '"status": "interrupted"' &&
    [ "$(grep -c '^flesh run: ' stderr.txt)" -eq 1 ] && rows endless/state.txt 260 || return 1
  last=$(sed -n 's/.*file="frame_\([0-9]*\).pvtu".*/\1/p' endless/frames/frames.pvd | tail -1)
  [ "$(ls endless/frames/frame_"$last"_0000[012].vtu | wc -l)" -eq 3 ]
}

if [ -n "$quick" ]; then
  run_tests runs_are_those_of_the_whole frames_are_in_parts what_needs_the_whole_is_refused
else
  run_tests runs_are_those_of_the_whole tangles_are_untangled frames_are_in_parts states_go_on_on_others others_read_an_index \
    boxes_are_made_in_parts what_needs_the_whole_is_refused incompressible_tets_are_refused bad_parts_are_refused \
    a_signal_ends_all
fi
