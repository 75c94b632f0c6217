# TEST part_of=test_python_examples
"""test_install.py: the installed copy runs with the library beside it; building the package needs no Python
packages."""
import glob
import os
import shutil
import subprocess
import sys

import pytest

from flesh import _location
from conftest import TOP

BUILD = os.environ.get("BUILD", "")
ASK = """
import importlib.metadata
import flesh
print(flesh.__file__)
print(flesh._library.LIBRARY_PATH)
print(importlib.metadata.version("flesh"), flesh.__version__)
print(flesh.program("--version").stdout.split()[0] if flesh.results._location.PROGRAM else "none")
"""


def python(*arguments, **environment):
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "LD_LIBRARY_PATH")}
    return subprocess.run([sys.executable, *arguments], stdout=subprocess.PIPE, check=True, universal_newlines=True,
                          env={**kept, **environment}).stdout


@pytest.mark.skipif(not shutil.which("meson"), reason="there is no meson to install with")
def test_the_installed_copy_runs(tmp_path):
    subprocess.run(["meson", "install", "-C", BUILD, "--no-rebuild"], check=True, stdout=subprocess.DEVNULL,
                   env={**os.environ, "DESTDIR": str(tmp_path / "copy")})
    (module,) = glob.glob(str(tmp_path / "copy" / "**" / "_declarations.py"), recursive=True)
    folder = os.path.dirname(os.path.dirname(module))
    moved = tmp_path / "elsewhere"  # the copy finds its library anywhere
    shutil.move(tmp_path / "copy", moved)
    folder = folder.replace(str(tmp_path / "copy"), str(moved))
    package, library, versions, program = python("-c", ASK, PYTHONPATH=folder).splitlines()
    assert package.startswith(folder) and library.startswith(str(moved)) and os.path.exists(library)
    assert len(set(versions.split())) == 1 and program == ("flesh" if _location.PROGRAM else "none")
    said = python(os.path.join(TOP, "drivers", "python", "examples", "bar_tip.py"), PYTHONPATH=folder)
    assert said.startswith("at 0.50 s the tip is at z = -0.28")
    names = {os.path.basename(path) for path in glob.glob(os.path.join(folder, "flesh", "*"))}
    built = {os.path.basename(path) for path in glob.glob(os.path.join(BUILD, "drivers", "python", "flesh", "*.py"))}
    assert built - names == {"installed_location.py"} and "py.typed" in names


def test_another_version_of_the_library_is_refused(tmp_path):
    package = tmp_path / "flesh"
    shutil.copytree(os.path.join(BUILD, "drivers", "python", "flesh"), package)
    library = glob.glob(os.path.join(BUILD, "lib", "libflesh.so"))[0]
    declarations = (package / "_declarations.py").read_text()
    (package / "_location.py").write_text(f"LIBRARY = {library!r}\nPROGRAM = ''\n")
    assert python("-c", "import flesh; print(1)", PYTHONPATH=str(tmp_path)) == "1\n"
    (package / "_declarations.py").write_text(declarations.replace('VERSION = "', 'VERSION = "9', 1))
    tried = subprocess.run([sys.executable, "-c", "import flesh"], stderr=subprocess.PIPE, universal_newlines=True,
                           env={**os.environ, "PYTHONPATH": str(tmp_path)})
    assert tried.returncode == 1 and "ImportError: flesh: this package goes with version 9" in tried.stderr
    (package / "_location.py").write_text("LIBRARY = 'nowhere.so'\nPROGRAM = ''\n")
    tried = subprocess.run([sys.executable, "-c", "import flesh"], stderr=subprocess.PIPE, universal_newlines=True,
                           env={**os.environ, "PYTHONPATH": str(tmp_path)})
    assert "nowhere.so cannot be loaded" in tried.stderr


def test_building_takes_no_package_of_python(tmp_path):
    out = tmp_path / "_declarations.py"
    # -I -S: neither site-packages nor dist-packages nor PYTHONPATH.
    python("-I", "-S", os.path.join(TOP, "drivers", "python", "declarations.py"), str(out), str(tmp_path / "depfile"),
           os.path.join(BUILD, "include", "flesh", "sundials_abi.h"), *(os.environ.get("CC") or "cc").split(),
           f"-I{TOP}/include", f"-I{BUILD}/include")
    with open(os.path.join(BUILD, "drivers", "python", "flesh", "_declarations.py"), encoding="utf-8") as file:
        assert out.read_text() == file.read()
    assert "flesh/mesh.h" in (tmp_path / "depfile").read_text()
    folder = python("-I", "-S", os.path.join(TOP, "drivers", "python", "folder.py"), "/opt/x", "lib", "bin").split()
    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    assert folder == [f"lib/{version}/site-packages", "../../..", "../../../../bin"]
