#!/bin/sh
# deb.sh [DIR]: builds the Debian packages libflesh0.3, libflesh-dev, flesh and python3-flesh of the last commit into DIR
# (default packages), and checks them by lintian if it is installed. Needs git, debhelper, dh-python and the packages of
# drivers/build.md.
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
