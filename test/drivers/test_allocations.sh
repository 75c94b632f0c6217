# TEST name=test_allocations_quick quick program excerpt seconds=120 needs=flesh,fail_allocation args: quick
# TEST full program seconds=900 needs=flesh,fail_allocation
# test_allocations.sh: if any allocation of `mesh convert`, `check` or `run` fails, the command says so and exits with 1, or
# does without it and gives the same; flesh does not crash, and nothing half-written is left. Every other allocation fails
# alone, the rest with all after them; of `mesh convert` each fails in both ways. Crashes within libraries must be listed in
# known_faults.txt. `quick` tries a sample of the allocations.
# FLESH names the program, FAIL_ALLOCATION the library to preload.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
shim=$(preloadable "${FAIL_ALLOCATION:?FAIL_ALLOCATION must name the library that lets allocations fail}") || exit 1
case ${1-} in
quick) each=11 seldom=97 ;;
*) each=1 seldom=2 ;;
esac

"$flesh" mesh box --cells 2,1,1 --size 2,1,1 --out bar.msh >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  material: {energy: S, young: 1e5, poisson: 0.45}
effects: [{inertia: {}}, {gravity: {}}, {pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}}]
time: {step: 1/60, end: 1/30}
END
grep -v '^#' "$source_folder/drivers/known_faults.txt" | cut -d ' ' -f 1 >known.txt

# Prints the results of the command, without what differs from run to run.
given() {
  cat stdout.txt
  for file in out/state.txt out/history.csv out/scene.yaml out/frames/* made.node made.ele; do
    [ ! -e "$file" ] || { echo "$file" && cat "$file"; }
  done
  [ ! -e out/result.json ] || grep -v '"wall_s"\|"cpu_s"\|"date"\|"peak_memory_kB"' out/result.json
}

# Prints what is wrong with how the command ended; nothing if it ended well.
fault_of() { # EXIT CODE
  if [ "$1" -ge 124 ]; then
    # Four innermost frames outside the C library (which aborts): static functions of SUNDIALS and libfyaml may lie between.
    grep '^frame: ' stderr.txt | grep -v '/libc\.so' | head -n 4 >innermost.txt
    sed 's/.*(\([A-Za-z0-9_]*\).*/\1/' innermost.txt >frames.txt
    grep -q -x -F -f known.txt frames.txt && return
    echo "ended with $1 in $(tr '\n' ' ' <innermost.txt)"
    return
  fi
  for file in *.part-* .*.part-* out/*.part-* out/.*.part-* out/frames/*.part-* .flesh.lock out/.flesh.lock; do
    [ ! -e "$file" ] || echo "left $file"
  done
  [ ! -e out/result.json ] || ! grep '"status": "running"' out/result.json || echo 'still running'
  if [ "$1" -eq 0 ]; then
    given >got.txt
    cmp -s wanted.txt got.txt || { echo 'gave something else:' && diff wanted.txt got.txt | head -n 5; }
  else
    [ "$1" -eq 1 ] || echo "ended with $1"
    [ -s stderr.txt ] || echo 'said nothing'
  fi
}

# Runs the program with allocation FAIL_AT (0: none) failing, and all after it if ON is 1; sets `ended`, its exit code.
attempt() { # FAIL_AT ON
  { [ ! -e out ] && [ ! -e made.node ] && [ ! -e made.ele ]; } || rm -rf out made.*
  echo "$1 $2" >&5
  read -r ended <&6 || ended=127
}

# every STRIDE COMMAND...: runs the command with every STRIDE-th allocation failing in turn; prints all faults.
every() {
  stride=$1 faults=0 crashes=0 refusals=0
  shift
  rm -f asked answer
  mkfifo asked answer || return 1
  env FLESH_FAIL_EACH=1 FLESH_FAIL_COUNT="$work/count.txt" LD_PRELOAD="$shim" "$flesh" "$@" 3<asked 4>answer &
  exec 5>asked 6<answer
  attempt 0 0
  [ "$ended" -eq 0 ] || { cat stderr.txt; return 1; }
  given >wanted.txt
  count=$(cat count.txt)
  for on in 0 1; do
    k=$((1 + on * stride / 2))
    while [ "$k" -le "$count" ]; do
      attempt "$k" "$on"
      [ "$ended" -lt 124 ] || crashes=$((crashes + 1))
      [ "$ended" -ne 1 ] || refusals=$((refusals + 1))
      fault_of "$ended" >fault.txt
      if [ -s fault.txt ]; then
        faults=$((faults + 1))
        echo "$1, allocation $k of $count fails$([ "$on" = 0 ] || echo ', and all after it'):"
        cat fault.txt
        head -n 2 stderr.txt
      fi
      k=$((k + stride))
    done
  done
  exec 5>&- 6<&-
  wait
  echo "$1: $count allocations, every $stride: $refusals refused, $crashes crashes of known kinds, $faults faults"
  [ "$refusals" -gt 0 ] && [ "$faults" -eq 0 ]
}

meshes() { every "$each" mesh convert bar.msh made.node; }
checks() { every "$seldom" check bar.yaml; }
runs() { every "$seldom" run bar.yaml --out out --quiet; }
adaptive_runs() { every "$seldom" run bar.yaml --out out --quiet --method ida --no-frames; }

# lacks CODE WORDS SIZE COMMAND...: with allocations of SIZE failing, the command says WORDS and ends with CODE.
lacks() {
  lacking=$1 words=$2 size=$3
  shift 3
  expect "$lacking" env FLESH_FAIL_SIZE="$size" LD_PRELOAD="$shim" "$@" && has stderr.txt "$words"
}

# A case runs with all its settings or not at all. The name is so long that no other allocation has the size of its block,
# to which the arena adds 32 bytes.
cases_have_all_that_is_set() {
  key=body.name name=$(printf '%017000d' 0 | tr 0 a)
  printf 'scene: bar.yaml\nset: {time.end: 1/30}\naxes: [{key: %s, values: [%s]}]\n' $key "$name" >spec.yaml
  expect 0 "$flesh" sweep spec.yaml --out cases --quiet &&
    sqlite3 cases/sweep.db 'SELECT overrides FROM cases' >overrides.txt && has overrides.txt "$name" &&
    lacks 1 'out of memory' $(((${#key} + ${#name} + 17) / 16 * 16 + 32)) "$flesh" sweep spec.yaml --out lacking --quiet
}

run_tests meshes checks runs adaptive_runs cases_have_all_that_is_set
