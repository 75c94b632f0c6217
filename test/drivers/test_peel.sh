# TEST full program seconds=300 needs=flesh
# test_peel.sh: the force that peels off a strip at a right angle is the toughness of its weld, breaks_at^2/(2 stiffness),
# times the width (Rivlin 1944). FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
scene=$source_folder/../data/scenes/peel.yaml

# Once the free part stands upright, this is the mean of the forces after increments, which swing as rows of parts break.
the_force_is_the_toughness_times_the_width() {
  expect 0 "$flesh" run "$scene" --out peel --quiet --no-frames || return 1
  awk -F, 'NR > 1 && $1 > 0.65 { sum += $4; n++ } END {
    ideal = 1886^2 / (2 * 26667) * 0.1
    print "force over toughness times width:", sum / n / ideal
    exit !(sum / n > 0.97 * ideal && sum / n < 1.07 * ideal) }' peel/probes.csv
}

# The weld opens from its end on. The released energy is more than the toughness times the area, as within an increment parts
# are stretched beyond their limit before they break.
it_opens_from_its_end() {
  awk -F, 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    { broken = $column["weld_broken"]; fell = fell || broken < last; last = broken; released = $column["weld_released"] }
    END { ratio = released / (broken * 0.06) / (1886^2 / (2 * 26667))
      print "broken:", broken, "released over toughness:", ratio
      exit !(!fell && broken > 0.4 && broken < 0.8 && ratio > 1 && ratio < 1.12) }' peel/history.csv || return 1
  has peel/result.json '"notes": "weld: .* first at t = 0\.5[0-9]* s at (0\.99'
}

run_tests the_force_is_the_toughness_times_the_width it_opens_from_its_end
