#!/usr/bin/env python3
"""declarations.py: the C declarations of the public headers, as cffi reads them.

    declarations.py OUT DEPFILE ABI_HEADER COMPILER [ARGUMENT...]

The compiler preprocesses all public headers with its own arguments, and the lines from include/flesh are kept: Python
knows every struct, enum and function of the library from the headers themselves, not from a copy. SUNDIALS' types, to
which the callback layer's functions take only pointers, and its few functions that make vectors, matrices and a context
are declared here. Writes the Python module OUT, and the files that it depends on into DEPFILE. Needs only Python
itself."""
import os
import re
import subprocess
import sys
import tempfile

# Types of SUNDIALS that the callback layer's headers name: numbers, and pointers to opaque structs.
SUNDIALS_TYPES = """
typedef double sunrealtype;
typedef int{index}_t sunindextype;
typedef int booleantype;
typedef int sunbooleantype;
typedef struct SUNContext_ *SUNContext;
typedef struct _generic_N_Vector *N_Vector;
typedef struct _generic_SUNMatrix *SUNMatrix;
typedef struct _generic_SUNLinearSolver *SUNLinearSolver;
typedef struct _generic_SUNNonlinearSolver *SUNNonlinearSolver;
"""

# Functions of the SUNDIALS that libflesh is linked with (whose communicator is an integer or a pointer), and C's free for
# memory that the library hands over.
OTHER_FUNCTIONS = """
void free(void *memory);
int SUNContext_Create(void *communicator, SUNContext *context);
int SUNContext_Free(SUNContext *context);
N_Vector N_VMake_Serial(sunindextype length, double *values, SUNContext context);
void N_VDestroy(N_Vector vector);
SUNMatrix SUNSparseMatrix(sunindextype rows, sunindextype columns, sunindextype entries, int type, SUNContext context);
sunindextype *SUNSparseMatrix_IndexValues(SUNMatrix matrix);
sunindextype *SUNSparseMatrix_IndexPointers(SUNMatrix matrix);
double *SUNSparseMatrix_Data(SUNMatrix matrix);
void SUNMatDestroy(SUNMatrix matrix);
"""

HEADERS = ("flesh.h", "kinsol.h", "ida.h", "ode.h", "sunnonlinsol.h")

# Stand-ins for SUNDIALS' headers, so that its types stay opaque and MPI need not be found.
SUNDIALS_CONFIG = """
#define SUNDIALS_VERSION_MAJOR {major}
#define SUNDIALS_VERSION_MINOR {minor}
#define SUNDIALS_DOUBLE_PRECISION
#define SUNDIALS_INT{index}_T
#define SUNDIALS_MPI_ENABLED {mpi}
"""
SUNDIALS_HEADERS = ("linearsolver", "nonlinearsolver", "matrix", "nvector", "types", "version", "context")


def defined(header):
    """Returns the macros of a header whose values are numbers or strings, as a dict of strings."""
    with open(header, encoding="utf-8") as file:
        return dict(re.findall(r"^#define (\w+) ([\w\".]+)", file.read(), re.M))


def preprocess(compiler, values, out, depfile):
    """Returns the preprocessed text of the public headers, without the headers that they include from elsewhere."""
    source = "".join(f"#include <flesh/{name}>\n" for name in HEADERS)
    with tempfile.TemporaryDirectory() as folder:
        os.mkdir(os.path.join(folder, "sundials"))
        for name in ("config", *SUNDIALS_HEADERS):
            with open(os.path.join(folder, "sundials", f"sundials_{name}.h"), "w", encoding="utf-8") as file:
                if name == "config":
                    file.write(SUNDIALS_CONFIG.format(**values))
        # As system headers, the stand-ins are not among the dependencies.
        text = subprocess.run([*compiler, "-isystem", folder, "-E", "-MMD", "-MF", depfile, "-MT", out, "-x", "c", "-"],
                              input=source, stdout=subprocess.PIPE, check=True, universal_newlines=True).stdout
    kept, ours = [], False
    for line in text.splitlines():
        marker = re.match(r'# \d+ "(.*)"', line)
        if marker:
            ours = os.path.basename(os.path.dirname(marker.group(1))) == "flesh"
        elif ours and line.strip():
            kept.append(line)
    text = re.sub(r'__attribute__\s*\(\(\w+(\("\w+"\))?\)\)\s*', "", "\n".join(kept))
    return re.sub(r"\n{2,}", "\n", text)


def main(out, depfile, abi_header, *compiler):
    abi = defined(abi_header)
    values = {key: abi[f"FLESH_SUNDIALS_{name}"] for key, name in
              {"major": "VERSION_MAJOR", "minor": "VERSION_MINOR", "index": "INDEX_SIZE", "mpi": "MPI"}.items()}
    include = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "include", "flesh")
    version = defined(os.path.join(include, "version.h"))["FLESH_VERSION_STRING"]
    text = preprocess(compiler, values, out, depfile)
    with open(out, "w", encoding="utf-8") as file:
        file.write('"""The public headers of flesh in C, made by declarations.py when the library was built."""\n')
        file.write(f"VERSION = {version}\n")
        file.write(f"SUNDIALS_VERSION = {abi['FLESH_SUNDIALS_VERSION']}\n")
        file.write(f"COMMUNICATOR_OF_MPI = {values['mpi'] == '1' and int(values['major']) >= 7}\n")
        file.write(f'HEADERS = r"""{SUNDIALS_TYPES.format(index=values["index"])}{text}\n"""\n')
        file.write(f'OTHERS = r"""{OTHER_FUNCTIONS}"""\n')


if __name__ == "__main__":
    main(*sys.argv[1:])
