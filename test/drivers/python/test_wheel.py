# TEST part_of=test_python_wheel
"""test_wheel.py: pip builds a wheel of the package with meson-python, and the installed package runs in an
environment."""
import importlib.util
import os
import re
import subprocess
import sys
import zipfile

import pytest

import flesh
from conftest import TOP

if importlib.util.find_spec("mesonpy") is None or importlib.util.find_spec("pip") is None:
    pytest.skip("python3-mesonpy or python3-pip is not installed", allow_module_level=True)


def run(*words, **options):
    """Returns what a command prints, without this package in its path."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "LD_LIBRARY_PATH")}
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False,
                          env={**kept, "PIP_NO_INDEX": "1", "PYTHONDONTWRITEBYTECODE": "1"}, **options)
    assert done.returncode == 0, done.stdout[-4000:]
    return done.stdout


def test_a_wheel_in_an_environment(tmp_path):
    run(sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", "-w", str(tmp_path),
        os.path.join(TOP, "drivers", "python"))
    (wheel,) = tmp_path.glob("*.whl")
    assert re.fullmatch(rf"flesh-{re.escape(flesh.__version__)}-cp\d+-cp\d+-linux_\w+\.whl", wheel.name)
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        words = archive.read(f"flesh-{flesh.__version__}.dist-info/METADATA").decode()
    # The modules as in the build folder, with the library beside them, and nothing else: no archive, no header.
    modules = {name for name in os.listdir(os.path.dirname(flesh.__file__)) if re.search(r"\.py$|^py\.typed$", name)}
    library = f"libflesh.so.{flesh.__version__}"
    told = {f"flesh-{flesh.__version__}.dist-info/{name}" for name in ("METADATA", "WHEEL", "RECORD")}
    licence = {name for name in names if name.endswith("/LICENSE")}
    assert set(names) == {f"flesh/{name}" for name in modules - {"installed_location.py"} | {library}} | told | licence
    assert licence and "Requires-Dist: numpy" in words and "Requires-Dist: cffi" in words

    environment = tmp_path / "environment"
    run(sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", str(environment))
    python = str(environment / "bin" / "python")
    # A copy installed elsewhere by the user would satisfy pip.
    run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--ignore-installed", str(wheel))
    place = run(python, "-c", "import flesh; print(flesh._library.LIBRARY_PATH)", cwd=tmp_path).strip()
    assert place.startswith(str(environment)) and place.endswith(f"/flesh/{library}")
    said = run(python, os.path.join(TOP, "drivers", "python", "examples", "bar_tip.py"), cwd=tmp_path)
    assert said.startswith("at 0.50 s the tip is at z = -0.28")
    said = run(python, "-c", "import flesh\ntry: flesh.program('run')\nexcept flesh.FileError as error: print(error)",
               cwd=tmp_path)
    assert "a wheel has no program" in said
