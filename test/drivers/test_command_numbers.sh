# TEST full program seconds=120 needs=flesh
# test_command_numbers.sh: every option that takes numbers accepts extreme ones or refuses them in one sentence. Sanitizers
# report a number that does not fit an int (float-cast-overflow). FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# Numbers of all sizes and signs, at the ends of integers and of doubles, and what is not finite.
extremes='0 -1 2147483648 -2147483649 4294967297 3e35 -3e35 1e308 -1e308 4e-324 1e999 nan 1e308/1e-308'

"$flesh" mesh box --cells 2,1,1 --size 2,1,1 --out bar.msh >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  material: {energy: S, young: 1e5, poisson: 0.45}
effects: [{inertia: {}}, {gravity: {}}, {pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}}]
time: {step: 1/60, end: 1/30}
END
"$flesh" run bar.yaml --out run --quiet || exit 1

# holds COMMAND...: the command ends with a documented exit code; a refusal has one sentence (that of `check`, its table).
holds() {
  timeout -k 1 1800 "$@" >stdout.txt 2>stderr.txt
  ended=$?
  grep -q 'runtime error' stderr.txt || case $ended in
  0) return 0 ;;
  [2-8]) if [ "$(lines stderr.txt)" -eq 1 ] || grep -q FAIL stdout.txt; then return 0; fi ;;
  esac
  echo "$* ended with $ended:"
  head -n 5 stderr.txt
  return 1
}

# each FORM COMMAND...: the command holds with FORM as its last word, in which every number in turn replaces @.
each() {
  form=$1 bad=0
  shift
  for number in $extremes; do holds "$@" "$(printf %s "$form" | sed "s|@|$number|g")" || bad=1; done
  [ "$bad" -eq 0 ]
}

# all COMMAND...: the command holds with each form of the standard input, which has one a line.
all() {
  wrong=0
  while read -r form; do each "$form" "$@" || wrong=1; done
  [ "$wrong" -eq 0 ]
}

