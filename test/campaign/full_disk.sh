#!/bin/sh
# full_disk.sh: runs every command that writes on disks that are too small for it, and prints the number of disks.
#
#   FLESH=build/drivers/flesh sh test/campaign/full_disk.sh           a few sizes
#   FLESH=build/drivers/flesh sh test/campaign/full_disk.sh --full    all of them
#
# The commands, sizes and checks are those of ../drivers/test_full_disk.sh.
set -eu
here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
FLESH=$(realpath "${FLESH:-build/drivers/flesh}")
export FLESH
if [ "${1:-}" = --full ]; then
  set --
else
  set -- quick
fi
count=$(mktemp)
trap 'rm -rf "$count" "$count.d"' EXIT
# A copy of the test that counts every disk.
mkdir "$count.d"
cp -r "$here/../shared" "$here/../drivers" "$count.d/"
sed -i "s|^on_disk() {|&\n  echo \"\$1\" >>'$count'|" "$count.d/shared/full_disk.sh"
status=0
sh "$count.d/drivers/test_full_disk.sh" "$@" >"$count.d/tap" || status=$?
cat "$count.d/tap"
if grep -q '^not ok' "$count.d/tap"; then status=1; fi
echo "$(wc -l <"$count") disks"
exit "$status"
