#!/usr/bin/env python3
# TEST name=test_python quick program seconds=60 needs=python,cc,build,includes protocol=exitcode
# TEST name=test_python_runs full memory program seconds=120 needs=python,cc,build,includes protocol=exitcode
# TEST name=test_python_examples full program seconds=300 needs=python,cc,build,includes protocol=exitcode
# TEST name=test_python_wheel full program seconds=120 needs=python,cc,plain protocol=exitcode
"""run.py: pytest on some of the files beside this one; 77 (skipped) where Python has not what they need."""
import importlib.util
import os
import sys

MISSING = [name for name in ("cffi", "numpy", "scipy", "pytest") if importlib.util.find_spec(name) is None]
if MISSING:
    print("missing:", ", ".join(f"python3-{name}" for name in MISSING))
    sys.exit(77)

import pytest  # noqa: E402, what is missing is reported first

# A sanitizer's runtime is this interpreter's and that of interpreters that tests start: the compiler and the program go
# without. conftest.py hands it on.
if "LD_PRELOAD" in os.environ:
    os.environ["INTERPRETER_PRELOAD"] = os.environ.pop("LD_PRELOAD")

HERE = os.path.dirname(os.path.abspath(__file__))
sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", "--rootdir", HERE,
                      *(os.path.join(HERE, name) for name in sys.argv[1:])]))
