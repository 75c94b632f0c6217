# TEST full memory program seconds=120 needs=flesh
# test_hostile_names.sh: names, titles and values that mean commands to gnuplot, ffmpeg or a shell are just names: a picture
# is drawn or refused in a sentence, and nothing else happens.
# shellcheck shell=sh disable=SC2154,SC2015,SC2016
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$source_folder/shared/sweep.sh"

# The program `proof` leaves a file when an injected command runs it, wherever that is.
mkdir bin
cat >bin/proof <<END
#!/bin/sh
touch "$work/proof"
END
chmod +x bin/proof
PATH=$work/bin:$PATH
harmless() { [ ! -e "$work/proof" ] || { rm -f "$work/proof"; echo "a command was run: $1"; return 1; }; }
is_png() { [ "$(head -c 4 "$1" 2>/dev/null | tail -c 3)" = PNG ] || { echo "no picture $1"; cat stderr.txt; return 1; }; }
have_gnuplot() { command -v gnuplot >/dev/null || { echo 'no gnuplot'; return 1; }; }

spec 'set: {time.end: 1/60}' 'axes: [{key: body.density, values: [500, 1000]}, {key: title, values: [a, b]}]'
"$flesh" sweep spec.yaml --out small --quiet || exit 1

# Puts words with a meaning to gnuplot, shells, SQL and terminals into titles and statuses of a database.
poison() {
  python3 - <<'END'
import sqlite3
words = ["failed\nend_of_data\nsystem('proof')\nset output '|proof'\n$x << end_of_data", "`proof`", "'; system('proof'); #",
         "\"; system(\"proof\"); #", "''''; system('proof') #", "@proof %s%n %d $1 \\", "<proof", "|proof", "\x1b]0;x\x07\x9b",
         "\\\"; system('proof') #", "{/=99 x}_{", "a" * 45 + "\u00fc\u00fc"]
db = sqlite3.connect("small/sweep.db")
base = db.execute("SELECT max(id) FROM cases").fetchone()[0]
names = [row[1] for row in db.execute("PRAGMA table_info(cases)")]
rows = db.execute("SELECT * FROM cases").fetchall()
for k, word in enumerate(words):
    for row in rows[:2]:
        row = dict(zip(names, row))
        base += 1
        row["id"], row["title"], row["case_key"] = base, word, str(base)
        if k % 2: row["status"] = word
        db.execute("INSERT INTO cases (%s) VALUES (%s)" % (", ".join('"%s"' % n for n in row), ", ".join("?" * len(row))),
                   list(row.values()))
db.execute("UPDATE cases SET status = ? WHERE id = 1", (words[0],))
db.commit()
END
}

a_foreign_database_is_drawn() {
  have_gnuplot || return 0
  cp small/sweep.db kept.db
  poison || return 1
  expect 0 "$flesh" sweep plot small/sweep.db --x density --y title --z newton --out heat.png && is_png heat.png &&
    expect 0 "$flesh" sweep plot small/sweep.db --x density --y newton --z newton --by status --out maps.png &&
    is_png maps.png && expect 0 "$flesh" sweep plot small/sweep.db --x title --y density --by title --where 1=1 \
    --out lines.png && is_png lines.png &&
    expect 0 "$flesh" sweep plot small/sweep.db --table results --x density --y newton --by title --out by.png &&
    is_png by.png || return 1
  for script in heat maps lines by; do
    gnuplot "$script.gp" 2>stderr.txt && is_png "$script.png" && harmless "$script.gp" || return 1
  done
  harmless database
}

# asked FILE TITLE: the picture is drawn under its name or refused; a status of 0 without a picture is a failure.
asked() {
  name=$1
  "$flesh" sweep plot kept.db --x density --y newton --by title --title "$2" --out "$name" >stdout.txt 2>stderr.txt
  status=$?
  harmless "$name" || return 1
  case $status in
    0) is_png "$name" || { echo "said to be drawn: $name"; return 1; } ;;
    2) [ "$(lines stderr.txt)" -eq 1 ] || { cat stderr.txt; return 1; } ;;
    *) echo "$name ended with $status"; cat stderr.txt; return 1 ;;
  esac
}

pictures_get_the_names_they_are_given() {
  have_gnuplot || return 0
  mkdir -p "o'f %s"
  count=0
  for name in './-e.png' './-.png' "./it's.png" './a b.png' './#.png' './%d %s.png' "./+'; system('proof'); #.png" './`proof`.png' \
    './$(proof).png' './"; system("proof"); #.png' './\140proof\140.png' './@proof.png' './~.png' './+.png' './++.png' \
    "./''''; system('proof') #.png" './;proof;.png' './ü.png' "./o'f %s/x.png" './\.png' './a\.png' "$(printf './\377.png')"; do
    asked "$name" "$name" && [ "$status" -eq 0 ] || { echo "not drawn: $name"; cat stderr.txt; return 1; }
    count=$((count + 1))
  done
  [ "$count" -eq 22 ] && ! find . -name '*.part-*' | grep . && ! find . -name '.picture*' | grep .
}

