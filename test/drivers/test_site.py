#!/usr/bin/env python3
# TEST full seconds=300 needs=plain,build,python,flesh
"""test_site.py: the site is built from all pages without a warning, shows the interfaces of C and Python, loads nothing
from elsewhere, and opens in Chromium without errors. BUILD is the build. Speaks TAP; skipped without Sphinx."""
import importlib.util
import os
import re
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "shared"))
import browser as chromium  # noqa: E402
import tap  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(HERE))
BUILD = os.environ["BUILD"]
SITE = os.path.join(BUILD, "site")
FIRST = os.path.join(SITE, "drivers", "site", "index.html")
MISSING = [tool for tool in ("doxygen", "sphinx-build") if not shutil.which(tool)]
MISSING += [module for module in ("myst_parser", "breathe") if not importlib.util.find_spec(module)]


def read(*parts):
    with open(os.path.join(SITE, *parts), encoding="utf-8") as file:
        return file.read()


def pages():
    return [os.path.relpath(os.path.join(folder, name), SITE) for folder, _, names in os.walk(SITE) for name in names
            if name.endswith(".html")]


def it_is_made_without_a_warning():
    shutil.rmtree(SITE, ignore_errors=True)
    shutil.rmtree(os.path.join(BUILD, "site-pages"), ignore_errors=True)
    done = subprocess.run(["sh", os.path.join(ROOT, "drivers", "site", "site.sh"), ROOT, BUILD, "0"],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def every_page_is_there():
    found = []
    for folder, below, names in os.walk(ROOT):
        below[:] = [name for name in below if not name.startswith(".") and
                    not os.path.exists(os.path.join(folder, name, "meson-info")) and name not in ("three", "out")]
        found += [os.path.relpath(os.path.join(folder, name), ROOT) for name in names if name.endswith(".md")]
    assert len(found) > 50, found
    for page in found:
        assert os.path.exists(os.path.join(SITE, page[:-3] + ".html")), page


def interfaces_are_shown():
    use, extend, link, python = (read("drivers", "site", name + ".html") for name in ("c_use", "c_extend", "c_link", "python"))
    for page, words in ((use, ("flesh_integrator_step", "FLESH_METHOD_BACKWARD_EULER", "FLESH_ERR_FILE")),
                        (extend, ("flesh_effect_operations",)), (link, ("flesh_ida_problem_create",)), (python, ("OwnEffect",))):
        for word in words:
            assert word in page, word
    headers = {name[:-2] for name in os.listdir(os.path.join(ROOT, "include", "flesh")) if name.endswith(".h")}
    told = {name for page in (use, extend, link) for name in re.findall(r"<h2>(\w+)\.h", page)}
    assert headers - told == {"flesh"}, headers - told  # flesh.h includes the others


def keys_and_commands_are_shown():
    keys, commands = read("drivers", "site", "keys.html"), read("drivers", "site", "commands.html")
    for word in ("effects.contact.sphere", "breaks_at", "newton_tolerance"):
        assert word in keys, word
    assert "max_volume_drift" in read("drivers", "site", "results.html")
    for word in ("<h2>sensitivity", "flesh sweep merge OUT.db", "--checkpoint EVERY"):
        assert word in commands, word


def tutorials_lead_to_a_picture_and_a_conclusion():
    first = read("drivers", "site", "index.html")
    names = sorted(name for name in os.listdir(os.path.join(ROOT, "drivers", "tutorials")) if name.endswith(".md"))
    assert len(names) == 5, names
    for name in names:
        page = name[:-3] + ".html"
        assert f'href="../tutorials/{page}"' in first, page
        words = read("drivers", "tutorials", page)
        pictures = re.findall(r'<img[^>]*src="([^"]*)"', words)
        assert pictures and "<h2>What to conclude" in words, page
        for picture in pictures:
            assert os.path.exists(os.path.join(SITE, "drivers", "tutorials", picture)), picture


def nothing_is_loaded_from_elsewhere():
    for page in pages():
        for place in re.findall(r'<(?:script|img|link|iframe)[^>]*?(?:src|href)="([^"]*)"', read(page)):
            assert not re.match(r"(?:[a-z]+:)?//", place), (page, place)


def it_opens_in_a_browser():
    if chromium.MISSING:
        return
    window = chromium.Browser()
    try:
        for page in (FIRST, os.path.join(SITE, "README.html"), os.path.join(SITE, "drivers", "site", "c_use.html"),
                     os.path.join(SITE, "drivers", "tutorials", "01-accuracy.html")):
            window.open(page)
            complaints = window.ask("POST", "/se/log", {"type": "browser"})
            assert not complaints, complaints
    finally:
        window.close()


TESTS = (it_is_made_without_a_warning, every_page_is_there, interfaces_are_shown,
         keys_and_commands_are_shown, tutorials_lead_to_a_picture_and_a_conclusion, nothing_is_loaded_from_elsewhere, it_opens_in_a_browser)

if MISSING:
    print("1..0 # SKIP missing: " + ", ".join(MISSING))
    sys.exit(0)
sys.exit(tap.run(TESTS))
