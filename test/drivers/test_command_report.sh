# TEST full memory program needs=flesh
# TEST name=test_report_comparisons full memory program needs=flesh args: comparisons
# test_command_report.sh: `flesh report`: its data are those of the results, and results that it cannot use are refused.
# FLESH names the program. `comparisons` runs only the test of reports of all kinds of studies, which are computed first.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
export PYTHONPATH="$source_folder/shared" PYTHONDONTWRITEBYTECODE=1

"$flesh" mesh box --cells 6,2,2 --size 3,1,1 --out bar.msh >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  material: {energy: S, constants: matched, young: 1e5, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {step: 1/60, end: 1/6}
output: {probes: [{name: tip, point: [3, 0.5, 0.5], quantities: [position]}]}
END
"$flesh" run bar.yaml --out soft --quiet || exit 1
"$flesh" run bar.yaml --out stiff --quiet --set body.material.young=1e6 || exit 1

# Positions in the report are within half a quantum, 1/131072 of the diagonal of sqrt(11) m, and speeds within 1/2048 of the
# colours' range.
frames_come_back() {
  expect 0 "$flesh" report soft stiff --out r.html && has stdout.txt '^report: r.html, 0.[0-9]* MB, .*: 22 frames of 2 runs$' ||
    return 1
  python3 - <<'END'
from report_file import Report, vtu_array
report = Report("r.html")
view = report.json["view"]
assert [run["name"] for run in view["runs"]] == ["soft", "stiff"], view["runs"]
most = largest = 0
for run in view["runs"]:
    assert len(run["times"]) == 11 and run["numbers"] == list(range(11)), run
    assert abs(run["quantum"] / (11 ** 0.5 / 65536) - 1) < 1e-8, run["quantum"]
    for k, (x, fields, inverted) in enumerate(report.frames(run)):
        name = f"{run['name']}/frames/frame_{k:06d}.vtu"
        there, v = vtu_array(name, "Points"), vtu_array(name, "velocity")
        off = max(abs(value - x[i // 3][i % 3]) for i, value in enumerate(there))
        assert off <= 0.501 * run["quantum"], (name, off / run["quantum"])
        most = max(most, off / run["quantum"])
        largest = max(largest, max(abs(value) for value in there))
        step = run["fields"][2][1]
        for i, speed in enumerate(fields[2]):
            own = sum(v[3 * i + d] ** 2 for d in range(3)) ** 0.5
            assert abs(own - speed) <= 0.501 * step, (name, i, own, speed)
        assert not inverted, (name, inverted)
assert 0.4 < most and largest > 3, (most, largest)
assert view["runs"][0]["mesh"] == view["runs"][1]["mesh"], "the mesh stands there once"
END
}

# J at a node is the mean over the tets around it, weighted by volume; all tets have the same volume at rest.
fields_are_those_of_the_pictures() {
  expect 0 "$flesh" snap soft --out s.png --width 60 --picture-height 40 --bare || return 1
  python3 - <<'END'
from report_file import Report, vtu_array
report = Report("r.html")
run, field = report.json["view"]["runs"][0], report.json["view"]["fields"][0]
tets, frames = report.list(run["mesh"]["tets"]), list(report.frames(run))
J = vtu_array("soft/frames/frame_000010.vtu", "J_mean")
sums, weights = [0.0] * run["mesh"]["nodes"], [0] * run["mesh"]["nodes"]
for t, value in enumerate(J):  # Kuhn's tets of equal cells have one volume
    for node in tets[4 * t:4 * t + 4]:
        sums[node] += value
        weights[node] += 1
low, step = run["fields"][0]
assert abs(low - field["low"]) < 1e-9 and abs(step - (field["high"] - field["low"]) / 1024) < 1e-9
for i, value in enumerate(frames[-1][1][0]):
    assert abs(sums[i] / weights[i] - value) <= 0.501 * step, (i, sums[i] / weights[i], value)
assert max(frames[-1][1][1]) > 1000 and max(frames[0][1][1]) < 1, "stress in Pa"
END
}

the_page_is_whole_and_loads_nothing() {
  python3 - <<'END'
import html.parser, re
from report_file import Report
text = Report("r.html").html
assert text.startswith("<!doctype html>") and text.endswith("</html>\n")
class Parser(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.loads, self.scripts = [], [], 0
    def handle_starttag(self, tag, attributes):
        if tag not in ("meta", "link", "img", "input"):
            self.open.append(tag)
        self.scripts += tag == "script"
        self.loads += [value for name, value in attributes
                       if name in ("src", "href") and not value.startswith("data:image/png;base64,")]
    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag
parser = Parser()
parser.feed(text)
parser.close()
assert not parser.open and not parser.loads and parser.scripts == 3, (parser.open, parser.loads, parser.scripts)
assert "default-src 'none'" in text and "Permission is hereby granted, free of charge" in text
assert not re.search(r"@[A-Z]+@", text)
END
}

# Readers without WebGL or scripts see a picture of the first view: both runs, in colours.
a_still_picture_is_in_the_page() {
  python3 - <<'END'
import base64, re
from report_file import Report
report = Report("r.html")
found = re.search(r'<main id="main">\s*<div id="lead"><p>[^<]*</p></div>\s*<img id="still" [^>]*src="data:image/png;base64,([A-Za-z0-9+/=]*)">', report.html)
open("still.png", "wb").write(base64.b64decode(found.group(1)))
assert report.json["view"]["start"] in report.json["view"]["runs"][0]["times"][1:], report.json["view"]["start"]
END
  [ $? -eq 0 ] || return 1
  python3 - <<'END'
import struct, zlib
data = open("still.png", "rb").read()
width, height = struct.unpack(">II", data[16:24])
at, packed = 8, b""
while at < len(data):
    size, kind = struct.unpack(">I4s", data[at:at + 8])
    packed += data[at + 8:at + 8 + size] if kind == b"IDAT" else b""
    at += size + 12
assert kind == b"IEND" and width > 960 and len(zlib.decompress(packed)) > 3 * width * height, (width, height)
END
}

words_tables_and_sources_are_there() {
  python3 - <<'END'
import csv, json
from report_file import Report
part = Report("r.html").json["parts"][0]
result = json.load(open("soft/result.json"))
drift = result["figures"]["max_volume_drift"]
assert part["verdict"][0].startswith("Of 2 runs stiff changed its volume least"), part["verdict"]
assert f"soft is complete after 10 steps, at t = 0.1667 s. Its volume changed by at most {100 * drift:.3g} %" in \
    part["verdict"][1], part["verdict"]
tables = {table["title"]: {column["name"]: column["values"] for column in table["columns"]} for table in part["tables"]}
assert tables["Figures of the runs"]["max_volume_drift"][0] == float(f"{drift:.9g}")
for folder in ("soft", "stiff"):
    for name in ("history.csv", "probes.csv"):
        rows = list(csv.DictReader(open(f"{folder}/{name}")))
        table = tables[f"{folder}: {name}"]
        for key in rows[0]:
            assert [float(f"{float(row[key]):.9g}") for row in rows] == table[key], (folder, name, key)
assert {source["title"]: source["value"] for source in part["sources"]}["soft: scene"] == open("soft/scene.yaml").read()
assert {plot["title"]: plot["y"] for plot in part["plots"]} == {"History": "volume_ratio", "Probes": "tip.position_x [m]"}
END
}

# A history that is still being written, and far longer than a plot shows, is thinned.
long_histories_are_thinned() {
  mkdir long && cp soft/scene.yaml soft/state.txt long &&
    awk 'BEGIN { print "t,step,volume_ratio"; for (k = 0; k <= 5000; k++) print k / 64 "," k "," 1 + k / 1024; printf "79,50" }' \
      >long/history.csv
  expect 0 "$flesh" report long --out long.html || return 1
  python3 - <<'END'
from report_file import Report
part = Report("long.html").json["parts"][0]
table = next(table for table in part["tables"] if table["title"] == "long: history.csv")
values = {column["name"]: column["values"] for column in table["columns"]}
assert values["step"] == list(range(0, 5000, 3)) + [5000] and values["t"][1] == 3 / 64, values["step"][-3:]
assert part["notes"] == ["Of history.csv of long one row in 3 is here."], part["notes"]
END
}

fewer_frames_are_evenly_taken() {
  expect 0 "$flesh" report soft --frames 1 --out one.html && has stdout.txt ': 1 frame of 1 run$' || return 1
  expect 0 "$flesh" report soft --frames 3 --out few.html && has stdout.txt ': 3 frames of 1 run$' || return 1
  python3 - <<'END'
from report_file import Report
view = Report("few.html").json["view"]
assert view["runs"][0]["numbers"] == [0, 5, 10] and view["notes"] == ["Of the 11 frames of soft 3 are shown."], view
END
}

# Faces of six nodes have vertices between their nodes; those of a box of 1 by 1 by 3 m are cut into equal parts.
curved_bodies_have_their_lattice() {
  expect 0 "$flesh" run bar.yaml --out curved --quiet --set body.element=tet10-mean --set time.end=1/60 &&
    expect 0 "$flesh" report curved --out curved.html || return 1
  python3 - <<'END'
from report_file import Report
report = Report("curved.html")
mesh = report.json["view"]["runs"][0]["mesh"]
nodes, six, eighths = mesh["nodes"], report.list(mesh["six"]), report.list(mesh["eighths"])
rest, corners, hidden = report.list(mesh["rest"]), report.list(mesh["corners"]), report.list(mesh["hidden"])
assert len(report.list(mesh["edges"])) == 6 * mesh["tet_count"] and len(corners) == 48 * (len(hidden) // 16)
assert max(corners) == nodes + len(six) // 6 - 1
x = [[rest[d * nodes + v] for d in range(3)] for v in range(nodes)]
for v in range(len(six) // 6):
    assert sum(eighths[6 * v:6 * v + 6]) == 8
    x.append([sum(eighths[6 * v + a] * x[six[6 * v + a]][d] for a in range(6)) / 8 for d in range(3)])
def area(t):
    p, q, r = (x[corner] for corner in corners[3 * t:3 * t + 3])
    a, b = [q[d] - p[d] for d in range(3)], [r[d] - p[d] for d in range(3)]
    return [(a[d - 2] * b[d - 1] - a[d - 1] * b[d - 2]) / 2 for d in range(3)]
sums = [0.0] * 3
for t in range(0, len(hidden), 16):  # straight faces are cut into sixteen equal parts
    areas = [area(k) for k in range(t, t + 16)]
    largest = max(abs(value) for value in areas[0])
    assert all(abs(own[d] - areas[0][d]) < 1e-3 * largest for own in areas for d in range(3)), areas
    sums = [sums[d] + sum(abs(own[d]) for own in areas) for d in range(3)]
q = report.json["view"]["runs"][0]["quantum"]
assert all(abs(sums[d] * q * q - wanted) < 1e-3 for d, wanted in enumerate((2, 6, 6))), sums
assert sum(3 - bin(side).count("1") for side in hidden) == 12 * (len(hidden) // 16), "edges of the mesh are four sides each"
END
}

runs_without_frames_show_their_states() {
  expect 0 "$flesh" run bar.yaml --out bare --quiet --set output.frame_interval=0 || return 1
  rm -rf bare/frames && expect 0 "$flesh" report bare --out bare.html && has stdout.txt ': 2 frames of 1 run$' || return 1
  rm bare/result.json bare/history.csv && expect 0 "$flesh" report bare --out bare.html || return 1
  python3 - <<'END'
from report_file import Report
report = Report("bare.html").json
assert "left no result.json" in report["parts"][0]["verdict"][0] and report["view"]["notes"], report
assert report["parts"][0]["notes"] == ["bare has no history.csv that can be read."], report["parts"][0]["notes"]
END
}

comparisons_are_reported() {
  expect 0 "$flesh" drift bar.yaml --energies E,S --poisson 0.45 --solvers guarded --out drift --jobs 1 &&
    expect 0 "$flesh" hardcases --quick --cases single_plane --energies S --poisson 0.45 --out hard --jobs 1 || return 1
  expect 0 "$flesh" accuracy bar.yaml --out acc --quick --methods newmark --steps 1/60,1/120 --reference-seconds 0.01 ||
    return 1
  printf '%s\n' 'scene: bar.yaml' 'set: {time.end: 1/30}' 'axes: [{key: body.material.young, values: [1e4, 1e5]}]' >s.yaml
  expect 0 "$flesh" sweep s.yaml --out sweep && expect 0 "$flesh" report drift hard sweep sweep/sweep.db acc --out all.html ||
    return 1
  python3 - <<'END'
from report_file import Report
report = Report("all.html").json
drift, hard, sweep, again, accuracy = report["parts"]
assert drift["verdict"][0].startswith("bar at Poisson's ratio 0.45: ") and "keeps its volume best" in drift["verdict"][0], drift
assert hard["verdict"][0] == "1 of 1 cases are back at rest, or in the equilibrium that was to be kept.", hard["verdict"]
assert "takes the least CPU time" in accuracy["verdict"][0] or "of the motion" in accuracy["verdict"][0], accuracy["verdict"]
page = open("all.html", encoding="utf-8").read()
assert "<p>Hard cases: 1 of 1 cases are back at rest" in page[:page.index('<script id="payload"')]
assert drift["verdict"][1:] == [open("drift/verdict.txt").read()] and hard["verdict"][1:] == [open("hard/verdict.txt").read()]
assert sweep["verdict"][0] == "2 cases: 2 complete." and sweep["verdict"] == again["verdict"], sweep["verdict"]
assert accuracy["verdict"][1:] == [open("acc/verdict.txt").read()], accuracy["verdict"]
methods = next(column for column in accuracy["tables"][0]["columns"] if column["name"] == "method")["values"]
assert methods[:2] == ["newmark", "newmark"] and accuracy["plots"][0]["log"] == [True, True], (methods, accuracy["plots"])
assert any(source["title"] == "provenance" and "flesh" in source["value"] for source in accuracy["sources"])
young = next(column for column in sweep["tables"][0]["columns"] if column["name"] == "young")
assert young["values"] == [10000, 100000], young
assert [run["name"] for run in report["view"]["runs"]] == ["E, bar", "S, bar"]
assert all(run["times"][0] == 0 and abs(run["times"][-1] - 1 / 6) < 1e-8 for run in report["view"]["runs"])
assert hard["grids"][0]["value"] == "outcome" and any("no mesh" in note for note in hard["notes"])
END
}

# The report of a fit has the parameters, here a slide's friction and speed, with their errors, and the measured numbers; that
# of a killed fit says so.
fits_are_reported() {
  expect 0 "$flesh" fit "$source_folder/../data/fits/slide.yaml" --out slide --quiet && mkdir killed && cp slide/fit.db killed &&
    expect 0 "$flesh" report slide killed --out fits.html || return 1
  python3 - <<'END'
import csv, json
from report_file import Report
part, killed = Report("fits.html").json["parts"]
found = json.load(open("slide/result.json"))
tables = {table["title"]: {column["name"]: column["values"] for column in table["columns"]} for table in part["tables"]}
own = tables["Parameters"]
for k, wanted in enumerate(found["parameters"]):
    assert own["name"][k] == wanted["name"] and wanted["at_bound"] is None, wanted
    for key in ("value", "standard_error", "low_95", "high_95", "start"):
        assert abs(own[key][k] / wanted[key] - 1) < 1e-8, (key, own[key][k], wanted)
    assert part["verdict"][1 + k].startswith(f"{wanted['name']} = {wanted['value']:.6g} +/- {wanted['standard_error']:.2g} (95 %: ")
assert part["verdict"][0].startswith(f"{found['residuals']['measured_numbers']} measured numbers are fitted in ")
assert part["verdict"][3:] == found["identifiability"] and not part["notes"], part
rows = list(csv.DictReader(open("slide/fit.csv")))
for key in ("value", "fitted", "residual"):
    assert [float(f"{float(row[key]):.9g}") for row in rows] == tables["fit.csv"][key], key
assert [plot["y"] for plot in part["plots"]] == ["fitted", "residual"], part["plots"]
assert {"correlation", "provenance"} < {source["title"] for source in part["sources"]}
assert killed["verdict"] == ["The fit left no result.json: it is still going on, or it was killed."], killed["verdict"]
assert killed["notes"] == ["There is no fit.csv that can be read."] and not killed["tables"] + killed["plots"], killed
END
}

# Sentences about made-up tables are right: about the greatest ratio, the last scene and its own solver, and about cases that
# did not recover.
made_up_tables_are_told() {
  mkdir made lost quick
  printf '%s\n' scene,energy,constants,solver,element,poisson,status,max_volume_drift b,S,matched,guarded,tet4,0.4,complete,0.7 \
    a,S,matched,guarded,tet4,0.3,complete,0.5 a,S,matched,guarded,tet4,0.4,complete,0.01 a,D,as_e,guarded,tet4,0.4,failed,-0.2 \
    a,S,matched,plain,tet4,0.4,complete,0.9 >made/drift.csv
  printf '%s\n' case,folder,energy,constants,poisson,solver,element,seed,outcome \
    one,cases/one,S,matched,0.4,default,tet4,1,recovered two,cases/two,D,raw,0.4,plain,tet10,2,stopped \
    three,cases/three,S,matched,0.4,default,tet4,1,untangled >lost/hardcases.csv
  printf '%s\n' method,setting,price,cpu_s,error_over_motion bdf2,step=1,work,0.1,0.05 ida,tolerance=1,work,0.3,0.005 \
    ida5,tolerance=1,work,0.25,0.004 hht,step=1,mass,0.01,0.001 >quick/accuracy.csv
  echo '{"reference": {"apart": 0.5}}' >quick/accuracy.json
  expect 0 "$flesh" report made lost quick --out made.html || return 1
  python3 - <<'END'
from report_file import Report
made, lost, quick = Report("made.html").json["parts"]
assert made["verdict"] == ["a at Poisson's ratio 0.4: S keeps its volume best, within 1 %, and D with the constants of E worst, "
                           "within 20 %. 1 of 5 runs did not complete."], made["verdict"]
assert lost["verdict"] == ["2 of 3 cases are back at rest, or in the equilibrium that was to be kept; not so two: D with raw "
                           "constants, Poisson's ratio 0.4, solver plain, tet10, seed 2 (stopped)."], lost["verdict"]
assert "Of 2 cases that did not recover 0 are shown." in lost["notes"], lost["notes"]
assert quick["verdict"] == ["With an error of at most 1 % of the motion, ida5 (tolerance=1) takes the least CPU time, 0.25 s."]
assert quick["sources"] == [{"title": "the reference", "value": {"apart": 0.5}}], quick["sources"]
END
}

names_from_outside_are_text() {
  mkdir 'a <b>' && cp -r soft 'a <b>/<script>alert(1)' &&
    expect 0 "$flesh" report 'a <b>/<script>alert(1)' --frames 2 --out odd.html --title '</title><script>x & y' || return 1
  grep -q '<title>&lt;/title&gt;&lt;script&gt;x &amp; y</title>' odd.html &&
    [ "$(grep -c '[^;]alert(1)' odd.html)" -eq 0 ] && grep -q '<p>&lt;script&gt;alert(1) is complete' odd.html
}

bad_report_usage_is_refused() {
  echo words >words.txt
  mkdir empty hollow
  echo 'scene,energy' >hollow/drift.csv
  echo 'no database' >no.db
  while IFS='|' read -r code words text; do
    # shellcheck disable=SC2086
    expect "$code" "$flesh" report $words && has stderr.txt "$text" && [ "$(lines stderr.txt)" -eq 1 ] ||
      { echo "words: $words"; cat stderr.txt; return 1; }
  done <<'END'
2|soft|--out is missing; it must be a file whose name ends in .html
2|soft --out r.htm|--out is 'r.htm'; it must be a file whose name ends in .html
2|--out bad.html|RESULT
2|soft --frames 0 --out bad.html|--frames is '0'
3|nowhere --out bad.html|nowhere: there is no such folder
3|empty --out bad.html|empty: this is no folder of a result: it has none of scene.yaml, drift.csv
3|words.txt --out bad.html|words.txt: this is a file; a report takes the folder of a result
3|hollow --out bad.html|hollow/drift.csv: it has no rows
3|no.db --out bad.html|no.db: this is no database of a sweep
3|soft --out nowhere/bad.html|nowhere/bad.html: cannot be written: there is no folder nowhere
END
  [ ! -e bad.html ]
}

if [ "${1-}" = comparisons ]; then
  run_tests comparisons_are_reported
  exit
fi
run_tests frames_come_back fields_are_those_of_the_pictures the_page_is_whole_and_loads_nothing \
  a_still_picture_is_in_the_page words_tables_and_sources_are_there long_histories_are_thinned fewer_frames_are_evenly_taken \
  curved_bodies_have_their_lattice runs_without_frames_show_their_states fits_are_reported \
  made_up_tables_are_told names_from_outside_are_text \
  bad_report_usage_is_refused
