# setup.sh: shared by demo.sh and test/run.sh: the installation of missing Debian packages, and the build.
# To be sourced by a POSIX shell with `root` set to the top of the tree.
# shellcheck shell=sh disable=SC2154

die() {
  printf '%s: %s\n' "${0##*/}" "$*" >&2
  exit 1
}

# present PACKAGE KIND NAME: whether the package is installed, or the thing NAME that it is wanted for is there without it.
present() {
  if command -v dpkg-query >/dev/null 2>&1 &&
    dpkg-query -W -f '${db:Status-Status}\n' "$1" 2>/dev/null | grep -qx installed; then
    return 0
  fi
  case $2 in
    tool) command -v "$3" >/dev/null 2>&1 ;;
    pkg-config) pkg-config --exists "$3" 2>/dev/null ;;
    python) /usr/bin/python3 -c "import $3" 2>/dev/null ;;
    sanitizer) echo 'int main(void) { return 0; }' |
      clang -fsanitize="$3" -x c - -o /dev/null 2>/dev/null ;;
    header) printf '#include <%s>\n' "$3" |
      ${CC:-cc} -E -I/usr/include/suitesparse - >/dev/null 2>&1 ;;
  esac
}

# Rows: a package, the kind and name of the thing that may be there instead, and what it is for.
build_packages() {
  if [ -z "${CC:-}" ]; then
    echo 'gcc tool cc the C compiler'
  fi
  cat <<'END'
libc6-dev header stdio.h the C library's headers
meson tool meson the build
ninja-build tool ninja the build
pkg-config tool pkg-config finds libraries
libsundials-dev header sundials/sundials_config.h SUNDIALS: KINSOL and IDA
libsuitesparse-dev header klu.h SuiteSparse: the direct solver KLU
libfyaml-dev pkg-config libfyaml reads scenes
libgsl-dev pkg-config gsl root finding and dense linear algebra of the program and tests
libjansson-dev pkg-config jansson writes results as JSON
libmd-dev pkg-config libmd checksums of inputs
libsqlite3-dev pkg-config sqlite3 the databases of sweeps
libcairo2-dev pkg-config cairo pictures
zlib1g-dev pkg-config zlib unpacks meshes of VTK and packs the data of reports
gnuplot-nox tool gnuplot plots
libopenmpi-dev pkg-config mpi-c ranks of MPI
libmetis-dev header metis.h parts of a body for them
END
}

test_packages() {
  cat <<'END'
gcc tool gcc proves that one compiler has no warnings
g++ tool g++ proves that the headers are C++ too
clang tool clang proves that another has none
libclang-rt-dev sanitizer address finds errors of memory in what clang builds
lld tool ld.lld links the tests
ccache tool ccache compiles once what copies of the tree have in common
valgrind tool valgrind counts instructions
doxygen tool doxygen the C interface for the site
python3-sphinx tool sphinx-build makes the site
python3-myst-parser python myst_parser reads the pages for the site
python3-breathe python breathe brings the C interface into the site
parallel tool parallel runs the shards of a sweep
sqlite3 tool sqlite3 asks the databases of sweeps
openmpi-bin tool mpirun runs tests on several ranks
python3-mesonpy python mesonpy makes a wheel of the Python package
python3-pip python pip installs the wheel
python3-vtk9 python vtkmodules.vtkIOXML reads the frames with VTK itself
python3-pytest python pytest runs the tests of the Python package
python3-matplotlib python matplotlib draws in its examples
python3-jsonschema python jsonschema checks scenes by the JSON Schema
python3-yaml python yaml reads them for that
python3-pandas python pandas has its tables
python3-nbclient python nbclient executes its notebook
python3-ipykernel python ipykernel executes its notebook
chromium tool chromium opens reports
chromium-driver tool chromedriver drives it
END
  python_packages
}

# What the Python package needs at run time; its build needs nothing more.
python_packages() {
  cat <<'END'
python3-numpy python numpy arrays for Python
python3-cffi python cffi calls the library from Python
python3-scipy python scipy sparse matrices for Python
END
}

# install_missing LIST: installs the packages of LIST (a function that prints rows) that are missing.
install_missing() {
  if [ -n "${CC:-}" ] && ! command -v "${CC%% *}" >/dev/null 2>&1; then
    die "CC is '$CC', and there is no such command; give a C compiler or unset CC."
  fi
  missing=$(
    "$1" | while read -r package kind name why; do
      present "$package" "$kind" "$name" || printf '%s: %s\n' "$package" "$why"
    done
  )
  if [ -z "$missing" ]; then return 0; fi
  names=$(printf '%s\n' "$missing" | sed 's/:.*//' | tr '\n' ' ')
  names=${names% }
  if ! command -v apt-get >/dev/null 2>&1; then
    die "missing: $names. These are Debian's names and there is no apt-get here;" \
      "install their equivalents and start again."
  fi
  as_root=
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null 2>&1 ||
      die "missing: $names. Installing them needs root or sudo; as root: apt-get install $names"
    as_root=sudo
  fi
  printf 'Installing from Debian:\n'
  printf '%s\n' "$missing" | sed 's/^/  /'
  # If the package lists cannot be updated, the old ones may do: the installation decides.
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get -q update || true
  # shellcheck disable=SC2086
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o Dpkg::Use-Pty=0 --no-install-recommends install $names ||
    die "apt-get could not install: $names. Its own words are above;" \
      "without network, install them by hand and start again."
}

# belongs DIR: whether DIR is a build directory of this tree, configured with $CC if that is set.
belongs() {
  [ -f "$1/build.ninja" ] && python3 - "$1" "$root" "${CC:-}" <<'END' 2>/dev/null
import json, os, sys
build, root, compiler = sys.argv[1:]
source = json.load(open(build + "/meson-info/meson-info.json"))["directories"]["source"]
command = json.load(open(build + "/compile_commands.json"))[0]["command"]
right_tree = os.path.samefile(source, root)
right_compiler = not compiler or f" {compiler} " in f" {command} "
sys.exit(0 if right_tree and right_compiler else 1)
END
}

# build DIR [meson options]: configures DIR unless it is usable as it is, and compiles $targets (by default everything).
build() {
  directory=$1
  shift
  if [ -e "$directory" ] && [ ! -d "$directory/meson-private" ] &&
    [ -n "$(ls -A "$directory" 2>/dev/null)" ]; then
    die "$directory is in the way: it is not a build directory of meson; move it and start again."
  fi
  # `ninja build.ninja` only updates the configuration, and keeps options that were set by hand.
  if ! belongs "$directory" ||
    { [ $# -gt 0 ] && [ "$(cat "$directory/options" 2>/dev/null)" != "$*" ]; } ||
    ! ninja -C "$directory" build.ninja >/dev/null 2>&1; then
    rm -rf "$directory"
    meson setup "$directory" "$root" "$@" || return 1
    printf '%s\n' "$*" >"$directory/options"
  fi
  # shellcheck disable=SC2086
  ninja -C "$directory" ${targets:-}
}
