#!/usr/bin/env python3
# TEST full program seconds=600 needs=flesh
"""test_report_browser.py: a report in Chromium, used by pointer and by keyboard, on a desktop and on a phone, light and
dark; its colours are those of `flesh snap`. FLESH names the program. Speaks TAP; skipped without Chromium."""
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "shared"))
import browser as chromium  # noqa: E402
import tap  # noqa: E402
from report_file import Report  # noqa: E402

FLESH = os.environ.get("FLESH", "flesh")
SCENE = """
body:
  mesh: bar.msh
  material: {energy: S, constants: matched, young: 3e4, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {step: 1/60, end: 1/3}
"""
DROP = """
body: {mesh: bar.msh, element: tet10-mean, material: {energy: S, constants: matched, young: 3e4, poisson: 0.45}}
effects:
  - inertia: {}
  - gravity: {}
  - contact: {plane: {point: [0, 0, -0.05], normal: [0, 0, 1]}, thickness: 0.01}
time: {step: 1/60, end: 1/10}
"""


def flesh(*words):
    done = subprocess.run([FLESH, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, (words, done.stderr)
    return done.stdout


def make_results():
    flesh("mesh", "box", "--cells", "6,2,2", "--size", "3,1,1", "--out", "bar.msh")
    for name, text in (("bar.yaml", SCENE), ("drop.yaml", DROP)):
        with open(name, "w", encoding="utf-8") as file:
            file.write(text)
    flesh("run", "bar.yaml", "--out", "soft", "--quiet")
    flesh("run", "bar.yaml", "--out", "stiff", "--quiet", "--set", "body.material.young=3e5")
    flesh("run", "drop.yaml", "--out", "drop", "--quiet")
    flesh("drift", "bar.yaml", "--energies", "E,S", "--poisson", "0.45", "--solvers", "guarded", "--out", "drift")
    flesh("hardcases", "--quick", "--cases", "single_plane", "--energies", "S", "--poisson", "0.45", "--out", "hard")
    flesh("accuracy", "bar.yaml", "--quick", "--methods", "newmark", "--steps", "1/60,1/120", "--reference-seconds",
          "0.01", "--out", "acc")
    with open("sweep.yaml", "w", encoding="utf-8") as file:
        file.write("scene: bar.yaml\nset: {time.end: 1/30}\naxes: [{key: body.material.young, values: [1e4, 1e5]}]\n")
    flesh("sweep", "sweep.yaml", "--out", "sweep")
    with open("many.yaml", "w", encoding="utf-8") as file:
        file.write("scene: bar.yaml\nset: {time.end: 1/60}\naxes:\n  - {key: body.material.young, values: [1e4, 1e5]}\n"
                   "  - {key: body.density, from: 100, to: 900, count: 9}\n")
    flesh("sweep", "many.yaml", "--out", "many")
    flesh("report", "many", "--out", "many.html")
    flesh("report", "drift", "hard", "acc", "sweep", "--out", "all.html")
    flesh("report", "soft", "stiff", "--out", "report.html")
    flesh("report", "drop", "--out", "drop.html")


def load(page, name):
    page.open(os.path.abspath(name))
    page.wait("return document.documentElement.dataset.ready")


def drawn(page):
    """Returns the step that is drawn, once the picture is there."""
    page.run("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return int(page.run("return document.documentElement.dataset.drawn"))


def clock(page):
    return page.run("return document.querySelector('output').textContent")


def reports_open_without_a_word(page):
    for name in ("report.html", "drop.html"):
        load(page, name)
        words = page.log()
        assert not words, words
        names = page.run("return [...document.querySelectorAll('.stage .name')].map((name) => name.textContent)")
        assert names == (["soft", "stiff"] if name == "report.html" else ["drop"]), names
        loads = page.run("return performance.getEntriesByType('resource').map((entry) => entry.name)")
        assert not loads, loads
    *_, rows = page.picture("canvas")
    assert len({pixel for row in rows for pixel in row}) > 100, "the drop is seen"


def comparisons_open_without_a_word(page):
    load(page, "all.html")
    words = page.log()
    assert not words, words
    titles = page.run("return [...document.querySelectorAll('h2')].map((title) => title.textContent)")
    assert titles == ["In three dimensions", "How the energies keep the volume", "Hard cases", "What accuracy costs",
                      "Sweep"], titles
    plots = page.run("""return [...document.querySelectorAll('svg.plot')].map((plot) => [plot.querySelectorAll('circle').length +
      plot.querySelectorAll('path:not(.axis)').length, plot.getAttribute('aria-label')])""")
    assert len(plots) >= 7 and all(count for count, _ in plots), plots
    assert page.run("return document.querySelectorAll('td.good').length") > 4
    page.run("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    page.wait("return document.querySelectorAll('details .scroll table').length >= 3")
    assert not page.log()


def lines_of_many_series_are_told_apart(page):
    """The ninth line, in the colour of the first, is dashed; cases at one position have no line through them."""
    load(page, "many.html")
    lines = """return [...document.querySelectorAll('svg.plot path[stroke-dasharray]')].map((path) =>
      path.getAttribute('stroke-dasharray'))"""
    assert page.run(lines) == 8 * ["none"] + ["6 4"], page.run(lines)
    page.run("""const choice = [...document.querySelectorAll('figure label')].find((label) =>
      label.textContent.startsWith('x')).querySelector('select');
      choice.value = 'density'; choice.dispatchEvent(new Event('change'));""")
    assert page.run(lines) == [], page.run(lines)
    assert page.run("return document.querySelectorAll('svg.plot circle').length") == 18


def the_slider_moves_what_is_seen(page):
    load(page, "report.html")
    page.keys("#time", "Home")
    assert drawn(page) == 0 and clock(page) == "t = 0 s (1 of 21)", clock(page)
    before = page.picture("canvas")
    page.keys("#time", "Right", "Right")
    assert drawn(page) == 2 and clock(page) == "t = 0.03333 s (3 of 21)", clock(page)
    page.keys("#time", "End")
    assert drawn(page) == 20 and page.run("return document.querySelector('#time').value") == "20"
    assert page.picture("canvas") != before
    page.drag("#time", -200, 0)
    assert 0 < drawn(page) < 20, drawn(page)


def keys_do_everything(page):
    load(page, "report.html")
    state = "return [...document.querySelectorAll('#wireframe, #lit, #clip')].map((box) => box.checked)"
    page.keys("canvas", "Home")
    assert drawn(page) == 0
    pictures = [page.picture("canvas")]
    for key, wanted in (("w", [True, True, False]), ("l", [True, False, False]), ("x", [True, False, True])):
        page.keys("canvas", key)
        drawn(page)
        assert page.run(state) == wanted, (key, page.run(state))
        pictures.append(page.picture("canvas"))
    for key in ("]", "End", "c", "+"):
        page.keys("canvas", key)
        drawn(page)
        pictures.append(page.picture("canvas"))
    assert page.run("return document.querySelector('#colours').selectedIndex") == 2
    assert all(a != b for a, b in zip(pictures, pictures[1:])), [a != b for a, b in zip(pictures, pictures[1:])]
    page.keys("canvas", "Left", "Left")
    assert drawn(page) == 18
    page.keys("canvas", "Home", "Space")
    page.wait("return Number(document.documentElement.dataset.drawn) > 3")
    page.keys("canvas", "Space")
    stopped = drawn(page)
    assert page.run("return document.querySelector('.controls button').textContent").endswith("play")
    assert stopped < 20 and drawn(page) == stopped
    # Tab visits every control, in order, and each has a name.
    nameless = page.run("""return [...document.querySelectorAll('button, input, select, svg[tabindex], canvas')].filter((one) =>
      one.tabIndex >= 0 && !one.hidden && !(one.textContent.trim() || one.getAttribute('aria-label') ||
      (one.labels && [...one.labels].some((label) => label.textContent.trim())))).map((one) => one.outerHTML)""")
    assert not nameless, nameless
    assert not page.log()


def near(a, b, most):
    return all(abs(x - y) <= most for x, y in zip(a, b))


def inside(mask, x, y, reach):
    return all(0 <= y + j < len(mask) and 0 <= x + i < len(mask[0]) and mask[y + j][x + i]
               for j in range(-reach, reach + 1) for i in range(-reach, reach + 1))


def snap(view, frame, width, height, *options):
    """Returns the panel that `flesh snap` draws with the camera of the report's view, in the shape of its canvas."""
    camera = view["camera"]
    seen = camera["height"] * max(1, camera["aspect"] / (width / height))
    flesh("snap", "soft", "--frame", str(frame), "--bare", "--flat", "--no-skin", "--width", str(width),
          "--picture-height", str(height), "--target", ",".join(map(repr, camera["target"])), "--height", repr(seen),
          "--out", "snap.png", *options)
    with open("snap.png", "rb") as file:
        whole, tall, rows = chromium.read_png(file.read())
    left, top = 10, (tall - height) // 2
    assert whole >= width + left, (whole, width)
    return [row[left:left + width] for row in rows[top:top + height]]


def colours_are_those_of_snap(page):
    load(page, "report.html")
    view = Report("report.html").json["view"]
    page.run("document.querySelectorAll('[role=group] input')[1].click()")
    page.keys("canvas", "l", "End", "r")
    drawn(page)
    flesh_colour = (224, 164, 140)
    page.run("const c = document.querySelector('#colours'); c.selectedIndex = 0; c.dispatchEvent(new Event('change'))")
    drawn(page)
    width, height, own = page.picture("canvas")
    theirs = snap(view, 20, width, height, "--colour", "none")
    masks = [[[near(pixel, flesh_colour, 3) for pixel in row] for row in picture] for picture in (own, theirs)]
    both = sum(a and b for p, q in zip(*masks) for a, b in zip(p, q))
    either = sum(a or b for p, q in zip(*masks) for a, b in zip(p, q))
    assert either > 0.05 * width * height and both > 0.98 * either, (both, either, width * height)
    middle = [(x, y) for y in range(height) for x in range(width)
              if masks[0][y][x] and masks[1][y][x] and x % 3 == 0 and y % 3 == 0 and inside(masks[0], x, y, 3)]
    for k, name in enumerate(("J", "stress", "speed")):
        page.run("const c = document.querySelector('#colours'); c.selectedIndex = arguments[0]; "
                 "c.dispatchEvent(new Event('change'))", k + 1)
        drawn(page)
        *_, own = page.picture("canvas")
        field = view["fields"][k]
        theirs = snap(view, 20, width, height, "--colour", name, "--range", f"{field['low']!r},{field['high']!r}")
        off = sorted(max(abs(a - b) for a, b in zip(own[y][x], theirs[y][x])) for x, y in middle)
        assert len(off) > 1000 and off[int(0.99 * len(off))] <= 6, (name, off[len(off) // 2], off[int(0.99 * len(off))])
        assert len({theirs[y][x] for x, y in middle}) > 50, "there are colours to compare"


def light_keeps_colours_apart(page):
    """With light on, the darkest is 0.42 of the colour itself (in linear light), and nothing is brighter."""
    load(page, "report.html")
    page.keys("canvas", "End", "r")
    drawn(page)
    _, _, lit = page.picture("canvas")
    page.keys("canvas", "l")
    drawn(page)
    _, _, flat = page.picture("canvas")
    changed = [(a, b) for p, q in zip(lit, flat) for a, b in zip(p, q) if not near(a, b, 1)]
    assert len(changed) > 5000
    linear = lambda value: ((value / 255 + 0.055) / 1.055) ** 2.4 if value > 10 else value / 255 / 12.92
    wrong = [pair for pair in changed if not all(linear(b) * 0.40 - 0.01 <= linear(a) <= linear(b) * 1.01 + 0.01 for a, b in zip(*pair))]
    assert len(wrong) < 0.01 * len(changed), (len(wrong), len(changed), wrong[:3])


def a_section_takes_half_away(page):
    load(page, "report.html")
    page.keys("canvas", "Home", "l")
    drawn(page)
    before = page.picture("canvas")
    page.run("document.querySelector('[aria-label=\"place of the section\"]').value = 0.25")
    page.run("document.querySelector('[aria-label=\"place of the section\"]').dispatchEvent(new Event('input'))")
    page.keys("canvas", "x")
    drawn(page)
    assert page.run("return document.querySelector('#clip').closest('.controls').textContent").find("x = 0.7") > 0
    after = page.picture("canvas")
    grey = lambda pixel: max(pixel) - min(pixel) < 12 and pixel[2] >= pixel[0]
    count = [sum(not grey(pixel) for row in picture[2] for pixel in row) for picture in (before, after)]
    assert 0.15 < count[1] / count[0] < 0.5, count


def tables_sort_and_plots_read_out(page):
    load(page, "report.html")
    column = """return [...document.querySelectorAll('table tbody tr')].slice(0, 2).map((row) => row.cells[4].textContent)"""
    drift = "Array.from(document.querySelectorAll('th button')).find((one) => one.textContent === 'max_volume_drift')"
    page.run(f"{drift}.id = 'sort'")
    page.click("#sort")
    up = page.run("return [...document.querySelectorAll('table tbody tr')].slice(0, 2).map((row) => row.cells[0].textContent)")
    assert page.run("return document.querySelector('#sort').parentNode.getAttribute('aria-sort')") == "ascending"
    page.keys("#sort", "Enter")
    down = page.run("return [...document.querySelectorAll('table tbody tr')].slice(0, 2).map((row) => row.cells[0].textContent)")
    assert up == ["stiff", "soft"] and down == ["soft", "stiff"], (up, down, page.run(column))
    page.run("document.querySelector('svg.plot').scrollIntoView({block: 'center'})")
    page.hover("svg.plot", 0, 0)
    read = "return document.querySelector('.reading').textContent"
    page.hover("svg.plot", 40, -20)
    page.hover("svg.plot", 41, -20)
    words = page.run(read)
    if not words:  # no other control may be this near: look along the height
        for y in range(-120, 120, 15):
            page.hover("svg.plot", 0, y)
            words = words or page.run(read)
    assert ": t = " in words and "volume_ratio = " in words, words
    page.keys("svg.plot", "Right", "Right")
    assert page.run(read) != words


def luminance(page, selector, what):
    text = page.run("return getComputedStyle(document.querySelector(arguments[0]))[arguments[1]]", selector, what)
    rgb = [float(part) / 255 for part in text[text.index("(") + 1:-1].split(",")[:3]]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in rgb]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrasts(page):
    for selector, ground in (("p", "body"), ("figcaption, .faint", "body"), ("td", ".scroll"), ("summary", "body")):
        a, b = luminance(page, selector, "color"), luminance(page, ground, "backgroundColor")
        assert (max(a, b) + 0.05) / (min(a, b) + 0.05) >= 4.5, (selector, a, b)


def phones_and_dark_rooms_are_served(page):
    load(page, "report.html")
    contrasts(page)
    page.tools("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=1, mobile=True)
    page.tools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    load(page, "report.html")
    assert luminance(page, "body", "backgroundColor") < 0.02 < 0.5 < luminance(page, "body", "color")
    contrasts(page)
    assert page.run("return document.documentElement.scrollWidth") == 390
    cut = page.run("""return [...document.querySelectorAll('button, input, select, canvas, svg, p, h1, h2, h3, summary')]
      .filter((one) => !one.closest('.scroll, details:not([open]) > :not(summary)') && one.getClientRects().length)
      .filter((one) => { const box = one.getBoundingClientRect(); return box.left < 0 || box.right > 390.5; })
      .map((one) => one.outerHTML.slice(0, 80))""")
    assert not cut, cut
    small = page.run("""return [...document.querySelectorAll('button, select, summary, input')]
      .filter((one) => one.getClientRects().length && parseFloat(getComputedStyle(one).fontSize) < 12).length""")
    assert small == 0
    drawn(page)
    width, height, rows = page.picture("canvas")
    assert width > 340 and 200 < height < 844, (width, height)
    assert len({pixel for row in rows for pixel in row}) > 100
    page.tools("Emulation.clearDeviceMetricsOverride")
    page.tools("Emulation.setEmulatedMedia", features=[])
    assert not page.log()


def a_still_picture_stands_where_webgl_fails(_page):
    page = chromium.Browser(further=["--disable-3d-apis"])
    try:
        load(page, "report.html")
        width, height = page.run("const still = document.querySelector('#still'), box = still.getBoundingClientRect();"
                                 "return [Math.min(still.naturalWidth, box.width), Math.min(still.naturalHeight, box.height)]")
        assert width > 700 and height > 200, (width, height)
        assert page.run("return document.querySelectorAll('canvas, #time, #colours').length") == 0
        assert "needs WebGL 2" in page.run("return document.querySelector('#view .note').textContent")
        *_, rows = page.picture("#still")
        assert len({pixel for row in rows for pixel in row}) > 100, "the bodies are seen"
        assert page.run("return document.querySelectorAll('svg.plot').length") > 0
    finally:
        page.close()


TESTS = [reports_open_without_a_word, comparisons_open_without_a_word, lines_of_many_series_are_told_apart,
         the_slider_moves_what_is_seen, keys_do_everything, colours_are_those_of_snap, light_keeps_colours_apart,
         a_section_takes_half_away, tables_sort_and_plots_read_out, phones_and_dark_rooms_are_served,
         a_still_picture_stands_where_webgl_fails]


def main():
    if chromium.MISSING:
        print("1..0 # SKIP missing:", ", ".join(chromium.MISSING))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        make_results()
        page = chromium.Browser()
        try:
            return tap.run(TESTS, page)
        finally:
            page.close()
            os.chdir("/")


if __name__ == "__main__":
    sys.exit(main())
