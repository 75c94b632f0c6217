#!/usr/bin/env python3
"""scaling.py: a model of one body on up to 4096 ranks, and what of it can be checked here.

  python3 test/campaign/scaling.py                   the tables of data/results/scaling.md
  python3 test/campaign/scaling.py --alpha 5e-6 --beta 1e-9    another network: seconds a message, seconds a byte
  python3 test/campaign/scaling.py --page data/results/scaling.md          whether the page has them
  python3 test/campaign/scaling.py --run 55 2 5 68   seconds of 5 Newton and 68 linear iterations, 55 cells, 2 ranks
  ... | python3 test/campaign/scaling.py --check     what `mpirun -n N build/test/scaling CELLS` prints, against the model

A cube of c cells an edge, six tets each, in statics; every rank has a processor, 16 MB of cache and a channel to memory
of its own. The constants below have the assumptions. --check: messages, bytes and reductions of an iteration are
to be exactly those that the model makes of a rank's nodes; and the nodes that ranks exchange, on average, within a fifth
of the model's (0.8 to 1.25). Exit status 1 where they are not.
"""
import argparse
import math
import re
import sys

NS, MS = 1e-9, 1e-3
# ---- measured: seconds a tet by `flesh bench --cases kernels --poisson 0.45`, AMD EPYC Zen 5, one thread, with `--cells
# 48x13x13`, which fits into a cache of 16 MB, and `--cells 110x39x39`, which does not (14 GB/s from memory)
FORCE, ENERGY, HESSIAN = (10.2 * NS, 19.7 * NS), (5.7 * NS, 13.2 * NS), (33 * NS, 51.7 * NS)
FACTOR, SOLVE = (170 * NS, 200 * NS), (3.1 * NS, 5.7 * NS)  # incomplete Cholesky without the coarse level
PRODUCT, VECTORS = (2.15 * NS, 11.2 * NS), (0.7 * NS, 2.8 * NS)
ASSEMBLY = (42 * NS, 42 * NS)  # of the coarse level's matrix
RESIDENT, CACHE = 250, 16e6  # bytes per tet in an iteration; of a cache
# The coarse level's factor by `build/test/coarse_work_avx512 3 4 6 8 10 12`: vertices, blocks, seconds of factor and solve
COARSE = [(108, 188, 0.156 * MS, 0.00489 * MS), (256, 836, 0.954 * MS, 0.0172 * MS), (864, 6041, 15.2 * MS, 0.119 * MS), (2048, 24417, 170 * MS, 0.592 * MS), (4000, 73648, 1130 * MS, 4.6 * MS),
          (6912, 173788, 4110 * MS, 12.2 * MS)]
# Iterations to 1e-4 at nu = 0.45 are (nodes / vertices)^(1/3) times this: 3.4 on cubes with
# one vertex (41 to 166 iterations, 12 to 48 cells) and with 78 nodes to one (15). On several ranks as many more (a cube of
# 48 000 tets, `build/test/ranks 20 20 20`, on one rank and eight)
PER_ROOT, CUT = 3.4, 61 / 54
OWN_PER_ROOT = 10  # with own levels, times the root: 8.9 to 11.1 on 8 ranks with edges of 5 to 25

# ---- the program: what an iteration of conjugate gradients exchanges
SUMS = 16    # numbers in its only reduction (linear/pcg_team.c), before those of the coarse level
ROOM = 1024  # largest number of values in a message of a reduction
MOST = 16384 # vertices of the coarse level
VERTEX_NODES, MANY, SAME, TENFOLD, POWER, FEW = 50, 36000, 42, 95, 0.36, 1600 # linear/preconditioner_kinds.c

# ---- geometry of parts by planes (mpirun -n 2 to 64 build/test/scaling): against cubes; and for many ranks
ROUGH, REACH, GIVEN = 1.1, 3.2, 5  # over a rank's ghosts: factor for its own, its overlap, and its nodes in others' overlaps
NEIGHBOURS = 26  # of 64 ranks 15 on average, 26 at most

# ---- a network: 40 Gb/s Ethernet by Cisco VIC 1285 with usNIC, Open MPI 1.8.1: 1.93 us, 37.23 Gb/s (J. Squyres 2014)
ALPHA, BETA = 1.93e-6, 8 / 37.23e9


