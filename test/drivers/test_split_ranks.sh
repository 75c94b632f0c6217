# TEST full program alone seconds=60 needs=flesh,mpirun uses=stop_at
# TEST name=test_split_ranks_quick memory program excerpt alone needs=flesh,mpirun uses=stop_at args: quick
# test_split_ranks.sh: `mpirun -n N flesh run` of split meshes: the bits of the same run of the whole mesh, frames in parts,
# states, refusals and ends. FLESH names the program, MPIRUN the launcher. `quick` takes few cases.
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

# On as many ranks, a whole mesh has the same parts as a split one, and so all bits are the same.
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

# A scrambled bar, in which tets are inverted between parts, is untangled to the bits of the whole mesh.
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

# The parts of a frame have each tet once, and together the positions and velocities of the state.
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
        size = struct.unpack("<I", data[place:place + 4])[0]
        code, width = {b"Float64": ("d", 8), b"Int32": ("i", 4), b"Int64": ("q", 8), b"UInt8": ("B", 1)}[type_]
        found[name.decode()] = struct.unpack(f"<{size // width}{code}", data[place + 4:place + 4 + size])
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
    assert min(part["J_min"]) > 0 and len(part["J_min"]) == len(part["tet"]) == len(part["region"])
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

# A state is that of the whole body: a run goes on from it with a whole mesh or a split one.
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

# A single process reads all parts; statics and nearly incompressible ten-node tets have the bits of the whole mesh, too.
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

# same_bits KIND RANKS SCENE ARGUMENT...: histories, probes and states of split meshes are those of the whole ones.
same_bits() {
  kind=$1 ranks=$2 scene=$3
  shift 3
  split "$ranks" && expect 0 on_ranks "$ranks" "$flesh" run "$scene" --quiet "$@" --out "whole_$kind" &&
    expect 0 on_ranks "$ranks" "$flesh" run "$scene" --quiet "$@" --set "body.mesh=parts_$ranks/index.txt" --out "split_$kind" ||
    return 1
  for file in history.csv state.txt probes.csv; do
    [ ! -e "whole_$kind/$file" ] || cmp "whole_$kind/$file" "split_$kind/$file" || return 1
  done
}

# Sets of the mesh select the same as boxes, on ranks that have the whole mesh and on those that have parts; unknown sets are
# refused.
sets_are_those_of_the_whole() {
  "$flesh" mesh convert bar.msh b.node >/dev/null && {
    echo '*NODE'
    awk 'NR > 1 { print $1 ", " $2 ", " $3 ", " $4 }' b.node
    echo '*ELEMENT, TYPE=C3D4, ELSET=all'
    awk 'NR > 1 { print $1 ", " $2 ", " $3 ", " $4 ", " $5 }' b.ele
    echo '*NSET, NSET=clamp'
    awk 'NR > 1 && $2 <= 0.01 { print $1 }' b.node
    echo '*NSET, NSET=tip'
    awk 'NR > 1 && $2 >= 2.99 { print $1 }' b.node
  } >bar.inp || return 1
  sed 's/bar.msh/bar.inp/; s/pin: {box: [^u]*/pin: {set: clamp, /; s/traction: {box: [^t]*/traction: {set: tip, /' bar.yaml >sets.yaml
  grep -q 'pin: {set: clamp, until: 0.1}' sets.yaml && grep -q 'traction: {set: tip, traction:' sets.yaml || return 1
  "$flesh" mesh split bar.inp --parts 2 --out sets_2 >/dev/null &&
    "$flesh" run bar.yaml --quiet --no-frames --out boxes_1 && "$flesh" run sets.yaml --quiet --no-frames --out sets_1 &&
    expect 0 on_ranks 2 "$flesh" run bar.yaml --quiet --no-frames --out boxes_on_2 &&
    expect 0 on_ranks 2 "$flesh" run sets.yaml --quiet --no-frames --out sets_on_2 &&
    expect 0 on_ranks 2 "$flesh" run sets.yaml --quiet --no-frames --set body.mesh=sets_2/index.txt --out sets_in_2 || return 1
  cmp boxes_1/state.txt sets_1/state.txt && cmp boxes_on_2/state.txt sets_on_2/state.txt &&
    cmp boxes_on_2/state.txt sets_in_2/state.txt || return 1
  sed -i 's/set: tip/set: top/' sets.yaml
  expect 2 on_ranks 2 "$flesh" run sets.yaml --quiet --set body.mesh=sets_2/index.txt --out never &&
    has stderr.txt "effects\[3\].traction: set is 'top'; the mesh has the sets 'all', 'clamp' and 'tip'"
}

