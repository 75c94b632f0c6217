"""backend.py: makes a wheel of the Python package by meson-python, which expects pyproject.toml at the top of the tree.

meson-python gets a folder of links to the top of the tree and to the pyproject.toml beside this file. pip calls these
functions."""
import contextlib
import os
import tempfile

import mesonpy

HERE = os.path.dirname(os.path.abspath(__file__))
TOP = os.path.dirname(os.path.dirname(HERE))


@contextlib.contextmanager
def _linked_tree():
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        for name in ("include", "lib", "drivers", "meson.build", "meson_options.txt", "LICENSE"):
            os.symlink(os.path.join(TOP, name), os.path.join(folder, name))
        os.symlink(os.path.join(HERE, "pyproject.toml"), os.path.join(folder, "pyproject.toml"))
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def get_requires_for_build_wheel(config_settings=None):
    """Returns the packages that meson-python needs beside itself, such as ninja."""
    with _linked_tree():
        return mesonpy.get_requires_for_build_wheel(config_settings)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Puts the wheel into the folder wheel_directory and returns its name."""
    wheel_directory = os.path.abspath(wheel_directory)
    # The folder is as deep as a build of the tree, so that relative paths to sources, and ccache's objects, are the same.
    config_settings = {"builddir": "build", **(config_settings or {})}
    with _linked_tree():
        return mesonpy.build_wheel(wheel_directory, config_settings, metadata_directory)
