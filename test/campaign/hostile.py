#!/usr/bin/env python3
"""hostile.py: hostile inputs, made from the lists below, each given to the commands that read its kind.

  FLESH=build/drivers/flesh python3 test/campaign/hostile.py            every seventh
  FLESH=build/drivers/flesh python3 test/campaign/hostile.py --full     all
  ... --only TEXT     those whose name holds TEXT, with the command and its words

What is judged of each: it ends in time and by itself (no signal), with a documented exit code, where it is refused with
the code that its kind has; a refusal is one line of printable UTF-8 on standard error; nothing is printed to a terminal
that moves its cursor; and no file appears but in the place that was asked for, and none at all where it is refused.
"""
import argparse
import os
import resource
import shutil
import signal
import stat
import subprocess
import sys
import tempfile

FLESH = os.path.realpath(os.environ.get("FLESH", "build/drivers/flesh"))
TIMEOUT = 60
REFUSED = {2, 3}
ANY = {0, 2, 3, 4, 5, 6, 7}

BOX = b"nodes 5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\ntets 2\n0 1 2 3\n1 2 3 4\n"
SQUARE = b"v 0 0 -1\nv 1 0 -1\nv 0 1 -1\nv 1 1 -1\nf 1 2 3\nf 2 4 3\n"
SCENE = """body: {mesh: %s, density: 1000, material: {energy: S, young: 1e5, poisson: 0.45}}
effects:
  - inertia: {}
  - gravity: {acceleration: [0, 0, -9.81]}
time: {method: backward-euler, step: 1/60, end: 1/60}
"""
MSH = b"$MeshFormat\n%s\n$EndMeshFormat\n"