# as_alone LIMIT SCENE ARGUMENT...: three ranks with parts have the results of a single process, within LIMIT.
as_alone() {
  limit=$1 scene=$2
  shift 2
  "$flesh" run "$scene" --quiet "$@" --no-frames --out alone --set solver.newton_tolerance=1e-9 &&
    expect 0 on_ranks 3 "$flesh" run "$scene" --quiet "$@" --no-frames --out parted --set body.mesh=parts_3/index.txt \
      --set solver.newton_tolerance=1e-9 && python3 "$source_folder/shared/compare_runs.py" alone parted "$limit"
}

# Effects and outputs for which a rank needs only its part of a split mesh, or data from the other ranks.
cat >loads.yaml <<'END'
body: {mesh: bar.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [0.01, 2, 2]]}
  - force: {box: [[1, -1, 0.99], [2.01, 2, 2]], force: [0, 3, 20]}
  - pressure: {box: [[1.2, -1, 0.99], [4, 2, 2]], pressure: 300}
  - drag: {box: [[2.99, -1, -1], [4, 2, 2]], density: 1000, velocity: [-3, 0, 0]}
  - buoyancy: {level: 0.6}
  - muscle: {box: [[0, 0, 0], [2, 1, 0.5]], fibres: {direction: [1, 0.2, 0]}, peak_stress: 3e3,
      activation: [{time: 0, value: 0}, {time: 0.1, value: 1}]}
  - settling_damping: {rate: 3, speed: 0.2}
time: {step: 1/60, end: 0.1}
output:
  frame_interval: 3
  fields: [stress, J, von_mises, reaction]
  fields_at: [nodes, points]
  reactions: true
  probes:
    - {name: probe_tip, point: [2.9, 0.5, 0.6], quantities: [position, velocity, J, stretch, stress, energy]}
    - {name: probe_corner, point: [3, 1, 1], quantities: [position]}
    - {name: probe_first_cut, point: [1, 0.5, 0.5], quantities: [position]}
    - {name: probe_second_cut, point: [2, 0.5, 0.5], quantities: [position]}
    - {name: probe_half, box: [[1, -1, -1], [2, 2, 2]], quantities: [position, J, stretch, stress, energy]}
END
effects_are_those_of_the_whole() {
  numbers=${quick:+3}
  for ranks in ${numbers:-2 3 5}; do same_bits loads "$ranks" loads.yaml || return 1; done
  as_alone 1e-6 loads.yaml || return 1
  [ -n "$quick" ] || as_alone 1e-6 loads.yaml --set body.mass=consistent
}

# A closed surface has no rim on any rank, and its pressure has an energy. Rows of a file of fibres are by the whole mesh's
# tets.
closed_surfaces_and_files_are_those_of_the_whole() {
  python3 -c 'for k in range(12 * 4 * 3 * 6): print(1, k % 7 / 7, 0)' >fibres.txt
  set -- --set effects.buoyancy=null --set 'effects.pressure={box: [[-1, -1, -1], [4, 2, 2]], pressure: 2000}' \
    --set 'effects.muscle={fibres: {file: fibres.txt}, peak_stress: 3000}'
  same_bits closed 3 loads.yaml "$@" --no-frames && has split_closed/history.csv energy_pressure && as_alone 1e-6 loads.yaml "$@"
}