def hops(ranks, rank=0):
    """Returns the messages that a rank sends in a sum over all ranks, by recursive doubling."""
    most = 1 << (ranks.bit_length() - 1)
    if rank >= most:
        return 1
    return most.bit_length() - 1 + (rank < ranks - most)


def chunks(numbers):
    return -(-numbers // ROOM)


def vertices(nodes):
    """Returns the vertices of the coarse level that one rank uses."""
    few = math.sqrt(MANY / nodes) if nodes > MANY else 1
    return few * nodes / VERTEX_NODES


def levels(nodes, ranks):
    """Returns the vertices of the level that all ranks share, and the nodes per vertex of each rank's own level; 0: it
    has none (linear/preconditioner_kinds.c)."""
    each = nodes / ranks
    most = max(SAME * each ** POWER, min(FEW, TENFOLD * each ** POWER))
    if ranks == 1 or vertices(nodes) <= most:
        return min(vertices(nodes), MOST), 0
    return min(most, MOST), VERTEX_NODES * math.sqrt(max(1, each / MANY))


def coarse(v):
    """Returns the seconds of a factorisation and of a solve: interpolated between measurements by powers of v."""
    at = next((k for k in range(1, len(COARSE)) if v <= COARSE[k][0]), len(COARSE) - 1)
    low, high = COARSE[at - 1], COARSE[at]
    share = math.log(v / low[0]) / math.log(high[0] / low[0])
    return tuple(a * (b / a) ** share for a, b in zip(low[2:], high[2:]))


def ghosts(cells, ranks):
    """Returns the nodes of other ranks that a rank's tets have, on average."""
    return ROUGH * 3 * (ranks ** (1 / 3) - 1) * (cells + 1) ** 2 / ranks


def iteration_bytes(given, taken, numbers, turns):
    """Returns the bytes that a rank sends in an iteration: u at its overlap goes to the ranks that have these nodes, A
    u goes to the ranks whose overlaps have its nodes. `numbers`: those of the reduction."""
    return 24 * (given + taken) + 8 * turns * numbers


def work(rates, tets):
    """Returns the seconds for these tets, from the cache or from memory."""
    return tets * sum(rate[RESIDENT * tets > CACHE] for rate in rates)


def couplings(v):
    """Returns the blocks of the coarse matrix of a cube: groups of four vertices, with themselves and with 26
    neighbours."""
    edge = (v / 4) ** (1 / 3)
    return ((3 * edge - 2) ** 3 + edge ** 3) / 2


def iterations_of(nodes, v, own, ranks):
    edge = (nodes / v) ** (1 / 3)  # edge of a cell of the shared level, in cells of the mesh
    alone = PER_ROOT * edge * (CUT if ranks > 1 else 1)
    return min(alone, OWN_PER_ROOT * math.sqrt(edge)) if own else alone


def times(cells, ranks, args, shared=None, iterations=None):
    """Returns the seconds of a Newton iteration by its parts; `shared` vertices without levels of the ranks' own, else
    the program's choice. `iterations` replaces the model's."""
    tets, nodes = 6 * cells ** 3, (cells + 1) ** 3
    mine, halo = tets / ranks, ghosts(cells, ranks)
    wide = 1 + REACH * halo / (nodes / ranks)  # of a factor including a rank's overlap
    v, own = (shared, 0) if shared else levels(nodes, ranks)
    factor, solve = coarse(v)
    own_factor, own_solve = coarse(wide * nodes / ranks / own) if own else (0, 0)
    turns = hops(ranks)
    iterations = iterations or iterations_of(nodes, v, own, ranks)
    numbers = math.ceil(3 * v)
    exchanged = min(ranks - 1, NEIGHBOURS)
    messages = 2 * exchanged + turns * chunks(SUMS + numbers)
    size = 24 * 2 * GIVEN * halo + 8 * turns * (SUMS + numbers)
    matrix = 144 * couplings(v)  # numbers that are summed over the ranks
    parts = {"tets": work((FORCE, ENERGY, HESSIAN), mine) + wide * work((FACTOR,), mine) +
                     iterations * (work((PRODUCT, VECTORS), mine) + wide * work((SOLVE,), mine)),
             "own": own_factor + iterations * own_solve + (wide * work((ASSEMBLY,), mine) if own else 0),
             "coarse": factor + iterations * solve + work((ASSEMBLY,), mine),
             "network": turns * (chunks(math.ceil(matrix)) * args.alpha + 8 * matrix * args.beta) +
                        iterations * (messages * args.alpha + size * args.beta)}
    return {"iterations": iterations, "vertices": v, "parts": parts, "all": sum(parts.values())}


HEAD = ["tets", "ranks", "vertices", "iterations", "tets, s", "own level, s", "shared level, s", "network, s",
        "all, s", "efficiency", "as on one rank, s"]


def row(cells, ranks, first, args):
    nodes = (cells + 1) ** 3
    t, same = times(cells, ranks, args), times(cells, ranks, args, min(vertices(nodes), MOST))
    texts = [f"{6 * cells ** 3:.2g}".replace("e+0", "e"), f"{ranks}", f"{t['vertices']:.0f}", f"{t['iterations']:.0f}"]
    texts += [f"{t['parts'][name]:.2g}" for name in ("tets", "own", "coarse", "network")]
    texts += [f"{t['all']:.3g}", f"{first / t['all']:.2g}", f"{same['all']:.3g}"]
    return "| " + " | ".join(texts) + " |"


def tables(args):
    """Prints lines: strong scaling of two cubes, then weak scaling with 236 000 tets per rank."""
    head = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    lines = list(head)
    for cells in (119, 550):
        alone = times(cells, 1, args)["all"]
        lines += [row(cells, ranks, alone / ranks, args) for ranks in (1, 8, 64, 4096)]
    alone = times(34, 1, args)["all"]
    lines += [""] + head + [row(round(34 * ranks ** (1 / 3)), ranks, alone, args) for ranks in (1, 8, 64, 4096)]
    return lines


NUMBER = r"([0-9.e+-]+)"


def check(lines):
    """Compares with the ranks' output; returns the number of discrepancies."""
    wrong, found, coarse_numbers = 0, [], None
    for line in lines:
        at = re.match(r"# rank (\d+) of (\d+), cells (\d+):((?: " + NUMBER + ")+)", line)
        if at:
            found.append([int(at[1]), int(at[2]), int(at[3])] + [float(n) for n in at[4].split()])
    if not found or len(found) != found[0][1]:
        print(f"{len(found)} ranks have printed their counts")
        return 1
    ranks, cells = found[0][1:3]
    for rank, _, _, _, _, _, given, taken, others, messages, size, reductions in found:
        turns = hops(ranks, rank) if ranks > 1 else 0
        if coarse_numbers is None:  # in groups of four vertices
            apart = size - iteration_bytes(given, taken, SUMS, turns)
            coarse_numbers = apart / 8 / turns if turns else 0
            wrong += coarse_numbers % 12 != 0 or (ranks > 1 and coarse_numbers <= 0)
        model = (2 * others + turns * chunks(SUMS + int(coarse_numbers)), int(ranks > 1),
                 iteration_bytes(given, taken, SUMS + coarse_numbers, turns))
        if model != (messages, reductions, size):
            wrong += 1
            print(f"rank {rank}: {messages:g} messages, {reductions:g} reductions, {size:g} bytes; the model: {model}")
    if sum(f[3] for f in found) != (cells + 1) ** 3:
        wrong += 1
        print("own nodes are not those of the cube")
    some = sum(f[4] - f[3] for f in found) / ranks
    if ranks in (8, 64) and not 0.8 < some / ghosts(cells, ranks) < 1.25:
        wrong += 1
        print(f"{some:.0f} nodes of other ranks, the model has {ghosts(cells, ranks):.0f}")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--alpha", type=float, default=ALPHA)
    parser.add_argument("--beta", type=float, default=BETA)
    parser.add_argument("--run", nargs=4, type=int, metavar=("CELLS", "RANKS", "NEWTON", "LINEAR"))
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--page", help="exit status 1 where this page has not these tables")
    args = parser.parse_args()
    if args.check:
        sys.exit(check(sys.stdin) > 0)
    if args.run:
        cells, ranks, newton, linear = args.run
        parts = times(cells, ranks, args, iterations=linear / newton)["parts"]
        alone = newton * sum(parts[name] for name in parts if name != "network")
        print(f"{alone + newton * parts['network']:.2f} s; {alone * ranks:.2f} s of processors, without the network")
        return
    text = "\n".join(tables(args))
    if args.page:
        page = open(args.page, encoding="utf-8").read()
        sys.exit(any(table not in page for table in text.split("\n\n")))
    print(text)


if __name__ == "__main__":
    main()