# ---- meshes: name -> bytes; all are refused with 3
MESHES = {
    "empty": b"",
    "blank": b" \n\t\n",
    "zeros": bytes(4096),
    "noise": bytes((i * 197 + i // 7) % 256 for i in range(5000)),
    "nodes of 2^31": b"nodes 2147483648\n0 0 0\n",
    "nodes of 2^63": b"nodes 9223372036854775808\n0 0 0\n",
    "nodes of 1e30": b"nodes 1" + b"0" * 30 + b"\n0 0 0\n",
    "nodes of 400 million": b"nodes 400000000\n0 0 0\n",
    "nodes of -1": b"nodes -1\n0 0 0\n",
    "tets of 500 million": BOX.replace(b"tets 2", b"tets 500000000"),
    "nan": BOX.replace(b"1 1 1", b"nan 1 1"),
    "infinite": BOX.replace(b"1 1 1", b"1e999 1 1"),
    "huge": BOX.replace(b"1 1 1", b"1e308 -1e308 1e308"),
    "hexadecimal": BOX.replace(b"1 2 3 4", b"0x1 2 3 4"),
    "node out of range": BOX.replace(b"1 2 3 4", b"1 2 3 5"),
    "node of -1": BOX.replace(b"1 2 3 4", b"1 2 3 -1"),
    "a node twice": BOX.replace(b"1 2 3 4", b"1 2 3 3"),
    "a tet twice": BOX.replace(b"1 2 3 4", b"0 1 2 3"),
    "flat": BOX.replace(b"1 1 1", b"1 0 0"),
    "split, no more": b"flesh-split-mesh 3\n",
    "split of version 99": b"flesh-split-mesh 99\n",
    "split, parts that are not there": b"flesh-split-mesh 3\nmark 1\norder 1\nnodes 8\ntets 6\nregions 1\n0\nsets 0\nparts 1\n6 6 8 0\n",
    "split, a huge part": b"flesh-split-mesh 3\nmark 1\norder 1\nnodes 700000000\ntets 500000000\nregions 1\n0\nsets 0\nparts 1\n"
                          b"500000000 500000000 700000000 0\n",
    "split, 2^31 parts": b"flesh-split-mesh 3\nmark 1\norder 1\nnodes 8\ntets 6\nregions 1\n0\nsets 0\nparts 2147483648\n",
    "split, a mark of 2^64": b"flesh-split-mesh 3\nmark 18446744073709551616\n",
    "control characters": b"\x1b[2J\x07\x08\x1b]0;title\x07\n",
    "invalid UTF-8": b"\xff\xfe\xc3(\xed\xa0\x80\n",
    "a line of 10 MB": b"nodes " + b"9" * 10_000_000,
    "a word of 10 MB": b"q" * 10_000_000,
    "a comment of 10 MB": b"#" * 10_000_000,
    "a million lines": b"\n" * 1_000_000,
    "gmsh, no more": MSH % b"4.1 0 8",
    "gmsh of version 99": MSH % b"99 0 8",
    "gmsh of a size of 3": MSH % b"4.1 0 3",
    "gmsh of no number": MSH % b"\xff\xff\xff",
    "gmsh 2, 2^31 nodes": (MSH % b"2.2 0 8") + b"$Nodes\n2147483647\n1 0 0 0\n$EndNodes\n",
    "gmsh 2, negative count": (MSH % b"2.2 0 8") + b"$Nodes\n-5\n$EndNodes\n",
    "gmsh 4, 2^62 blocks": (MSH % b"4.1 0 8") + b"$Nodes\n4611686018427387904 4611686018427387904 1 4\n",
    "gmsh 4, blocks that disagree": (MSH % b"4.1 0 8") + b"$Nodes\n1 5 1 5\n3 1 0 4000000000\n1\n$EndNodes\n",
    "gmsh 4 binary, cut": (MSH % b"4.1 1 8")[:22] + b"\1\0\0\0\n$EndMeshFormat\n$Nodes\n" + b"\xff" * 40,
    "gmsh 2 binary, cut": (MSH % b"2.2 1 8")[:22] + b"\1\0\0\0\n$EndMeshFormat\n$Nodes\n4\n" + b"\x7f" * 11,
    "gmsh, sections within sections": (MSH % b"4.1 0 8") + b"$Nodes\n" * 10000,
    "gmsh, endless section": (MSH % b"4.1 0 8") + b"$Comments\n" + b"x\n" * 100000,
    "medit, no more": b"MeshVersionFormatted 2\n",
    "medit, 2^31 vertices": b"MeshVersionFormatted 2\nDimension 3\nVertices 2147483647\n0 0 0 0\n",
    "medit, dimension 4": b"MeshVersionFormatted 2\nDimension 4\nVertices 1\n0 0 0 0 0\n",
    "medit, twice": b"MeshVersionFormatted 2\nDimension 3\nVertices 1\n0 0 0 0\nVertices 1\n0 0 0 0\n",
    "vtk": b"<VTKFile type=\"UnstructuredGrid\"></VTKFile>\n",
}
# ---- surfaces: all are refused with 3
PLY = b"ply\nformat %s 1.0\nelement vertex %s\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n" \
      b"property list uchar int vertex_indices\nend_header\n"
SURFACES = {
    "empty": b"",
    "noise": MESHES["noise"],
    "zeros": bytes(4096),
    "a face of no vertex": b"v 0 0 0\nf 1 2 3\n",
    "a face of 0": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
    "a face of -9": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 1 2\n",
    "a face of 2^63": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9223372036854775807\n",
    "a face of 20000 corners": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf" + b" 1 2 3" * 20000 + b"\n",
    "nan": b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "infinite": b"v 1e999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "joined lines without end": b"v 0 0 0 \\\n" * 100000,
    "a line of 10 MB": b"f " + b"1" * 10_000_000,
    "control characters": b"\x1b[2J 1 2 3\n",
    "ply of nothing": b"ply\n",
    "ply of another format": PLY % (b"\x1b[31m", b"3"),
    "ply, 500 million vertices": PLY % (b"ascii", b"500000000") + b"0 0 0\n",
    "ply, -1 vertices": PLY % (b"ascii", b"-1"),
    "ply binary, cut": PLY % (b"binary_little_endian", b"3") + b"\0" * 30,
    "ply binary, a list of 255": PLY % (b"binary_big_endian", b"1") + b"\0" * 12 + b"\xff" * 1000,
    "ply, faces twice": (PLY % (b"binary_little_endian", b"3")).replace(
        b"element face 1\n", b"element face 1\nproperty int vertex_index\nelement face 1\n") + b"\0" * 60,
    "ply, a type of no name": b"ply\nformat ascii 1.0\nelement vertex 1\nproperty \xff\xff x\nend_header\n",
    "ply, 10000 elements": b"ply\nformat ascii 1.0\n" + b"element e 0\n" * 10000 + b"end_header\n",
    "ply, 10000 properties": b"ply\nformat ascii 1.0\nelement e 1\n" + b"property int p\n" * 10000 + b"end_header\n",
    "ply, no end": b"ply\nformat ascii 1.0\n" + b"comment x\n" * 100000,
}
# ---- states of five nodes: all are refused with 3
ROW = b"0 0 0 0 0 0\n"
STATES = {
    "empty": b"", "noise": MESHES["noise"], "too few rows": ROW * 4, "too many rows": ROW * 6,
    "nan": b"nan" + ROW[1:] + ROW * 4, "infinite": b"1e999" + ROW[1:] + ROW * 4, "a time of nan": b"# t nan\n" + ROW * 5,
    "a time of words": b"# t soon\n" + ROW * 5, "a row of 5": ROW * 4 + b"0 0 0 0 0\n", "a row of 7": ROW * 4 + b"0 " + ROW,
    "control characters": b"\x1b[2J\n" + ROW * 5, "a line of 10 MB": b"0" * 10_000_000,
}
# ---- bindings: all are refused with 3
BINDINGS = {
    "empty": b"", "noise": MESHES["noise"], "another version": b"flesh skin 99999999999999999999\n",
    "another mesh": b"flesh skin 1\nmesh 9 9 0000000000000000\nsurface 4 2 0000000000000000\n",
    "control characters": b"flesh skin \x1b[2J\n", "a line of 10 MB": b"flesh skin " + b"1" * 10_000_000,
}
# ---- scenes and specs as text: refused with 2 wherever YAML is read
def bombs():
    levels = "".join(f"l{k}: &l{k} [{', '.join(['*l%d' % (k - 1)] * 9)}]\n" for k in range(1, 12))
    return ("l0: &l0 [1, 2, 3, 4, 5, 6, 7, 8, 9]\n" + levels).encode()


TEXTS = {
    "empty": b"", "blank": b"\n \n", "noise": MESHES["noise"], "zeros": bytes(100), "a number": b"42\n", "a list": b"- 1\n",
    "deep lists": b"body: " + b"[" * 100000, "deep mappings": b"{a: " * 100000, "deep blocks": b"".join(
        b" " * k + b"a:\n" for k in range(2000)), "deep brackets that close": b"body: " + b"[" * 5000 + b"]" * 5000,
    "aliases of aliases": bombs(), "an alias of itself": b"body: &a [*a]\n", "an anchor that is missing": b"body: *nowhere\n",
    "a key of 10 MB": b"k" * 10_000_000 + b": 1\n", "a value of 10 MB": b"body: " + b"v" * 10_000_000 + b"\n",
    "100000 keys": b"".join(b"k%d: 1\n" % k for k in range(100000)), "a key twice": b"body: 1\nbody: 2\n",
    "two documents": b"--- {}\n--- {}\n", "tabs": b"body:\n\tmesh: mesh\n", "no end of quotes": b"body: \"mesh\n",
    "no end of a mapping": b"body: {mesh: mesh\n", "a directive": b"%YAML 9.9\n---\nbody: 1\n", "a tag": b"body: !!python/x {}\n",
    "UTF-16": "body: {mesh: mesh}\n".encode("utf-16"), "invalid UTF-8": b"body: {mesh: \xff\xfe}\n",
    "overlong UTF-8": b"body: {mesh: \xc0\xaf}\n", "surrogates": b"body: {mesh: \xed\xa0\x80}\n",
    "control characters": b"body: {mesh: \x1b[2J}\n", "escaped control characters": b'"\\e[2J\\n\\x7f": {mesh: "\\e[2J"}\n',
    "escaped zero": b'body: {mesh: "a\\0b"}\n', "a merge key": b"<<: {body: 1}\n", "a null": b"null\n", "a carriage return": b"body\r: 1\n",
}
# ---- values of a scene's keys: refused with 2 unless the key has them
VALUES = ["nan", ".nan", "inf", ".inf", "-.inf", "1e400", "-1e400", "1e-400", "-1", "1/0", "0x10", "1e308", "''", "[]", "{}",
          "[[[[1]]]]", "true", "9" * 400, "1" + "0" * 100000, "1e99999999999999999999", "--1", "1_000", "\x1b[2J",
          "\udcff\udcfe", "~", "1;touch pwned", "$(touch pwned)"]
KEYS = {
    "body.density": {"1e308", "~"}, "body.material.poisson": {"1e-400"}, "time.step": {"1e308", "~"},
    "time.end": {"1e308", "~", "1e-400"}, "solver.threads": {"~", "1e-400"}, "solver.newton_tolerance": {"~"},
    "output.frame_interval": {"~", "1e-400"},
    "effects.gravity.acceleration[0]": {"-1", "1e308", "1e-400"}, "start.velocity": {"~"}, "effects.inertia": {"{}", "~"},
}
# ---- special files, for everything that reads one
SPECIAL = ["missing", "pipe", "directory", "socket", "loop", "dangling", "empty", "unreadable", "/dev/zero", "/dev/null",
           "/dev/full", "/dev/tty", "long", "sparse", "folder/none", "mesh/below"]
READERS = {  # %s: the file
    "mesh info": ["mesh", "info", "%s"], "mesh convert": ["mesh", "convert", "%s", "new.msh"],
    "mesh surface": ["mesh", "surface", "%s", "new.obj"], "run": ["run", "%s", "--out", "new"],
    "check": ["check", "%s"], "a scene's mesh": ["check", "good.yaml", "--set", "body.mesh=%s"],
    "a contact's mesh": ["check", "good.yaml", "--set", "effects.contact={mesh: '%s'}"],
    "a scene's state": ["check", "good.yaml", "--set", "start.state=%s"],
    "a scene's skin": ["run", "good.yaml", "--set", "output.skin.surface=%s", "--out", "new"],
    "--start-state": ["run", "good.yaml", "--start-state", "%s", "--out", "new"],
    "skin bind, mesh": ["skin", "bind", "%s", "tri.obj", "--out", "new.txt"],
    "skin bind, surface": ["skin", "bind", "mesh", "%s", "--out", "new.txt"],
    "skin apply": ["skin", "apply", "%s", "tri.obj", "run", "--out", "new"], "snap": ["snap", "%s", "--out", "new.png"],
    "film": ["film", "%s", "--out", "new"], "sweep": ["sweep", "%s", "--out", "new"],
    "sweep export": ["sweep", "export", "%s", "--out", "new.csv"], "sweep merge": ["sweep", "merge", "new.db", "%s"],
    "sweep plot": ["sweep", "plot", "%s", "--x", "nu", "--y", "newton", "--out", "new.png"],
    "drift": ["drift", "%s", "--out", "new"], "accuracy": ["accuracy", "%s", "--out", "new"],
}
# ---- names of files that are written, and of what is drawn
NAMES = ["a'b", 'a"b', "$(touch pwned)", "`touch pwned`", "; touch pwned;", "|touch pwned;#", "a\nb", "a\tb", "a\x1b[2J", "-x",
         "--help", "%s%n%d", "a b", "& touch pwned &", "<mesh", ">pwned", "@a{b}^c_d", "\\\\", "'; system('touch pwned'); #",
         "+'; system(\"touch pwned\"); #", "\u00fcber", "\udcff\udcfe", "x" * 300, "*", "[a]", "~", "a:b", "file:///etc/x",
         "concat:mesh", "set term dumb", "a\r\nb"]
WRITERS = {  # %s: the name
    "run": (["run", "good.yaml", "--quiet", "--out", "./%s"], ""), "material": (["material", "--energies", "S", "--out", "./%s"], ""),
    "snap": (["snap", "run", "--out", "./%s.png"], ".png"), "film": (["film", "run", "--out", "./%s.mp4", "--width", "64"], ".mp4"),
    "sweep plot": (["sweep", "plot", "sweep/sweep.db", "--x", "nu", "--y", "newton", "--out", "./%s.png"], ".png"),
    "sweep export": (["sweep", "export", "sweep/sweep.db", "--out", "./%s.csv"], ".csv"),
    "mesh box": (["mesh", "box", "--cells", "1,1,1", "--size", "1,1,1", "--out", "./%s.msh"], ".msh"),
    "skin bind": (["skin", "bind", "mesh", "tri.obj", "--out", "./%s"], ""),
}
# ---- words of the command line: all are refused with 2
WORDS = ["", " ", "0", "-1", "nan", "inf", "1e400", "1e-400", "99999999999999999999", "0x1", "1/0", "1,,2", ",", "1,2,3,4,5,6,7,8",
         "\x1b[2J", "\udcff", "9" * 100000, "-", "--", "%s%n"]
OPTIONS = {  # and the words among them that are good
    "run --max-seconds": (["run", "good.yaml", "--out", "new", "--quiet", "--max-seconds"], {"9" * 100000, "99999999999999999999", "0x1"}),
    "run --method": (["run", "good.yaml", "--out", "new", "--method"], set()),
    "sweep --jobs": (["sweep", "spec.yaml", "--out", "new", "--quiet", "--jobs"], {"0x1"}),
    "sweep --shard": (["sweep", "spec.yaml", "--out", "new", "--shard"], set()),
    "mesh box --cells": (["mesh", "box", "--size", "1,1,1", "--out", "new.msh", "--cells"], set()),
    "mesh box --size": (["mesh", "box", "--cells", "1,1,1", "--out", "new.msh", "--size"], set()),
    "snap --frame": (["snap", "run", "--out", "new.png", "--frame"], {"0", "0x1", "1e-400"}),
    "snap --width": (["snap", "run", "--out", "new.png", "--width"], set()),
    "snap --camera": (["snap", "run", "--out", "new.png", "--camera"], set()),
    "film --fps": (["film", "run", "--out", "new", "--width", "64", "--fps"], {"0x1", "99999999999999999999"}),
    "drift --poisson": (["drift", "good.yaml", "--out", "new", "--poisson"], {"0", "1e-400"}),
    "accuracy --steps": (["accuracy", "good.yaml", "--out", "new", "--steps"], {"0x1", "99999999999999999999"}),
    "hardcases --cases": (["hardcases", "--out", "new", "--cases"], set()),
    "bench --cells": (["bench", "--out", "new", "--cells"], set()),
    "skin --formats": (["skin", "apply", "binding.txt", "tri.obj", "run", "--out", "new", "--formats"], set()),
    "schema": (["schema"], {"", "--"}),
}


class Campaign:
    def __init__(self, folder, everything, only):
        self.folder, self.everything, self.only = folder, everything, only
        self.number = self.tried = 0
        self.faults = []
        self.user = 65534 if os.geteuid() == 0 else None  # nobody, whom permissions hold back
        self.make_files()

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, content):
        with open(self.path(name), "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())

    def flesh(self, *words):
        done = subprocess.run([FLESH, *words], cwd=self.folder, capture_output=True, timeout=TIMEOUT, check=False)
        if done.returncode:
            sys.exit(f"flesh {' '.join(words)}: {done.stderr.decode()}")

    def make_files(self):
        self.write("mesh", BOX)
        self.write("tri.obj", SQUARE)
        self.write("good.yaml", SCENE % "mesh")
        self.write("spec.yaml", "scene: good.yaml\naxes: [{key: body.material.poisson, name: nu, values: [0.3, 0.4]}]\n")
        self.flesh("run", "good.yaml", "--out", "run", "--quiet")
        self.flesh("sweep", "spec.yaml", "--out", "sweep", "--quiet")
        self.flesh("skin", "bind", "mesh", "tri.obj", "--out", "binding.txt")
        os.mkfifo(self.path("pipe"))
        for name in "directory", "folder":
            os.mkdir(self.path(name))
        os.mknod(self.path("socket"), 0o600 | stat.S_IFSOCK)
        os.symlink("loop", self.path("loop"))
        os.symlink("nowhere", self.path("dangling"))
        self.write("empty", b"")
        self.write("unreadable", BOX)
        with open(self.path("sparse"), "wb") as file:
            file.truncate(1 << 40)
        if self.user:
            for top, folders, files in os.walk(self.folder):
                for name in [".", *folders, *files]:
                    os.chown(os.path.join(top, name), self.user, self.user, follow_symlinks=False)
        os.chmod(self.path("unreadable"), 0)

    def listing(self):
        """Returns the files that exist, and data that would show whether they were written to."""
        found = {}
        for top, folders, files in os.walk(os.fsencode(self.folder)):
            for name in folders + files:
                path = os.path.join(top, name)
                info = os.lstat(path)
                is_folder = stat.S_ISDIR(info.st_mode)
                found[path[len(self.folder) + 1:]] = None if is_folder else (info.st_size, info.st_mtime_ns)
        return found

    def limits(self):
        resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
        resource.setrlimit(resource.RLIMIT_CPU, (TIMEOUT, TIMEOUT))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def attempt(self, name, words, expected, place=None):
        """`place`: where files may appear, if the command succeeds or ends half-way; None: nowhere."""
        self.number += 1
        chosen = self.only in name if self.only else self.everything or self.number % 7 == 1
        if not chosen:
            return
        self.tried += 1
        words = [os.fsencode(word) for word in words]
        before = self.listing()
        process = subprocess.Popen([os.fsencode(FLESH), *words], cwd=self.folder, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
                                   preexec_fn=self.limits, user=self.user, group=self.user,
                                   env={**os.environ, "HOME": self.folder, "TMPDIR": self.folder})
        fault = []
        try:
            out, err = process.communicate(timeout=TIMEOUT)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            out, err = process.communicate()
            fault.append(f"does not end in {TIMEOUT} s")
        code = process.returncode
        if code < 0 and not fault:
            fault.append(f"ends by signal {-code}")
        elif code not in expected and not fault:
            fault.append(f"ends with {code}, not {' or '.join(map(str, sorted(expected)))}")
        if code > 0:
            text = err.decode("utf-8", "replace")
            lines = text.rstrip("\n").split("\n")
            # `check` tells what it found wrong in its table, on standard output.
            in_table = not text and out and words[0] == b"check"
            if not in_table and (not text.endswith("\n") or len(lines) != 1 or len(lines[0]) > 1100):
                fault.append(f"its words are {len(lines)} lines, {len(text)} characters")
            if "\ufffd" in text or any(ord(c) < 32 or 127 <= ord(c) < 160 for c in lines[0]):
                fault.append("its words are not printable")
        asked = b"".join(words)  # what was asked for may be named
        if any((c < 32 and c not in b"\n\t" or c == 127) and c not in asked for c in out):
            fault.append("control characters on standard output")
        after = self.listing()
        new = [path for path in after if path not in before or after[path] != before[path]]
        refused = code in REFUSED
        allowed = []
        if place is not None:
            first = os.fsencode(place).split(b"/")[0]
            # A plot's script, data and words of gnuplot, and a film's pictures, stay where the drawing fails.
            beside = first.rsplit(b".", 1)[0]
            drawn = [beside + end for end in (b".gp", b".dat", b".log", b"_frames")]
            half = code == 3 and (b"gnuplot failed" in err or b"ffmpeg" in err)
            allowed = drawn + [first] * (b"/" in os.fsencode(place)) if half else [] if refused else [first, *drawn]
        for path in new:
            if path.split(b"/")[0] not in allowed:
                fault.append(f"{os.fsdecode(path)!r} has appeared or changed")
        for path in before:
            if path not in after:
                fault.append(f"{os.fsdecode(path)!r} is gone")
        self.clean(new, before)
        if self.only or fault:
            print(f"{'FAULT' if fault else 'fine'}: {name}: {'; '.join(fault)}")
            shown = " ".join(repr(os.fsdecode(word[:120])) for word in words)
            print(f"    flesh {shown}: {code}\n    {err[:300].decode('utf-8', 'replace')!r}", flush=True)
        if fault:
            self.faults.append(name)

    def clean(self, new, before):
        for path in sorted(new, key=len):
            full = os.path.join(os.fsencode(self.folder), path)
            if path in before or not os.path.lexists(full):
                continue
            if os.path.isdir(full) and not os.path.islink(full):
                shutil.rmtree(full)
            else:
                os.unlink(full)

    def with_content(self, kind, contents, commands, expected):
        for name, content in contents.items():
            self.write("hostile", content)
            for command in commands:
                self.attempt(f"{kind} {name}: {command}", [w.replace("%s", "hostile") for w in READERS[command]], expected, "new")
        self.write("hostile", b"")

    def all(self):
        self.write("hostile", b"")
        self.with_content("mesh", MESHES, ["mesh info", "a scene's mesh"], {3})
        self.with_content("surface", SURFACES, ["skin bind, surface", "a scene's skin"], {3})
        self.with_content("state", STATES, ["--start-state"], {3})
        self.with_content("binding", BINDINGS, ["skin apply"], {3})
        self.with_content("text", TEXTS, ["check", "sweep"], {2})
        for key, good in KEYS.items():
            for value in VALUES:
                expected = {0, 2, 4, 5, 7} if value in good else {2}
                self.attempt(f"value {key}={value[:20]!r}", ["check", "good.yaml", "--set", f"{key}={value}"], expected)
        for special in SPECIAL:
            path = "l" * 5000 if special == "long" else special
            for reader, words in READERS.items():
                self.attempt(f"special {special}: {reader}", [w.replace("%s", path) for w in words], {2, 3} | ({1} if special == "sparse" else set()), "new")
        for name in NAMES:
            for writer, (words, suffix) in WRITERS.items():
                self.attempt(f"name {name[:30]!r}: {writer}", [w.replace("%s", name) for w in words], {0, 2, 3}, os.path.normpath(name + suffix))
        for option, (words, good) in OPTIONS.items():
            for word in WORDS:
                place = "new.png" if "snap" in option else "new.msh" if "box" in option else "new"
                self.attempt(f"word {option} {word[:20]!r}", [*words, word], {0, 2, 3, 4, 6} if word in good else {2}, place)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    folder = tempfile.mkdtemp(prefix="flesh-hostile-", dir=os.environ.get("TMPDIR", "/dev/shm"))
    os.chmod(folder, 0o755)
    try:
        campaign = Campaign(folder, options.full, options.only)
        campaign.all()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print(f"{campaign.tried} of {campaign.number} hostile inputs, {len(campaign.faults)} faults")
    return 1 if campaign.faults or not campaign.tried else 0


if __name__ == "__main__":
    sys.exit(main())
