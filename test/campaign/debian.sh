#!/bin/sh
# debian.sh: the README's two commands on a bare Debian of a release, in a folder of its own (chroot): the demo runs, and
# all tests pass.
#   sh test/campaign/debian.sh trixie             drivers/demo.sh and test/run.sh
#   sh test/campaign/debian.sh trixie --quick     drivers/demo.sh and test/run.sh --quick
# The tree is that of the last commit. Needs root, debootstrap, git and a network. CAMPAIGN names the folder in which the
# system is made (~/.cache/flesh-campaign) and kept for the next time; MIRROR, where set, where packages come from.
# The last lines name the versions of what was tried and give the last line of the tests.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
die() {
  echo "debian.sh: $*" >&2
  exit 1
}
release=${1:-}
[ -n "$release" ] || die 'name a release of Debian: trixie, bookworm'
shift
[ "$(id -u)" -eq 0 ] || die 'a system in a folder of its own needs root'
for tool in debootstrap git unshare; do
  command -v $tool >/dev/null 2>&1 || die "there is no $tool"
done

system=${CAMPAIGN:-$HOME/.cache/flesh-campaign}/debian-$release
if [ ! -e "$system/complete" ]; then
  rm -rf "$system"
  mkdir -p "$system"
  # shellcheck disable=SC2086
  debootstrap --variant=minbase "$release" "$system" ${MIRROR:-} || die "debootstrap could not make $release"
  touch "$system/complete"
fi
cp /etc/resolv.conf "$system/etc/resolv.conf"
rm -rf "$system/srv/flesh"
git clone -q --depth 1 "file://$root" "$system/srv/flesh"
printf 'debian.sh: %s of %s\n' "$(git -C "$root" rev-parse --short HEAD)" "$release"

# What is mounted for it is gone when it ends.
cat >"$system/srv/two_commands.sh" <<'END'
cd /srv/flesh || exit 1
sh drivers/demo.sh >/srv/demo.log 2>&1
demo=$?
tail -n 3 /srv/demo.log
sh test/run.sh "$@" >/srv/tests.log 2>&1
tests=$?
grep -a -A 20 '^FAILED' /srv/tests.log
printf 'Debian %s, %s\n' "$(cat /etc/debian_version)" "$(cc --version | head -n 1)"
build/drivers/flesh --version
printf 'demo.sh ended with %s\n' "$demo"
tail -n 1 /srv/tests.log
[ "$demo" -eq 0 ] && [ "$tests" -eq 0 ]
END
# shellcheck disable=SC2016
unshare --mount --propagation private sh -c '
  system=$1
  shift
  mount -t proc proc "$system/proc" && mount -t sysfs sysfs "$system/sys" && mount --rbind /dev "$system/dev" &&
    exec chroot "$system" /usr/bin/env -i HOME=/srv LANG=C.UTF-8 \
      PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin sh /srv/two_commands.sh "$@"
' sh "$system" "$@"
