# TEST full memory program seconds=60 needs=flesh
# test_command_material.sh: `flesh material` and `flesh schema`: table, pictures, words, bad usage.
# FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# cells FILE CONDITION: prints the number of rows for which awk's condition is true, on path, s,
# energy, constants, mu, lambda, psi, above, stress, eigenvalue.
cells() {
  awk -F , "NR > 1 { path = \$1; s = \$2; energy = \$3; constants = \$4; mu = \$5; lambda = \$6; psi = \$7
    above = \$8; stress = \$9; eigenvalue = \$10; if ($2) n++ } END { print n + 0 }" "$1"
}

the_table_has_the_closed_forms() {
  expect 0 "$flesh" material --out all --mu 1e4 --lambda 100000/3 || return 1
  table=all/material.csv
  # Five paths of 301 samples for the thirteen forms and D as_e.
  [ "$(cells $table 1)" -eq 21070 ] || return 1
  close='function close_to(a, b) { return (a - b)^2 < 1e-20 * (1 + b * b) }'
  awk -F , "$close"' NR > 1 && $1 == "stretch" && $3 == "M" {
      n++; if (!close_to($9, $5 * $2) || !close_to($7, $5 / 2 * ($2^2 - 1)) || !close_to($10, $5)) exit 1 }
    NR > 1 && $1 == "flatten" && $3 == "D" {
      n++; if (!close_to($9, $5 * $2 + $6 * ($2 - 1)) ||
        !close_to($8, $5 / 2 * ($2^2 - 1) + $6 / 2 * ($2 - 1)^2)) exit 1 }
    NR > 1 && $1 == "rotation" && $4 == "matched" { n++; if ($8^2 > 1e-10 || $9^2 > 1e-10) exit 1 }
    END { exit n != 301 * 13 }' $table || { echo 'not the closed forms'; return 1; }
  # The given constants are those of small strain: S has 4/3 of the given mu, E the given lambda plus mu.
  [ "$(cells $table 'energy == "S" && (mu - 4e4 / 3)^2 < 1e-12')" -eq 1505 ] || return 1
  [ "$(cells $table 'constants == "as_e" && (lambda - 1.3e5 / 3)^2 < 1e-12')" -eq 1505 ] || return 1
  # Forms with a logarithm or a root of J have no value where J <= 0; the others have one everywhere.
  [ "$(cells $table 'path == "flatten" && s <= 0 && energy ~ /^(Neo|A|B|C)$/ && psi stress eigenvalue == ""')" -eq 404 ] &&
    [ "$(cells $table 'energy ~ /^[MDES]$/ && (psi == "" || stress == "" || eigenvalue == "")')" -eq 0 ]
}

the_words_name_rest_and_limits() {
  has stdout.txt '^Given: mu 10000 Pa, lambda 33333.3 Pa$' && has stdout.txt '^D as_e ' || return 1
  has stdout.txt 'rests at 1 of its volume' && has stdout.txt 'a free body has no rest volume' &&
    has stdout.txt 'undefined for J <= 0' && has stdout.txt 'F = 0 is an equilibrium of zero stiffness' &&
    has stdout.txt 'F = 0 is no equilibrium' && has stdout.txt '^Fung matched .*exponent 0.25$'
}

pictures_are_drawn_or_their_scripts_left() {
  for path in stretch scale flatten shear rotation; do
    [ "$(head -c 4 all/$path.png | tail -c 3)" = PNG ] && [ -s all/$path.gp ] && [ ! -e all/$path.log ] || return 1
  done
  PATH=/nonexistent expect 3 "$flesh" material --out bare --energies S && has stderr.txt 'gnuplot-nox' || return 1
  [ -s bare/material.csv ] && [ -s bare/rotation.gp ] && [ ! -e bare/stretch.png ] || return 1
  (cd bare && gnuplot rotation.gp) && [ -s bare/rotation.png ]
}

curves_on_each_other_are_one() {
  has all/rotation.gp '"one line: Neo, A, B, C, M, D raw, D as_e, E, S, Fung, AB, CR, FCR, StVK"' || return 1
  [ "$(grep -c "'rotation',.*,\$8))" all/rotation.gp)" -eq 1 ] && [ "$(grep -c "'rotation',.*,\$9))" all/rotation.gp)" -eq 3 ] &&
    [ "$(grep -c "'stretch',.*,\$8))" all/stretch.gp)" -ge 8 ]
}

