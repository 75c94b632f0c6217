# hardcases.sh: runs `flesh hardcases` into out and reads its table.

# The column NAME of the rows of FOLDER/hardcases.csv whose case, energy, poisson and solver are given.
value() {
  awk -F , -v name="$1" -v row="$2" -v energy="$3" -v poisson="$4" -v solver="${5:-default}" '
    NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    $column["case"] == row && $column["energy"] == energy && $column["poisson"] == poisson &&
    $column["solver"] == solver { print $column[name] }' out/hardcases.csv
}

# all_are COLUMN VALUE: every row says so.
all_are() {
  awk -F , -v name="$1" -v wanted="$2" '
    NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    $column[name] != wanted { print $0; bad = 1 }
    END { exit bad || NR < 2 }' out/hardcases.csv
}

battery() { expect 0 "$flesh" hardcases --quick --out out --max-seconds 60 "$@"; }
