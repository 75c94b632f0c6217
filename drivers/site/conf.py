"""conf.py: configures Sphinx for flesh's site: the tree's pages, the C interface by Doxygen and Breathe, Python's by autodoc.

Called by site.sh, which sets FLESH_SITE_XML (Doxygen's output), FLESH_SITE_PROGRAM, FLESH_SITE_VERSION and PYTHONPATH."""
import os
import re
import subprocess

from pygments.lexers import TextLexer

project = "flesh"
author = "the flesh authors"
copyright = "2026, the flesh authors"  # Sphinx wants it by this name
version = release = os.environ["FLESH_SITE_VERSION"]

# Links to folders and files of the tree lead nowhere on the site; test_tree checks them all.
suppress_warnings = ["myst.xref_missing"]
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "drivers/site/index"
include_patterns = ["drivers/**.md", "README.md", "CHANGELOG.md", "data/**.md", "include/**.md", "lib/**.md", "test/**.md"]
include_patterns += ["drivers/*.md", "data/*.md", "lib/*.md", "test/*.md"]
exclude_patterns = ["build*", "drivers/report/three/*"]

# Titles get the same anchors as on web pages that show the repository.
myst_heading_anchors = 6
myst_enable_extensions = ["dollarmath"]
breathe_projects = {"flesh": os.environ["FLESH_SITE_XML"]}
breathe_default_project = "flesh"
breathe_domain_by_extension = {"h": "c"}
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
napoleon_use_ivar = True

html_theme = "alabaster"
html_theme_options = {"page_width": "1180px", "sidebar_width": "260px", "fixed_sidebar": True, "show_powered_by": False}
html_title = f"flesh {version}"
html_show_sphinx = False
html_copy_source = False


HEADER = r"""
## \1

```{eval-rst}
.. doxygenfile:: \1
   :sections: briefdescription detaileddescription innerclass enum typedef func var define
```
"""


def link_to_folder(app, env, node, content):
    """Shows links to folders and files of the tree, which have no page on the site, as plain text."""
    target = os.path.join(app.srcdir, os.path.dirname(node.get("refdoc", "")), node["reftarget"])
    return content if os.path.exists(target) else None


def show_headers(app, docname, source):
    """Shows the declarations of the headers that a page lists (- [state.h](...))."""
    if os.path.basename(docname).startswith("c_"):
        source[0] = re.sub(r"^- \[(\w+\.h)\].*\n", HEADER, source[0], flags=re.M)


def program(*words):
    """Returns what the program prints."""
    return subprocess.run([os.environ["FLESH_SITE_PROGRAM"], *words], capture_output=True, text=True, check=True).stdout


def show_program(app, docname, source):
    """Shows the keys of a scene, the results of a run and the help of every command as the program prints them."""
    if docname == "drivers/site/keys":
        source[0] = program("schema")
    elif docname == "drivers/site/results":
        source[0] = program("schema", "results")
    elif docname == "drivers/site/commands":
        listed = program("--help").partition("Commands:\n")[2].partition("\n\n")[0]
        for name in (line.split()[0] for line in listed.splitlines()):
            source[0] += f"\n## {name}\n\n```text\n{program(name, '--help')}```\n"


def plain_docstring(app, what, name, obj, options, lines):
    """Treats docstrings as plain text: escapes bars, which denote absolute values, and shows indented lines verbatim."""
    result, literal = [], False
    for line in lines:
        before = next((earlier for earlier in reversed(result) if earlier.strip()), "")
        if line.startswith(" ") and not literal and not before.startswith((" ", ":", "..")):
            result += ["", "::", ""]
            literal = True
        elif line.strip() and not line.startswith(" ") and literal:
            result.append("")
            literal = False
        result.append(line if literal else line.replace("|", "\\|"))
    lines[:] = result


def setup(app):
    for language in ("csv", "geo"):
        app.add_lexer(language, TextLexer)
    app.connect("source-read", show_headers)
    app.connect("source-read", show_program)
    app.connect("missing-reference", link_to_folder)
    app.connect("autodoc-process-docstring", plain_docstring)