forms_that_do_not_take_the_constants_are_left_out() {
  expect 0 "$flesh" material --out some --constants raw --mu 1e4 --lambda 2000 --energies E,S &&
    has stderr.txt 'E raw is left out: .*lambda > mu/3' && [ "$(cells some/material.csv 'energy == "E"')" -eq 0 ] &&
    [ "$(cells some/material.csv 'energy == "S"')" -eq 1505 ] || return 1
  expect 2 "$flesh" material --out none --constants raw --mu 1e4 --lambda 1 --energies E &&
    has stderr.txt 'lambda > mu/3' &&
    [ ! -e none ]
}

# With psi = mu/2 (I_C - 3) and J = 1, stresses have closed forms on all paths whose free faces bear no pressure.
incompressible_stress_has_the_closed_forms() {
  expect 0 "$flesh" material --out half --young 3 --poisson 0.5 && has stderr.txt 'M raw is left out' || return 1
  awk -F , 'function near(a, b) { return a != "" && (a - b)^2 < 1e-9 * (1 + b * b) } # s has six digits
    NR > 1 && $3 ~ /^(Neo|A|D|E)$/ {
      s = $2; n++
      P = $1 == "stretch" ? s - s^-2 : $1 == "biaxial" ? s - s^-5 : $1 == "planar" ? s - s^-3 : $1 == "shear" ? s : 0
      if (!near($9, P) || $6 != "") { print; exit 1 }
      if ($1 == "stretch" && !near($8, (s^2 + 2 / s - 3) / 2)) { print; exit 1 }
      if ($1 == "stretch" && s < 1 && !near($10, 1 - s^-1.5)) { print; exit 1 } }
    NR > 1 && ($8 == "" || $9 == "" || $10 == "") { print; exit 1 }
    END { exit n != 301 * 5 * 5 }' half/material.csv || { echo 'not the closed forms'; return 1; }
  [ -s half/biaxial.png ] && [ -s half/planar.png ] && [ ! -e half/scale.png ]
}

bad_material_usage_is_refused() {
  while IFS='|' read -r words text; do
    expect 2 "$flesh" material $words && has stderr.txt "$text" && [ "$(lines stderr.txt)" -eq 1 ] ||
      { echo "words: $words"; cat stderr.txt; return 1; }
  done <<'END'
|--out is missing
--out bad --energies Q|--energies: energy is 'Q'; it must be one of Neo
--out bad --energies S,,E|--energies: energy is ''
--out bad --poisson 0.49999999999|poisson is 0.5 - 1e-11; it must be at most 0.4999999995
--out bad --poisson -1 --constants raw|poisson is -1; it must be in (-1, 0.5]
--out bad --young 0|--young is '0'; it must be a positive number
--out bad --lambda nan --mu 1|--lambda is 'nan'; it must be a finite number
--out bad --mu 1|--lambda is missing
--out bad --mu 1 --lambda 1 --young 1|choose one pair
--out bad --constants as_e|--constants is 'as_e'; it must be raw or matched
--out bad extra|too many arguments
END
  [ ! -e bad ] || return 1
  echo precious >file
  expect 3 "$flesh" material --out file && has stderr.txt 'must be a directory'
}

the_schema_is_printed() {
  expect 0 "$flesh" schema && has stdout.txt '^## effects.pin$' && has stdout.txt '`newton_tolerance`' || return 1
  expect 0 "$flesh" schema pin && has stdout.txt '`axes`' || return 1
  ! grep newton_tolerance stdout.txt || return 1
  expect 0 "$flesh" schema --format json && [ "$(head -c 1 stdout.txt)" = '{' ] || return 1
  expect 2 "$flesh" schema --format xml && has stderr.txt "--format is 'xml'; it must be markdown, json, man or paths" || return 1
  expect 2 "$flesh" schema pni && has stderr.txt 'pni is no section of .*, contact, results$' || return 1
  expect 2 "$flesh" schema pin spring && has stderr.txt "too many arguments: 'spring'" || return 1
  [ -c /dev/full ] || return 0
  "$flesh" schema >/dev/full 2>stderr.txt
  [ $? -eq 3 ]
}

help_is_help() {
  for command in material schema; do
    expect 0 "$flesh" $command --help && has stdout.txt "^Usage: flesh $command" && has stdout.txt '^  3  ' || return 1
  done
}

run_tests the_table_has_the_closed_forms the_words_name_rest_and_limits pictures_are_drawn_or_their_scripts_left \
  forms_that_do_not_take_the_constants_are_left_out curves_on_each_other_are_one \
  incompressible_stress_has_the_closed_forms bad_material_usage_is_refused the_schema_is_printed help_is_help
