"""package.py: Spack's recipe for flesh. Not tested: it follows other recipes of Spack, but has never been run.

    spack repo add drivers/package/spack
    spack install flesh

It builds the last commit of the tree that contains it."""
import os

from spack.package import *

TOP = os.path.abspath(os.path.join(os.path.dirname(__file__), *[".."] * 5))


class Flesh(MesonPackage):
    """Dynamics of soft, nearly incompressible bodies, driven by SUNDIALS."""

    git = f"file://{TOP}"
    license("BSD-3-Clause")
    version("main", branch="main")

    variant("mpi", default=True, description="bodies that are distributed among MPI ranks")
    variant("program", default=True, description="the program flesh, which is linked with GSL (GPL)")
    variant("python", default=False, description="the Python package")

    depends_on("c", type="build")
    depends_on("meson@1:", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("python@3.9:", type="build")  # for meson and the build's own scripts
    depends_on("sundials@6.4: +klu +IDA +KINSOL precision=double")
    depends_on("suite-sparse")
    depends_on("libfyaml")
    depends_on("zlib")
    with when("+mpi"):
        depends_on("mpi")
        depends_on("metis")
    with when("+program"):
        depends_on("gsl")
        depends_on("jansson")
        depends_on("libmd")
        depends_on("sqlite@3.38:")
        depends_on("cairo+fc")
        depends_on("gnuplot", type="run")
    with when("+python"):
        extends("python@3.9:")
        depends_on("py-numpy", type="run")
        depends_on("py-cffi", type="run")

    def meson_args(self):
        """Returns the build's options (drivers/build.md)."""
        def feature(name):
            return f"-D{name}={'enabled' if f'+{name}' in self.spec else 'disabled'}"

        def choice(name):
            return f"-D{name}={'true' if f'+{name}' in self.spec else 'false'}"

        return [f"-Dsundials={self.spec['sundials'].prefix}", f"-Dsuitesparse={self.spec['suite-sparse'].prefix}",
                feature("mpi"), choice("program"), choice("python"), "-Dtests=false"]