pipes_and_control_characters_are_refused() {
  for name in './|proof;#.png' './|proof.png' './<proof.png' "$(printf './a\nproof\n.png')" "$(printf './a\033.png')" './.png'; do
    asked "$name" x && [ "$status" -eq 2 ] || { echo "drawn: $name"; return 1; }
  done
}

# Random names and titles of characters that mean something somewhere run no command.
what_is_random_is_harmless() {
  have_gnuplot || return 0
  python3 - >fuzz.txt <<'END'
import random
random.seed(16)
parts = list("'\"`|<>$@#%\\;{}()&*~+-!^_ ,.=:?[]") + ["proof", "system('proof')", "$(proof)", "`proof`", "''", "\\047", "\\n", "e"]
for _ in range(12):
    print("./n" [: random.choice([2, 2, 3])] + "".join(random.choice(parts) for _ in range(random.randint(1, 14))) + ".png")
END
  while IFS= read -r name; do
    asked "$name" "$name" || { echo "name: $name"; return 1; }
  done <fuzz.txt
  [ "$(lines fuzz.txt)" -eq 12 ]
}

scenes_of_any_name_are_compared() {
  have_gnuplot || return 0
  mkdir scenes
  for name in "$(printf 'a\nb')" "it's; proof #" '`proof` "x", %d' '|proof' "$(printf '\377')"; do
    sed 's/tiny/tiny/' tiny.yaml >"scenes/$name.yaml"
  done
  expect 0 "$flesh" drift scenes/* --energies S --poisson 0.4 --solvers guarded --out drifts || return 1
  [ ! -s stderr.txt ] || { cat stderr.txt; return 1; }
  harmless drift && [ "$(ls drifts | grep -c '^volume_.*png$')" -eq 5 ] && [ "$(lines drifts/drift.csv)" -eq 6 ] &&
    is_png drifts/volume_a_b_0.4.png || { ls drifts; return 1; }
  for script in drifts/*.gp; do
    (cd drifts && gnuplot "./${script#drifts/}") && harmless "$script" || return 1
  done
  # A row has as many fields as the header, whatever its scene is called.
  awk -F , 'NR == 1 { n = NF } NF != n { exit 1 }' drifts/drift.csv
}

# Curves are drawn whatever names columns, units, words in them, files and titles have.
curves_of_any_name_are_drawn() {
  have_gnuplot || return 0
  mkdir curves
  python3 - <<'END'
import csv
words = ["END\nsystem('proof')", "`proof`", "'; system('proof'); #", "\"; system(\"proof\"); #", "@proof %s%n $1 \\", "<proof",
         "|proof", "\x1b]0;x\x07", "{/=99 x}_{", "\u00fc" * 30]
with open("curves/'`proof`.csv", "w", newline="") as file:
    out = csv.writer(file)
    out.writerow(["t [`proof`]", "'; system('proof') # [|proof]", "by"])
    out.writerows([k, k * k, word] for word in words for k in range(3))
END
  for name in "'; proof #.svg" '`proof`.png' '"x", %d.pdf' '<proof.svg' '|proof.png' "$(printf 'a\nb').svg"; do
    "$flesh" plot "curves/'\`proof\`.csv" --y "'; system*" --by by --title '`proof` @proof' --out "$name" >stdout.txt 2>stderr.txt
    code=$?
    harmless "$name" || return 1
    case $name in
    [\<\|]* | a*) [ "$code" -eq 2 ] && has stderr.txt 'name' ;;
    *) [ "$code" -eq 0 ] && [ -s "$name" ] ;;
    esac || { echo "$name: $code"; cat stderr.txt; return 1; }
  done
  [ "$(grep -c 'id="gnuplot_plot_' "'; proof #.svg")" -eq 10 ] && ! find . -name '.picture*' | grep .
}

# ffmpeg is given no name of the user's, so that addresses, patterns and options are just names.
films_of_any_name_are_made() {
  cat >bin/ffmpeg <<'END'
#!/bin/sh
printf '%s\n' "$@" >>"$CALLED"
for last; do :; done
[ -e ./frame_000001.png ] && echo video >"$last"
END
  chmod +x bin/ffmpeg
  CALLED=$work/called.txt
  export CALLED
  "$flesh" run "$source_folder/../data/scenes/bar_gravity.yaml" --set "body.mesh=$source_folder/../data/meshes/one_tet.mesh" \
    --set time.end=1/30 --out a_run --quiet || return 1
  for name in 'concat:a|b.mp4' 'http:x.mp4' '50%d.mp4' './-i.mkv' 'a;proof.gif' '`proof`.webm' "$(printf 'a\nb.mp4')" 'pipe:1.mp4'; do
    expect 0 "$flesh" film a_run --width 60 --out "$name" && [ -s "$name" ] && harmless "$name" || { echo "$name"; return 1; }
  done
  ! grep -E 'concat|http|%d|proof|pipe|^b' called.txt && ! find . -name '*.part-*' | grep .
}

run_tests a_foreign_database_is_drawn pictures_get_the_names_they_are_given pipes_and_control_characters_are_refused \
  what_is_random_is_harmless scenes_of_any_name_are_compared curves_of_any_name_are_drawn films_of_any_name_are_made
