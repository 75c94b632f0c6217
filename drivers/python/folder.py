#!/usr/bin/env python3
"""folder.py: where in a prefix Python finds a package, as far as it looks there at all.

    folder.py PREFIX LIBDIR BINDIR [FOLDER]

Prints the folder (FOLDER where one is given) and the ways from the package in it to the folders of libraries
and programs. Python looks
into folders of its own choice: of those within the prefix the first is taken (on Debian /usr/local has dist-packages,
~/.local has site-packages); where there is none, the usual one, which PYTHONPATH then has to name."""
import os
import site
import sys


def package_folder(prefix):
    """A folder of the prefix in which Python looks for packages."""
    looked_into = [*site.getsitepackages(), site.getusersitepackages()]
    for folder in looked_into:
        if os.path.commonpath([os.path.normpath(prefix), os.path.normpath(folder)]) == os.path.normpath(prefix) and \
                not (prefix == "/usr" and folder.startswith("/usr/local")):
            return os.path.relpath(folder, prefix)
    return f"lib/python{sys.version_info[0]}.{sys.version_info[1]}/site-packages"


def main(prefix, libdir, bindir, folder=""):
    folder = folder or package_folder(prefix)
    print(folder)
    for other in (libdir, bindir):
        print(os.path.relpath(os.path.join(prefix, other), os.path.join(prefix, folder, "flesh")))


if __name__ == "__main__":
    main(*sys.argv[1:])
