#!/bin/sh
# deb.sh [DIR]: the Debian packages libflesh0.3, libflesh-dev, flesh and python3-flesh of the last commit, into DIR
# (packages), checked by lintian where that is installed. Needs git, debhelper, dh-python and what drivers/build.md lists.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
into=${1:-packages}
mkdir -p "$into"
into=$(CDPATH='' cd -- "$into" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
git clone -q --depth 1 "file://$root" "$work/flesh"
cd "$work/flesh"
cp -R drivers/package/debian debian
dpkg-buildpackage --build=binary --no-sign
if command -v lintian >/dev/null 2>&1; then lintian --fail-on error --allow-root "$work"/*.changes; fi
cp "$work"/*.deb "$into"
