# TEST full program alone seconds=60 needs=flesh,mpirun,fail_allocation
# test_allocations_ranks.sh: if an allocation of the second of two ranks fails, both end with the exit code of missing
# memory and one sentence, or run on without it; no rank waits for the other. Tries a sample of the allocations of three
# scenes. FLESH names the program, FAIL_ALLOCATION the library to preload, MPIRUN the launcher.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$source_folder/shared/ranks.sh"
shim=$(preloadable "${FAIL_ALLOCATION:?FAIL_ALLOCATION must name the library that lets allocations fail}") || exit 1
each=43

scene() { # NAME MESH TIME POISSON EFFECTS
  printf 'body: {mesh: %s, density: 1000, material: {energy: S, constants: matched, young: 1e5, poisson: %s}}\n' \
    "$2" "$4" >"$1.yaml"
  printf 'effects:\n  - inertia: {}\n  - gravity: {}\n%s\ntime: {%s}\n' "$5" "$3" >>"$1.yaml"
}

"$flesh" mesh box --cells 20,5,5 --size 4,1,1 --out bar.msh >/dev/null &&
  "$flesh" mesh box --cells 3,3,3 --size 1,1,1 --out cube.msh >/dev/null || exit 1
pin='  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}'
scene bar bar.msh 'step: 1/60, end: 1/60' 0.45 "$pin"
scene adaptive cube.msh 'method: ida, end: 1/100' 0.45 "$pin"
scene touching cube.msh 'step: 1/60, end: 1/30' 0.45 '  - contact: {between: all, friction: 0.5, thickness: 0.01}
bodies: [{name: above, mesh: cube.msh, translation: [0.05, 0.03, 1.02]}]'

# Only the second rank gets the preloaded library. Both ranks are given one command, because the launcher of Open MPI 5.0.7
# crashes if it is given several: `mpirun -n 1 true : -n 1 true`.
cat >rank.sh <<'END'
[ "$OMPI_COMM_WORLD_RANK" -eq 0 ] || export LD_PRELOAD="$shim"
exec "$@"
END
export shim FLESH_FAIL_OWN=1 FLESH_FAIL_COUNT="$work/count.txt"

# attempt FAIL_AT SCENE: runs the scene with allocation FAIL_AT (0: none) of the second rank failing; count.txt gets the
# number of its allocations.
attempt() {
  rm -rf out
  export FLESH_FAIL_AT="$1"
  on_ranks 2 sh rank.sh "$flesh" run "$2" --quiet --no-frames --out out >stdout.txt 2>stderr.txt
}

# sample SCENE: runs the scene with every $each-th allocation failing in turn, and prints what went wrong.
sample() {
  attempt 0 "$1" || { cat stderr.txt; return 1; }
  allocations=$(cat count.txt) refusals=0 faults=0 k=1
  while [ "$k" -le "$allocations" ]; do
    attempt "$k" "$1"
    ended=$?
    [ "$ended" -ne 1 ] || refusals=$((refusals + 1))
    sentences=$(grep -c '^flesh run: ' stderr.txt)
    if [ "$ended" -gt 1 ] || [ "$sentences" -ne "$ended" ]; then
      faults=$((faults + 1))
      echo "$1, allocation $k of $allocations: ended with $ended, $sentences sentences"
      head -n 5 stderr.txt
    fi
    k=$((k + each))
  done
  echo "$1: $allocations allocations, every $each: $refusals refused, $faults faults"
  [ "$refusals" -gt 0 ] && [ "$faults" -eq 0 ]
}

bar() { sample bar.yaml; }
adaptive() { sample adaptive.yaml; }
touching() { sample touching.yaml; }

run_tests bar adaptive touching
