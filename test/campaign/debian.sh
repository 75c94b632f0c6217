#!/bin/sh
# debian.sh: checks what README and build.md promise, on a bare Debian of a release in a folder of its own (chroot).
#   sh test/campaign/debian.sh trixie             drivers/demo.sh and test/run.sh: the demo runs, and all tests pass
#   sh test/campaign/debian.sh trixie --quick     the same with test/run.sh --quick
#   sh test/campaign/debian.sh trixie --packages  drivers/package/deb.sh makes packages without errors of lintian; in another
#                                                 bare system they install with apt, and their smoke test passes
# The tree is that of the last commit. Needs root, debootstrap, git and a network. CAMPAIGN names the folder in which the
# systems are made (~/.cache/flesh-campaign) and kept for the next time; MIRROR, if set, is the source of packages. The
# last lines name the versions that were tested and give the last line of the tests.
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
folder=${CAMPAIGN:-$HOME/.cache/flesh-campaign}

# make_system NAME: makes a bare system of the release, unless it is there.
make_system() {
  system=$folder/$1
  if [ ! -e "$system/complete" ]; then
    rm -rf "$system"
    mkdir -p "$system"
    # shellcheck disable=SC2086
    debootstrap --variant=minbase "$release" "$system" ${MIRROR:-} || die "debootstrap could not make $release"
    touch "$system/complete"
  fi
  cp /etc/resolv.conf "$system/etc/resolv.conf"
}

# in_system NAME ARGUMENT...: runs standard input in the system as a script, whose mounts end with it.
in_system() {
  system=$folder/$1
  shift
  cat >"$system/srv/script.sh"
  # shellcheck disable=SC2016
  unshare --mount --propagation private sh -c '
    system=$1
    shift
    mount -t proc proc "$system/proc" && mount -t sysfs sysfs "$system/sys" && mount --rbind /dev "$system/dev" &&
      exec chroot "$system" /usr/bin/env -i HOME=/srv LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
        PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin sh /srv/script.sh "$@"
  ' sh "$system" "$@"
}

make_system "debian-$release"
rm -rf "$folder/debian-$release/srv/flesh"
git clone -q --depth 1 "file://$root" "$folder/debian-$release/srv/flesh"
printf 'debian.sh: %s of %s\n' "$(git -C "$root" rev-parse --short HEAD)" "$release"

if [ "${1:-}" = --packages ]; then
  in_system "debian-$release" >"$folder/packages.log" 2>&1 <<'END' || { tail -n 40 "$folder/packages.log"; exit 1; }
cd /srv/flesh && apt-get update && apt-get install -y --no-install-recommends git ca-certificates dpkg-dev lintian &&
  apt-get build-dep -y --no-install-recommends ./drivers/package && rm -rf /srv/packages &&
  sh drivers/package/deb.sh /srv/packages
END
  grep '^[EW]: ' "$folder/packages.log" || true
  bare=debian-$release-bare
  rm -rf "${folder:?}/$bare"
  make_system "$bare"
  cp "$folder/debian-$release/srv/packages/"*.deb "$folder/$bare/srv"
  cp "$root/drivers/package/debian/tests/smoke" "$folder/$bare/srv"
  in_system "$bare" >"$folder/bare.log" 2>&1 <<'END' || { tail -n 40 "$folder/bare.log"; exit 1; }
cd /srv && rm -f ./*-dbgsym_* && apt-get update && apt-get install -y --no-install-recommends ./*.deb gcc libc6-dev pkg-config &&
  sh smoke && printf 'Debian %s, ' "$(cat /etc/debian_version)" && flesh --version | head -n 1
END
  tail -n 1 "$folder/bare.log"
  echo 'the packages install, and their smoke test passes'
  exit
fi

in_system "debian-$release" "$@" <<'END'
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