# Pressures on ten-node tets have the bits of the whole mesh: on a closed surface, and on a part of it whose rim runs within
# faces and between ranks.
pressures_on_curved_faces_are_those_of_the_whole() {
  "$flesh" mesh box --cells 7,3,2 --size 3,1,1 --order 2 --out ten.msh >/dev/null &&
    "$flesh" mesh split ten.msh --parts 3 --out ten_3 >/dev/null || return 1
  cat >ten.yaml <<'END'
body: {mesh: ten.msh, element: tet10, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - pin: {box: [[-1, -1, -1], [0.01, 2, 2]]}
  - pressure: {box: [[0.6, -1, 0.99], [2.5, 0.9, 2]], pressure: 2000}
  - pressure: {box: [[-1, -1, -1], [4, 2, 2]], pressure: 3000}
time: {step: 1/60, end: 0.1}
END
  for run in whole split alone; do
    case $run in
    whole) start='on_ranks 3' mesh=ten.msh ;;
    split) start='on_ranks 3' mesh=ten_3/index.txt ;;
    alone) start= mesh=ten.msh ;;
    esac
    # shellcheck disable=SC2086
    expect 0 $start "$flesh" run ten.yaml --quiet --no-frames --set "body.mesh=$mesh" --set solver.newton_tolerance=1e-9 \
      --out "ten_$run" || return 1
  done
  cmp ten_whole/history.csv ten_split/history.csv && cmp ten_whole/state.txt ten_split/state.txt &&
    has ten_split/history.csv 'energy_pressure' && python3 "$source_folder/shared/compare_runs.py" ten_alone ten_split 1e-6
}

