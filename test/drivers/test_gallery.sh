# TEST full memory program seconds=180 needs=flesh
# test_gallery.sh: every scene of the gallery runs in a short form and is drawn. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
scenes=$source_folder/../data/scenes

# short SCENE OPTIONS...: some steps of the scene run without an inverted tet, and the last one is drawn.
short() {
  scene=$1
  shift
  expect 0 "$flesh" run "$scenes/$scene.yaml" --out "$scene" --quiet "$@" || return 1
  has "$scene/result.json" '"status": "complete"' && has "$scene/result.json" '"max_inverted": 0' || return 1
  expect 0 "$flesh" snap "$scene" --out "$scene.png" --width 120 && [ "$(wc -c <"$scene.png")" -gt 3000 ]
}

# column NAME FILE: prints the last value of the column.
column() {
  awk -F, -v name="$1" 'NR == 1 { for (c = 1; c <= NF; c++) if ($c == name) at = c } END { print $at }' "$2"
}

hand_pull() { short hand_pull --set time.end=0.1; }
twist() { short twist --set time.end=0.1; }
jelly_drop() { short jelly_drop --set time.end=0.1; }

hand_ball_with_its_skin() {
  short hand_ball --set time.end=0.1 --set time.step=1/60 || return 1
  [ "$(ls hand_ball/skin/skin_*.obj | wc -l)" -eq 7 ] && [ "$(grep -c '^v ' hand_ball/skin/skin_000006.obj)" -eq 5293 ]
}

# Blown up, the shell is thinner and its hollow larger; its own volume changes little.
inflated_sphere() {
  short inflated_sphere --set time.end=0.5 --set time.step=1/20 || return 1
  column volume_ratio inflated_sphere/history.csv | awk '{ exit !($1 > 1.01 && $1 < 1.1) }' || return 1
  grep -v '^#' inflated_sphere/state.txt | awk '
    { r = sqrt($1 * $1 + $2 * $2 + $3 * $3); if (!least || r < least) least = r; if (r > most) most = r }
    END { print least, most; exit !(least > 0.08 && most > 0.105 && most - least < 0.0295) }'
}

# The part without a bone gives way.
limb() {
  short limb --set time.end=0.2 || return 1
  grep -v '^#' limb/state.txt | awk '$3 < low { low = $3 } END { print low; exit !(low < -0.1) }'
}

# The spindle hangs stretched until 0.5 s; then its muscle lifts the weight by more than 5 cm. The fibres' energy counts as
# work that is put in.
muscle_spindle() {
  short muscle_spindle --set time.end=1.2 --set time.step=1/40 || return 1
  awk -F '[:,]' '/"work_put_in"/ { print; exit !($2 > 0.5) }' muscle_spindle/result.json || return 1
  expect 0 "$flesh" run "$scenes/muscle_spindle.yaml" --out hanging --quiet --set time.end=0.5 --set time.step=1/40 ||
    return 1
  for run in hanging muscle_spindle; do
    grep -v '^#' $run/state.txt | awk 'NR == 1 || $3 < low { low = $3 } END { print low }'
  done | paste -s - | awk '{ print; exit !($2 - $1 > 0.05) }'
}

# The tentacle becomes longer by a twentieth, then curls so that its tip points down, and nearly keeps its volume.
tentacle() {
  short tentacle --set time.end=0.5 || return 1
  grep -v '^#' tentacle/state.txt | awk '$3 > high { high = $3 } END { print high; exit !(high > 0.3) }' || return 1
  column volume_ratio tentacle/history.csv | awk '{ exit !($1 > 0.995 && $1 < 1.005) }'
}

# The limb, lifted by its upper muscle, is higher than it would hang by itself.
limb_antagonists() {
  short limb_antagonists --set time.end=0.9 --set time.step=1/30 || return 1
  grep -v '^#' limb_antagonists/state.txt | awk '$3 < low { low = $3 } END { print low; exit !(low > -0.1) }'
}

