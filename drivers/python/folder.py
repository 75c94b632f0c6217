#!/usr/bin/env python3
"""folder.py: prints the folder of a prefix in which Python finds packages.

    folder.py PREFIX LIBDIR BINDIR [FOLDER]

Prints the folder (FOLDER if it is given) and the relative paths from the package in it to the folders of libraries and
programs. The folder is the first within the prefix that Python searches by itself (on Debian, dist-packages in /usr/local
and site-packages in ~/.local); if there is none, it is the usual one, which PYTHONPATH must then name."""
import os
import site
import sys


def package_folder(prefix):
    """Returns a folder of the prefix, relative to it, in which Python looks for packages."""
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
