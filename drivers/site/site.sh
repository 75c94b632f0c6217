#!/bin/sh
# site.sh SOURCE BUILD VERSION: makes the site in BUILD/site. Needs Debian's python3-sphinx, python3-myst-parser, doxygen
# and python3-breathe, and for Python's interface python3-numpy and python3-cffi. Warnings are errors.
set -eu
source=$(CDPATH='' cd -- "$1" && pwd)
build=$(CDPATH='' cd -- "$2" && pwd)
for tool in sphinx-build doxygen; do
  command -v $tool >/dev/null 2>&1 || { echo "site.sh: there is no $tool; drivers/build.md names the packages" >&2; exit 1; }
done
FLESH_SITE_VERSION=$3
FLESH_SITE_DOXYGEN=$build/site-headers
FLESH_SITE_XML=$FLESH_SITE_DOXYGEN/xml
FLESH_SITE_PROGRAM=$build/drivers/flesh
PYTHONPATH=$build/drivers/python
export FLESH_SITE_VERSION FLESH_SITE_DOXYGEN FLESH_SITE_XML FLESH_SITE_PROGRAM PYTHONPATH
mkdir -p "$FLESH_SITE_DOXYGEN"
(cd "$source/include" && doxygen "$source/drivers/site/Doxyfile")
sphinx-build -q -W --keep-going -j auto -d "$build/site-pages" -c "$source/drivers/site" -b html "$source" "$build/site"
echo "the site begins at $build/site/drivers/site/index.html"