# A bar falls onto a plane and slides, and a ball comes down on it: defaults of contact are those of the whole surface.
cat >fall.yaml <<'END'
body: {mesh: bar.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - gravity: {}
  - contact: {plane: {point: [0, 0, -0.05], normal: [0.1, 0, 1]}, friction: 0.3, slip_speed: 0.01}
  - contact: {sphere: {centre: [1.5, 0.5, 1.5], radius: 0.3}, motion: [{time: 0}, {time: 0.25, translation: [0, 0, -0.8]}]}
start: {velocity: [1, 0.5, -1]}
time: {step: 1/60, end: 0.25}
output:
  frame_interval: 6
  fields: [contact_force]
  reactions: true
END
contact_is_that_of_the_whole() {
  numbers=${quick:+3}
  for ranks in ${numbers:-2 3 5}; do same_bits fall "$ranks" fall.yaml || return 1; done
  python3 - split_fall/history.csv <<'END' || return 1
import csv, sys
rows = list(csv.DictReader(open(sys.argv[1])))
assert max(float(row["contact_nodes"]) for row in rows) >= 8 and max(float(row["contact_2_nodes"]) for row in rows) >= 1
assert min(float(row["contact_gap"]) for row in rows) > 0 and max(float(row["contact_2_force"]) for row in rows) > 0
END
  cmp whole_fall/frames/obstacle_1.obj split_fall/frames/obstacle_1.obj &&
    cmp whole_fall/frames/obstacle_2_000006.obj split_fall/frames/obstacle_2_000006.obj && as_alone 1e-5 fall.yaml
}

# Fields of frames are those of the whole mesh: of tets with the same bits, at nodes within the rounding of sums over ranks.
fields_are_those_of_the_whole() {
  same_bits loads 3 loads.yaml && python3 - <<'END'
import re, struct
def arrays(path):
    data = open(path, "rb").read()
    begin = data.index(b'<AppendedData encoding="raw">')
    at, cells, found = data.index(b"_", begin) + 1, data.index(b"<CellData>"), {}
    for match in re.finditer(rb'<DataArray type="(\w+)" Name="(\w+)"(?: NumberOfComponents="(\d+)")?.*?offset="(\d+)"', data[:begin]):
        type_, name, width, offset = match.groups()
        place, kind = at + int(offset), "tet" if match.start() > cells else "node"
        size = struct.unpack("<I", data[place:place + 4])[0]
        code, each = {b"Float64": ("d", 8), b"Int32": ("i", 4), b"Int64": ("q", 8), b"UInt8": ("B", 1)}[type_]
        numbers, n = struct.unpack(f"<{size // each}{code}", data[place + 4:place + 4 + size]), int(width or 1)
        found[kind, name.decode()] = [numbers[k:k + n] for k in range(0, len(numbers), n)]
    return found
its_own = "Points", "connectivity", "offsets", "types"
whole, compared = arrays("whole_loads/frames/frame_000006.vtu"), set()
for rank in range(3):
    part = arrays(f"split_loads/frames/frame_000006_{rank:05d}.vtu")
    assert part.keys() == whole.keys() | {("node", "node"), ("tet", "tet")}, part.keys() ^ whole.keys()
    for (kind, name), rows in whole.items():
        if name in its_own: continue
        limit = 0 if kind == "tet" else 1e-9 * max(abs(n) for row in rows for n in row)
        for (number,), row in zip(part[kind, kind], part[kind, name]):
            assert all(abs(a - b) <= limit for a, b in zip(row, rows[number])), (kind, name, number, row, rows[number])
        compared.add(name)
assert {"stress", "J_mean", "von_mises", "reaction", "stress_at_points", "J_at_points"} <= compared, compared
END
}

# broken_off RANKS SCENE ARGUMENT...: makes `begun`, the folder of a run that ends after its start, and again after each of its
# first four steps.
broken_off() {
  ranks=$1 scene=$2
  shift 2
  rm -rf begun && expect 6 on_ranks "$ranks" "$flesh" run "$scene" --quiet "$@" --checkpoint 1steps --max-seconds 1e-9 \
    --out begun || return 1
  for step in 1 2 3 4; do
    expect 6 on_ranks "$ranks" "$flesh" run --resume begun --quiet --max-seconds 1e-9 || return 1
  done
}

# A run resumes on as many ranks with the same bits, on a single process with the same results; other numbers of ranks are
# refused with the right one.
checkpoints_go_on() {
  split 3
  set -- --set body.mesh=parts_3/index.txt --set time.method=bdf2 --set solver.newton_tolerance=1e-9
  expect 0 on_ranks 3 "$flesh" run loads.yaml --quiet "$@" --checkpoint 2steps --out undisturbed &&
    [ ! -e undisturbed/checkpoint.bin ] && broken_off 3 loads.yaml "$@" || return 1
  cp -r begun by_1 && cp -r begun by_2
  expect 0 on_ranks 3 "$flesh" run --resume begun --max-seconds 100 && has stdout.txt 'goes on after step 4, t = 0.0666667 s' &&
    diff -rq -x result.json undisturbed begun && has begun/result.json '"same_bits": true' || return 1
  expect 2 on_ranks 2 "$flesh" run --resume by_2 --max-seconds 100 && has stderr.txt 'is split for 3 ranks, and there are 2' &&
    [ "$(grep -c '^flesh run: ' stderr.txt)" -eq 1 ] || return 1
  [ -z "$quick" ] || return 0
  expect 0 "$flesh" run --resume by_1 --max-seconds 100 && has by_1/result.json '"same_bits": false' &&
    python3 "$source_folder/shared/compare_runs.py" undisturbed by_1 1e-6 || return 1
  # Ranks resume from the checkpoint of a single process.
  rm -rf alone begun && expect 0 "$flesh" run loads.yaml --quiet "$@" --no-frames --out alone &&
    expect 6 "$flesh" run loads.yaml --quiet "$@" --no-frames --checkpoint 1steps --max-seconds 1e-9 --out begun &&
    expect 0 on_ranks 3 "$flesh" run --resume begun --max-seconds 100 && has stdout.txt 'another number of ranks has come there' &&
    python3 "$source_folder/shared/compare_runs.py" alone begun 1e-6
}

# A checkpoint that is cut, or whose frames are gone, is refused with one sentence.
bad_checkpoints_are_refused() {
  split 3 && broken_off 3 fall.yaml --set body.mesh=parts_3/index.txt || return 1
  cp -r begun cut && head -c $(($(wc -c <begun/checkpoint.bin) - 8)) begun/checkpoint.bin >cut/checkpoint.bin
  expect 3 on_ranks 3 "$flesh" run --resume cut && has stderr.txt 'the checkpoint is damaged' &&
    [ "$(grep -c '^flesh run: ' stderr.txt)" -eq 1 ] || return 1
  rm begun/frames/frames.pvd
  expect 3 on_ranks 3 "$flesh" run --resume begun && [ "$(grep -c '^flesh run: ' stderr.txt)" -eq 1 ]
}

# A box that was made in parts has the results of a whole one, with regions by the tags of the whole mesh.
boxes_are_made_in_parts() {
  "$flesh" mesh box --cells 12,4,3 --size 3,1,1 --parts 4 --out blocks >/dev/null &&
    expect 0 on_ranks 4 "$flesh" run bar.yaml --no-frames --out blocks_4 --set body.mesh=blocks/index.txt \
      --set solver.newton_tolerance=1e-9 --set 'body.regions=[{tags: [0], density: 1100}]' &&
    has stdout.txt 'mesh: .*blocks/index.txt, 260 nodes, 864 tets, 3 m^3' && has stdout.txt 'ranks: 4' &&
    "$flesh" run bar.yaml --quiet --no-frames --out alone --set solver.newton_tolerance=1e-9 \
      --set 'body.regions=[{tags: [0], density: 1100}]' && python3 "$source_folder/shared/compare_runs.py" alone blocks_4 1e-6
}

# refused CODE WORDS ARGUMENT...: three ranks end with CODE and one sentence of one of them, before anything is written.
refused() {
  code=$1 words=$2
  shift 2
  expect "$code" on_ranks 3 "$flesh" run bar.yaml --set body.mesh=parts_3/index.txt "$@" --out refused || return 1
  has stderr.txt "$words" && [ "$(grep -c "^flesh run: " stderr.txt)" -eq 1 ] && [ ! -e refused/history.csv ]
}

what_needs_the_whole_is_refused() {
  split 3 && split 2
  refused 2 'is split for 2 ranks, and there are 3; start 2' --set body.mesh=parts_2/index.txt &&
    refused 2 'effects\[3\].prescribed_motion.*no node, surface triangle or tet of the mesh is chosen' \
      --set effects.traction=null --set 'effects.prescribed_motion.nodes=' \
      --set 'effects.prescribed_motion.box=[[9, 9, 9], [10, 10, 10]]' || return 1
  [ -z "$quick" ] || return 0
  refused 2 'spring needs the whole body' \
    --set 'effects.spring={point: [3, 1, 1], stiffness: 10, target: [{time: 0, position: [3, 1, 1]}]}' &&
    refused 2 'contact: between needs the whole body' --set 'effects.contact={between: self}' &&
    refused 2 'output.skin needs the whole body' --set 'output.skin.surface=bar.msh' &&
    refused 2 'output.probes\[0\]: point is \[3.1, 1, 1\], which no tet holds at rest; the nearest is 0.1 m away, and the body' \
      --set 'output.probes=[{name: tip, point: [3.1, 1, 1]}]' &&
    refused 2 'output.probes\[0\]: a probe must have a point or at least one node' \
      --set 'output.probes=[{name: tip, box: [[4, 4, 4], [5, 5, 5]]}]' &&
    refused 2 'but no tet has all its nodes among the 20 chosen' \
      --set 'output.probes=[{name: tip, box: [[2.99, 0, 0], [5, 5, 5]], quantities: [stress]}]' &&
    refused 2 'body.refine is 1; it must be 0 for a split mesh' --set body.refine=1 &&
    refused 2 'body.element has ten' --set body.element=tet10 &&
    refused 2 'nodes\[0\] is 260; the mesh has the nodes 0 to 259' --set 'effects.prescribed_motion.nodes=[260]' &&
    refused 2 'no tet of the mesh has that tag' --set 'effects.pin.regions=[4]' &&
    refused 2 'traction: no node, surface triangle or tet of the mesh is chosen' \
      --set 'effects.traction.box=[[0.2, 0.2, 0.3], [2.8, 0.8, 0.7]]' &&
    refused 2 'it must be a region tag of the mesh: 0' --set 'body.regions=[{tags: [5], density: 3}]'
}

# Incompressible tets are refused, because states of split meshes do not have their pressures.
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

# A signal to one rank stops all ranks in an orderly way, with the state and the frames so far.
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
  run_tests runs_are_those_of_the_whole sets_are_those_of_the_whole frames_are_in_parts effects_are_those_of_the_whole contact_is_that_of_the_whole \
    fields_are_those_of_the_whole checkpoints_go_on what_needs_the_whole_is_refused
else
  run_tests runs_are_those_of_the_whole sets_are_those_of_the_whole tangles_are_untangled frames_are_in_parts effects_are_those_of_the_whole \
    closed_surfaces_and_files_are_those_of_the_whole pressures_on_curved_faces_are_those_of_the_whole \
    contact_is_that_of_the_whole fields_are_those_of_the_whole \
    checkpoints_go_on bad_checkpoints_are_refused states_go_on_on_others others_read_an_index \
    boxes_are_made_in_parts what_needs_the_whole_is_refused incompressible_tets_are_refused bad_parts_are_refused \
    a_signal_ends_all
fi
