#!/bin/sh
# TEST full source seconds=1800
# test_adding.sh: what lib/adding.md says is enough. In a copy of the tree a wind, a Yeoh form and the generalised-alpha
# method (adding/) are added in the places that the page names and in no others; then the tests that it names pass.
# Speaks TAP.
set -u

top=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
given=$top/test/tree/adding
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
tests='test_added test_effects test_every_effect test_effect_keys test_forms test_material_constants test_material_spectrum
  test_scene test_methods test_conservation test_energy test_pages'
echo 1..3

# insert FILE PATTERN TEXT: TEXT before the first line that has PATTERN.
insert() {
  awk -v pattern="$2" -v text="$3" 'index($0, pattern) && !done { printf "%s", text; done = 1 } { print } END { exit !done }' \
    "$1" >"$work/new" && cp "$work/new" "$1"
}
# append FILE PATTERN TEXT: TEXT after it.
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
      '  ROW(YEOH, yeoh, "Yeoh", "yeoh", 0, RAW_OR_MATCHED, "#CC3311", \\\n      "mu/2 (I_C-3) + c2 (I_C-3)^2 + lambda/2 (J-alpha)^2", "Yeoh 1993", \\\n      mu / 3 - 8 * c2, "mu/3 - 8 c2", 0, mu, lambda + mu - 8 * c2, 1 + mu / lambda, QUADRATIC) \\\n' &&
    append include/flesh/material.h '#define FLESH_FORM_CONSTANT_LIST(ROW)' \
      '  ROW(YEOH, c2, "Pa", 0, mu / 10, "of (I_C-3)^2") \\\n' &&
    insert lib/material/psi_forms.h '/* The neo-Hookean form `energy` where' "$(sed 's/\\/\\\\/g' "$given/yeoh_psi.h")
" &&
    append README.md '|---|---|---|---|' '| Yeoh (Yeoh 1993) | as E, and c2 (I_C-3)^2, `yeoh` | stress-free | fine |\n' &&
    # The method: a scheme, a row, an option, page.
    cp "$given/generalised_alpha.c" lib/time/ &&
    insert include/flesh/integrator.h 'ROW(ADAPTIVE, adaptive,' \
      '  ROW(GENERALISED_ALPHA, generalised_alpha, "generalised-alpha", 2, "damps to rho_inf") \\\n' &&
    append include/flesh/integrator.h '#define FLESH_METHOD_OPTION_LIST(ROW)' \
      '  ROW(rho_inf, 0.8, 0, 1, "[0, 1]", "of generalised-alpha (Chung & Hulbert 1993): what is left of fast oscillations") \\\n' &&
    append README.md '`time.method` is' '`generalised-alpha`,\n' &&
    # Their own test.
    cp "$given/test_added.c" test/tree/
} >"$work/log" 2>&1
if [ $? -eq 0 ]; then echo 'ok 1 - the places are there'; else
  sed 's/^/# /' "$work/log"
  echo 'not ok 1 - the places are there'
fi

# shellcheck disable=SC2086
if meson setup build ${SETUP:-} >"$work/log" 2>&1 && ninja -C build $(printf 'test/%s ' $tests) >>"$work/log" 2>&1; then
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
