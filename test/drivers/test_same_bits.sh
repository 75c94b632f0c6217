# TEST full program seconds=120 needs=flesh builds=plain
# TEST full seconds=180 needs=flesh builds=threads args: races
# test_same_bits.sh: runs of every scene and every method end with the same bits whatever the number of threads.
# FLESH names the program. `races` takes only two threads, for the thread sanitizer.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
scenes=$source_folder/../data/scenes

case ${1-} in
  races) numbers=2 first=1/100 ;;
  *) numbers='2 1 3' first=1/20 ;;
esac

# same SCENE END OPTIONS...: the first steps by two threads, one and three have the same results and numbers of iterations.
same() {
  scene=$1
  end=$2
  shift 2
  for threads in $numbers; do
    expect 0 "$flesh" run "$scenes/$scene.yaml" --set "time.end=$end" --set "solver.threads=$threads" \
      --out "by_$threads" --quiet --no-frames "$@" || return 1
    grep -E '"(newton|linear)_' "by_$threads/result.json" >"by_$threads/iterations"
    cmp by_2/state.txt "by_$threads/state.txt" && cmp by_2/iterations "by_$threads/iterations" || return 1
  done
}

solved() { ! grep -q '"newton_per_step": 0\.0' by_2/result.json; }

every_scene() {
  for path in "$scenes"/*.yaml; do
    scene=${path##*/}
    end=$first
    case $first:$scene in
      1/100:peel.yaml | 1/100:stack.yaml) continue ;; # the longest; others run the same lines
      *:funnel.yaml | *:stack.yaml) end=1/100 ;; # many tets and short steps
    esac
    same "${scene%.yaml}" "$end" || { echo "in $scene"; return 1; }
  done
}

# Every method has the same bits on an irregular mesh, with solves that take iterations.
every_method() {
  for method in static bdf2 midpoint newmark hht generalized-alpha runge-kutta; do
    same hand_pull "$first" --method "$method" || { echo "by $method"; return 1; }
    solved || { echo "$method had nothing to solve"; return 1; }
  done
  same finger_pull_coarse 1/60 --method ida && solved
}

# A ball comes up to the hand, presses and rubs.
contact_with_friction() {
  same hand_ball 1/8 --set time.step=1/40 && solved
}

run_tests every_scene every_method contact_with_friction