runs() {
  each --max-seconds=@ "$flesh" run bar.yaml --out out --quiet && all "$flesh" run bar.yaml --out out --quiet <<'END'
--set=time.step=@
--set=output.frame_interval=@
--set=output.seed=@
--set=solver.threads=@
--set=solver.max_newton=@
--set=solver.newton_tolerance=@
--set=solver.linear_tolerance=@
END
}
checks() {
  all "$flesh" check bar.yaml <<'END'
--set=body.density=@
--set=body.material.young=@
--set=effects=[{contact: {sphere: {centre: [9, 9, @], radius: 1}}}]
--set=effects=[{contact: {sphere: {centre: [9, 9, 9], radius: @}}}]
--set=effects=[{contact: {capsule: {from: [9, 9, 9], to: [9, 9, @], radius: 1}}}]
--set=effects=[{contact: {capsule: {from: [9, 9, 9], to: [9, 9, 99], radius: @}}}]
--set=effects=[{contact: {plane: {point: [0, 0, -9], normal: [0, 0, @]}}}]
--set=effects=[{contact: {plane: {}, thickness: @}}]
END
}
boxes() {
  each --cells=@,1,1 "$flesh" mesh box --out box.msh --size 1,1,1 &&
    each --cells=0,1,@ "$flesh" mesh box --out box.msh --size 1,1,1 &&
    each --size=1,@,1 "$flesh" mesh box --out box.msh --cells 1,1,1 &&
    each --origin=@,0,0 "$flesh" mesh box --out box.msh --cells 1,1,1 --size 1,1,1
}
pictures() {
  all "$flesh" snap run --width 32 --out snap.png <<'END'
--time=@
--frame=@
--range=0,@
--range=@,1
--camera=@,20
--camera=30,@
--up=0,@,1
--target=@,0,0
--height=@
--field-of-view=@
--width=@
--picture-height=@
--columns=@
END
}
films() { each --every=@ "$flesh" film run --width 32 --out film && each --fps=@ "$flesh" film run --width 32 --out film; }
accuracies() {
  each --steps=@ "$flesh" accuracy bar.yaml --out acc --quick --methods newmark --max-seconds 1 --reference-seconds 0.01 &&
    each --tolerances=@ "$flesh" accuracy bar.yaml --out acc --quick --methods ida --steps 1/60 --max-seconds 1 \
      --reference-seconds 0.01
}
materials() {
  each --poisson=@ "$flesh" material --energies S --out mat && each --young=@ "$flesh" material --energies S --out mat
}
lists() { # lists are read before --out is found to be a file
  : >file
  all "$flesh" bench --out file <<'END'
--cells=@
--cells=1x@x1
--poisson=@
--threads=@
--repeats=@
--steps=@
--tolerance=@
END
  listed=$?
  all "$flesh" drift bar.yaml --out file <<'END'
--poisson=@
--jobs=@
--max-seconds=@
END
  [ $? -eq 0 ] && [ "$listed" -eq 0 ]
}
sweeps() {
  bad=0
  for number in $extremes; do
    for axis in "from: $number, to: 1, count: 2" "from: 1, to: $number, count: 2, spacing: log" "from: 1, to: 2, count: $number"; do
      echo "{scene: bar.yaml, axes: [{key: time.end, $axis}]}" >spec.yaml
      holds "$flesh" sweep spec.yaml --out swept --dry-run || bad=1
    done
    for key in repeats seed max_seconds; do
      echo "{scene: bar.yaml, repeats: 2, $key: $number}" | sed 's/repeats: 2, \(repeats\)/\1/' >spec.yaml
      holds "$flesh" sweep spec.yaml --out swept --dry-run || bad=1
    done
    holds "$flesh" sweep spec.yaml --out swept --dry-run --jobs "$number" || bad=1
    holds "$flesh" sweep spec.yaml --out swept --dry-run --shard "1/$number" || bad=1
  done
  [ "$bad" -eq 0 ]
}

refused() { # WORDS COMMAND...
  words=$1
  shift
  expect 2 "$@" && has stderr.txt "$words"
}

what_does_not_fit_is_told() {
  echo '{scene: bar.yaml, repeats: 2, seed: 2147483647}' >seeds.yaml
  : >file
  refused "frame is '3e35'" "$flesh" snap run --out snap.png --frame 3e35 &&
    refused 'steps has 1e20; a step must not be longer than the run, which takes 0.0333' "$flesh" accuracy bar.yaml \
    --out acc --steps 1/60,1e20 &&
    refused 'steps has 1e-20; a step must not be shorter than 3.3' "$flesh" accuracy bar.yaml --out acc --steps 1e-20 &&
    refused 'seeds.yaml:1:.*with 2 repeats it must be at most 2147483645' "$flesh" sweep seeds.yaml --dry-run &&
    refused 'must have at least one cell along each axis and at most 2e8' "$flesh" bench --cells 4294967297x1x1 --out file &&
    refused 'repeats is 102; it must be 1 to 101' "$flesh" bench --repeats 102 --out file &&
    refused 'radius is 4.94066e-324 m; it must be positive' "$flesh" check bar.yaml \
      --set 'effects=[{contact: {sphere: {centre: [9, 9, 9], radius: 4e-324}}}]' &&
    refused 'the capsule is inf m long' "$flesh" check bar.yaml \
      --set 'effects=[{contact: {capsule: {from: [9, 9, 9], to: [9, 9, 1e308], radius: 1}}}]' || return 1
  # If the scene's own step is longer than the run, shorter steps are compared.
  expect 0 "$flesh" accuracy bar.yaml --out whole --quick --methods newmark --set time.step=9 --reference-seconds 0.01 &&
    has whole/accuracy.csv '0.0333' && ! grep -q 'step=9,' whole/accuracy.csv
}

run_tests what_does_not_fit_is_told runs checks boxes pictures films accuracies materials lists sweeps
