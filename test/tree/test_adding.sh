#!/bin/sh
# TEST full source seconds=1800
# test_adding.sh: the steps of lib/adding.md are enough. In a copy of the tree a wind, a Yeoh form, Bossak's
# method, a command, a study and a format of tables (adding/) are added in the places that the page names and in no
# others; then the tests that it names pass, and the program has what was added. Speaks TAP.
set -u

top=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
given=$top/test/tree/adding
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
tests='test_added test_effects test_every_effect test_effect_keys test_forms test_material_constants test_material_spectrum
  test_scene test_methods test_conservation test_energy test_pages'
echo 1..5

# insert FILE PATTERN TEXT: puts TEXT before the first line that has PATTERN.
insert() {
  awk -v pattern="$2" -v text="$3" 'index($0, pattern) && !done { printf "%s", text; done = 1 } { print } END { exit !done }' \
    "$1" >"$work/new" && cp "$work/new" "$1"
}
# append FILE PATTERN TEXT: puts TEXT after the first line that has PATTERN.
append() {
  awk -v pattern="$2" -v text="$3" '{ print } index($0, pattern) && !done { printf "%s", text; done = 1 } END { exit !done }' \
    "$1" >"$work/new" && cp "$work/new" "$1"
}

mkdir "$work/tree"
(cd "$top" && tar cf - LICENSE README.md meson.build meson_options.txt data drivers include lib test) |
  (cd "$work/tree" && tar xf -)
cd "$work/tree" || exit 1
{
  # The effect: physics, row, registry, page.
  cp "$given/wind.c" "$given/wind.h" lib/effect/ &&
    cp "$given/wind_row.c" lib/scene/effects/wind.c &&
    append lib/scene/effect_registry.h 'ROW(pressure)' '  ROW(wind) \\\n' &&
    append drivers/effects.md '| `pressure` |' '| `wind` | the drag of moving air |\n' &&
    # The form: a row, psi, a constant, page.
    append include/flesh/material.h '#define FLESH_NEO_HOOKEAN_FORM_LIST(ROW)' \
      '  ROW(YEOH, yeoh, "Yeoh", "yeoh", 0, RAW_OR_MATCHED, "#CC3311", \\\n      "mu/2 (I_C-3) + c2 (I_C-3)^2 + lambda/2 (J-alpha)^2", "Yeoh 1993", \\\n      fmax(0, mu / 3 - 8 * c2), "max(0, mu/3 - 8 c2)", 0, mu, lambda + mu - 8 * c2, 1 + mu / lambda, QUADRATIC) \\\n' &&
    append include/flesh/material.h '#define FLESH_FORM_CONSTANT_LIST(ROW)' \
      '  ROW(YEOH, c2, "Pa", 0, mu / 10, "of (I_C-3)^2") \\\n' &&
    insert lib/material/psi_forms.h '/* Computes the neo-Hookean form `energy`;' "$(sed 's/\\/\\\\/g' "$given/yeoh_psi.h")
" &&
    append README.md '|---|---|---|---|' '| Yeoh (Yeoh 1993) | as E, and c2 (I_C-3)^2, `yeoh` | stress-free | fine |\n' &&
    # The method: a scheme, a row, an option, page.
    cp "$given/bossak.c" lib/time/ &&
    insert include/flesh/integrator.h 'ROW(IDA, ida,' \
      '  ROW(BOSSAK, bossak, "bossak", 2, "damps to rho_inf") \\\n' &&
    append include/flesh/integrator.h '#define FLESH_METHOD_OPTION_LIST(ROW)' \
      '  ROW(rho_inf, 0.8, 0, 1, "[0, 1]", "of bossak (Wood, Bossak & Zienkiewicz 1981): what is left of fast oscillations") \\\n' &&
    append README.md '`time.method` is' '`bossak`,\n' &&
    # The command, and the study: a file, a row, a page each.
    mkdir drivers/volume drivers/slump && cp "$given/volume.c" drivers/volume/command.c &&
    cp "$given/slump.c" drivers/slump/command.c &&
    insert drivers/commands.h 'ROW(schema,' '  ROW(volume, "print the volume of a mesh") \\\n' &&
    insert drivers/commands.h 'ROW(bench,' '  ROW(slump, "show what volume a body loses by its stiffness") \\\n' &&
    insert drivers/README.md '| [sweeps.md]' '| [adding](../lib/adding.md) | `volume`, `slump` | volumes of meshes and of soft bodies |\n' &&
    # The format: a file, a row, a page.
    cp "$given/format_tsv.c" drivers/study/ &&
    append drivers/study/formats.h 'ROW(jsonl,' '  ROW(tsv, "columns with tabs between them") \\\n' &&
    append drivers/sweeps.md '| `jsonl` |' '| `tsv` | columns with tabs between them |\n' &&
    # The test of all that was added.
    cp "$given/test_added.c" test/tree/
} >"$work/log" 2>&1
if [ $? -eq 0 ]; then echo 'ok 1 - the places are there'; else
  sed 's/^/# /' "$work/log"
  echo 'not ok 1 - the places are there'
