# TEST full program alone seconds=30 needs=flesh,mpirun
# test_rank_inputs.sh: if the ranks of `mpirun flesh run` are given different scenes, files or options, or parts of a split
# mesh that contradict each other, all end with one sentence. FLESH names the program, MPIRUN the launcher.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$source_folder/shared/ranks.sh"

"$flesh" mesh box --cells 6,3,2 --size 3,1,1 --out bar.msh >/dev/null || exit 1
"$flesh" mesh surface bar.msh skin.obj >/dev/null || exit 1
cat >bar.yaml <<'END'
body: {mesh: bar.msh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [0.01, 2, 2]]}
time: {step: 1/60, end: 0.05}
END

# each_by_itself COMMAND...: runs the command on three ranks; a word WORD@K is for rank K alone, which works in the folder
# rank_K.
each_by_itself() {
  cat >own.sh <<'END'
rank=$OMPI_COMM_WORLD_RANK
cd "rank_$rank" || exit 1
for word in "$@"; do
  shift
  case $word in
    *@"$rank") set -- "$@" "${word%@*}" ;;
    *@[0-9]) ;;
    *) set -- "$@" "$word" ;;
  esac
done
exec "$@"
END
  on_ranks 3 sh own.sh "$@"
}

fresh() {
  rm -rf rank_? out
  for rank in 0 1 2; do mkdir "rank_$rank" && cp bar.yaml bar.msh skin.obj "rank_$rank" || return 1; done
}

# refused CODE SENTENCE COMMAND...: the ranks end with CODE and one sentence, before anything is written.
refused() {
  code=$1 sentence=$2
  shift 2
  expect "$code" each_by_itself "$flesh" "$@" && has stderr.txt "$sentence" && [ "$(grep -c '^flesh' stderr.txt)" -eq 1 ] ||
    { cat stderr.txt; return 1; }
  [ ! -e out ] && [ -z "$(find rank_? -name history.csv)" ]
}

what_is_the_same_runs() {
  fresh && expect 0 each_by_itself "$flesh" run bar.yaml --out ../out --quiet && has out/result.json '"status": "complete"'
}

scenes_and_files_must_be_the_same() {
  fresh && sed -i 's/young: 1e5/young: 2e5/' rank_1/bar.yaml || return 1
  refused 2 'rank 1 has another scene than the first rank; all ranks must be given the same' run bar.yaml --out ../out || return 1
  fresh && "$flesh" mesh box --cells 6,3,2 --size 3,1,1.01 --out rank_2/bar.msh >/dev/null || return 1
  refused 2 'rank 2 has another mesh than the first rank' run bar.yaml --out ../out || return 1
  fresh && echo '# another' >>rank_1/skin.obj || return 1
  refused 2 'rank 1 has another file that the scene names than the first rank' run bar.yaml --out ../out \
    --set output.skin.surface=skin.obj || return 1
  refused 2 'rank 1 has another scene than the first rank' run --set@1 time.end=0.1@1 "$work/bar.yaml" --out ../out &&
    refused 2 'rank 2 has another scene than the first rank' run --method@2 bdf2@2 "$work/bar.yaml" --out ../out
}

options_must_be_the_same() {
  fresh && refused 2 'rank 1 has other options, or is another build, than the first rank' run "$work/bar.yaml" --out ../out \
    --max-seconds@1 5@1 || return 1
  refused 2 'rank [12] has other options' run "$work/bar.yaml"@0 "$work/bar.yaml"@1 --resume@2 ../out@2
}

# contradict FOLDER KIND: changes part 1 of the split mesh, and its checksum.
contradict() {
  python3 - "$1" "$2" <<'END'
import struct, sys
folder, kind = sys.argv[1:]
MASK = (1 << 64) - 1
def mix(total, word):
    total = ((total ^ word) * 6364136223846793005) & MASK
    return ((total << 29 | total >> 35) + 0x9e3779b97f4a7c15) & MASK
def add(total, data):
    total = mix(total, len(data))
    whole = len(data) // 8 * 8
    for (word,) in struct.iter_unpack("<Q", data[:whole]):
        total = mix(total, word)
    return mix(total, int.from_bytes(data[whole:], "little"))
path = f"{folder}/part_00001.bin"
data = open(path, "rb").read()
head = data[16:96]
nodes, tets, members = struct.unpack("<10q", head)[7:]
sizes, at, arrays = [24 * nodes, 4 * nodes, 16 * tets, 4 * tets, 4 * tets, 4 * tets, 4 * members], 96, []
for size in sizes:
    arrays.append(bytearray(data[at:at + size]))
    at += size
owners = list(struct.unpack(f"<{tets}i", arrays[5]))
own, other = owners.index(1), owners.index(0)
if kind == "swapped":
    owners[own], owners[other] = 0, 1
elif kind == "stranger":
    owners[other] = 2
struct.pack_into(f"<{tets}i", arrays[5], 0, *owners)
if kind == "region":
    struct.pack_into("<i", arrays[3], 4 * own, 7)
if kind == "place":
    struct.pack_into("<d", arrays[0], 0, struct.unpack_from("<d", arrays[0])[0] + 1e-3)
total = add(0, head)
for array in filter(None, arrays):
    total = add(total, bytes(array))
open(path, "wb").write(data[:96] + b"".join(bytes(array) for array in arrays) + struct.pack("<Q", total))
END
}

parts_must_agree() {
  "$flesh" mesh split bar.msh --parts 3 --out parts >/dev/null || return 1
  rm -rf rank_? && mkdir rank_0 rank_1 rank_2 || return 1
  set -- run "$work/bar.yaml" --quiet --no-frames
  expect 0 each_by_itself "$flesh" "$@" --set "body.mesh=$work/parts/index.txt" --out "$work/agreed" || return 1
  for kind in swapped stranger region place; do
    rm -rf bad && cp -r parts bad && contradict bad "$kind" || return 1
    refused 3 'the parts of the split mesh contradict each other: tet [0-9]* of the whole .*split the mesh again' "$@" \
      --set "body.mesh=$work/bad/index.txt" --out ../out || { echo "$kind"; return 1; }
  done
}

run_tests what_is_the_same_runs scenes_and_files_must_be_the_same options_must_be_the_same parts_must_agree