# A body that hangs from a weld or a joint pulls at it with its weight: 500 kg/m^3, 4 m^3.
what_hangs_pulls_with_its_weight() {
  for scene in welded:weld hinged:joint; do
    tie=${scene#*:} scene=${scene%:*}
    short "$scene" --set time.end=0.1 || return 1
    expect 0 "$flesh" run "$scenes/$scene.yaml" --set effects.inertia=null --set time=null \
      --set "output.probes=[{name: w, effect: $tie, quantities: [contact_force]}]" --out "$scene"_still --quiet ||
      return 1
    column 'w.contact_force_z [N]' "$scene"_still/probes.csv |
      awk '{ print; f = $1 < 0 ? -$1 : $1; exit !(f > 19600 && f < 19640) }' || return 1
  done
}

# refused COLUMN WORDS KEYS [EDIT]: the welded bar with these keys of the weld, edited by sed, is refused at this column with
# these words.
refused() {
  sed "s|- weld: .*|- weld: $3|; s|\.\./meshes|$scenes/../meshes|" "$scenes/welded.yaml" |
    sed "${4:-}" >weld.yaml
  expect 2 "$flesh" run weld.yaml --set time.end=0.1 --quiet && grep -qF "weld.yaml:19:$1: effects[3].weld: $2" stderr.txt
}

welds_that_make_no_sense_are_refused() {
  refused 20 'bodies is [soft]; it must be the names of two bodies' '{bodies: [soft]}' &&
    refused 20 'bodies is [soft, soft]; a weld ties two different bodies' '{bodies: [soft, soft]}' &&
    refused 11 "body is 'hard'; the scene has no body of that name" '{bodies: [soft, hard]}' &&
    refused 11 'give bodies: [a, b]' '{first: {body: soft}}' &&
    refused 20 'bodies is given beside first or second' '{bodies: [soft, stiff], first: {body: soft}}' &&
    refused 11 'soft and stiff: the two surfaces do not face each other' '{bodies: [soft, stiff]}' 's/translation: .*/translation: [4.1, 0, 0]/'
}

# A traction of 0 is refused, and a method that does not allow a weld to break.
breaking_that_makes_no_sense_is_refused() {
  sed "s|- weld: .*|- weld: {bodies: [soft, stiff], breaks_at: 0}|; s|\.\./meshes|$scenes/../meshes|" "$scenes/welded.yaml" >weld.yaml
  expect 2 "$flesh" run weld.yaml --quiet && has stderr.txt '19:46: effects\[3\].weld.breaks_at is 0; it must be a number > 0' ||
    return 1
  sed 's/breaks_at: 0/breaks_at: 6e4/; s/bdf2/ida/' weld.yaml >ida.yaml
  expect 2 "$flesh" run ida.yaml --quiet && has stderr.txt 'time.method is ida, which goes on from a history of smooth'
}

# In statics a body that has broken off has no equilibrium, and a message says so.
what_falls_off_is_said() {
  sed "s|- weld: .*|- weld: {bodies: [soft, stiff], breaks_at: 6e4}|; s|\.\./meshes|$scenes/../meshes|; /inertia/d; /damping/d
    s/time: .*/time: {method: static}/" "$scenes/welded.yaml" >falls.yaml
  expect 4 "$flesh" run falls.yaml --quiet --out falls && has falls/result.json 'something broke: no equilibrium .* nothing holds it'
}

fist() { short fist --set time.end=0.05; }
fold() { short fold --set time.end=0.1; }
funnel() { short funnel --set time.end=0.02; }
soft_and_stiff() { short soft_and_stiff --set time.end=0.03; }

# After 0.2 s the ball is in the tube's mouth and widens it.
tube() {
  short tube --set time.end=0.2 --set time.step=1/40 || return 1
  column contact_pairs tube/history.csv | awk '{ exit !($1 > 6) }'
}

# The resolved scene names the obstacle's file so that it is found from any folder.
a_scene_run_in_its_own_folder_repeats() {
  (cd "$scenes" && "$flesh" run jelly_drop.yaml --out "$work/here" --set time.end=1/60 --quiet) || return 1
  expect 0 "$flesh" run here/scene.yaml --out again --quiet && cmp here/state.txt again/state.txt
}

run_tests hand_pull hand_ball_with_its_skin jelly_drop twist inflated_sphere limb muscle_spindle tentacle limb_antagonists \
  what_hangs_pulls_with_its_weight welds_that_make_no_sense_are_refused \
  breaking_that_makes_no_sense_is_refused what_falls_off_is_said fist fold funnel soft_and_stiff tube \
  a_scene_run_in_its_own_folder_repeats