fi

# Built with less optimisation to compile sooner: changed headers make most of ccache's objects useless.
# shellcheck disable=SC2086
if meson setup build -Doptimization=1 ${SETUP:-} >"$work/log" 2>&1 && ninja -C build drivers/flesh $(printf 'test/%s ' $tests) >>"$work/log" 2>&1; then
  echo 'ok 2 - it compiles'
else
  grep -E 'error|ERROR' "$work/log" | head -20 | sed 's/^/# /'
  echo 'not ok 2 - it compiles'
fi

# shellcheck disable=SC2086
if meson test -C build --no-rebuild $tests >"$work/log" 2>&1; then
  echo 'ok 3 - the tests that the page names pass'
else
  { grep -E 'FAIL|ERROR|TIMEOUT' "$work/log"; grep -B4 '^not ok' build/meson-logs/testlog.txt; } | head -40 | sed 's/^/# /'
  echo 'not ok 3 - the tests that the page names pass'
fi

# value NAME: prints a column of out/slump.db in the new format, without its head.
value() { $flesh sweep export out/slump.db --format tsv --columns "id, $1" | awk -F '\t' 'NR > 1 { print $2 }'; }
flesh=build/drivers/flesh
scene=data/scenes/swing_coarse.yaml
bar=data/meshes/bar_8x2x2.mesh
if [ "$($flesh volume "$bar")" = "$($flesh mesh info "$bar" | awk '$1 == "volume" { print $2 }')" ] &&
  $flesh --help | grep '  volume  *print the volume' >/dev/null && $flesh manual volume | grep 'volume of a mesh' >/dev/null &&
  $flesh completion bash | grep ' volume ' >/dev/null && [ -n "$($flesh volume "$bar")" ]; then
  echo 'ok 4 - the command is one'
else echo 'not ok 4 - the command is one'; fi

# The study resumes, runs as two shards that are joined, and is read in the format that was added.
if $flesh slump $scene --young 1e5,1e6 --out out >"$work/log" 2>&1 && [ "$(value young)" = '100000
1000000' ] &&
  first=$(value started) && $flesh slump $scene --young 1e5,1e6,1e7 --resume --out out >>"$work/log" 2>&1 &&
  [ "$(value started | head -2)" = "$first" ] && [ "$(value young | wc -l)" -eq 3 ] &&
  $flesh slump $scene --young 1e5,1e6,1e7 --shard 1/2 --out one >>"$work/log" 2>&1 &&
  $flesh slump $scene --young 1e5,1e6,1e7 --shard 2/2 --out two >>"$work/log" 2>&1 &&
  $flesh sweep merge both.db one/slump.db two/slump.db >>"$work/log" 2>&1 &&
  whole=$(value max_volume_drift) && cp both.db out/slump.db && [ "$(value max_volume_drift)" = "$whole" ] &&
  [ -s out/slump.png ] && grep -q '^The volume changes most at 100000 Pa' out/verdict.txt &&
  [ "$(wc -l <out/slump.csv)" -eq 4 ]; then
  echo 'ok 5 - the study goes on, is shared out and is read'
else
  sed 's/^/# /' "$work/log"
  echo 'not ok 5 - the study goes on, is shared out and is read'
fi
