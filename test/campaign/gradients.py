#!/usr/bin/env python3
# TEST full program needs=python name=test_random_gradients seconds=60 protocol=exitcode args: --first 113 --cases 8 --also 20266
"""gradients.py: gradients of random scenes by random parameters against differences of whole runs.

    python3 test/campaign/gradients.py [--cases N] [--first SEED] [--also SEED] [--only TEXT] [--full]

A case is a body of four- or ten-node tets (straight or curved, tet10 or tet10-mean) with one to four effects of all
kinds on it, by one of the methods or in statics; the quantity is a quadratic function of all positions and velocities
at the end. Its derivatives by numbers of the scene, by the rest position of a node and along a change of the first
positions and velocities, by the adjoint, are compared with differences of the fourth order of six whole runs, and
tangents with the adjoint. Differences with half the step show how accurate they are: a row counts if both agree to a
tenth of the required 1e-6. A refusal counts as a fault. The exit status is 0 if there is none.
"""
import argparse
import os
import random
import sys
import tempfile
import time

import numpy as np

import flesh

ASKED = 1e-6
# Relative accuracy of the quantity, limited by solves: for keys of a stiff weld, and for others.
SMALL = {True: 1e-9, False: 1e-11}
CELLS = (3, 1, 1)
SIZE = np.array([0.2, 0.1, 0.1])
METHODS = ["static", "backward-euler", "bdf2", "midpoint", "newmark", "hht", "generalized-alpha", "runge-kutta"]
RAMP = [{"time": 0, "value": 0.5}, {"time": 0.1, "value": 1}]
FAR = [[0.15, -1, -1], [1, 1, 1]]


class Case:
    """A random scene, and the keys by which it is differentiated: [(key, value, step)]."""

    def __init__(self, seed, folder):
        self.draw, self.folder, self.seed = random.Random(seed), folder, seed
        self.keys, self.kinds, self.faster = [], [], None
        draw = self.draw
        self.method = draw.choice(METHODS)
        self.static = self.method == "static"
        self.element = draw.choice(["tet4", "tet10", "tet10-mean"])
        material = {"energy": draw.choice(["S", "S", "E", "Neo", "Fung", "FCR"]), "young": draw.uniform(1e4, 3e4),
                    "poisson": draw.choice([0.3, 0.4, 0.45])}
        if material["energy"] == "S":
            material["constants"] = "matched"
        self.body = {"name": "lower", "mesh": self.mesh("lower", CELLS, (0, 0, 0)), "element": self.element,
                     "density": draw.uniform(500, 1500), "material": material}
        self.bodies, self.effects = [], [] if self.static else [{"inertia": {}}]
        self.add_keys("body.", {"density": self.body["density"], "material.young": material["young"]})
        self.add_keys("body.", {"material.poisson": material["poisson"]}, 2e-4)
        self.clamp()
        kinds = [name for name in KINDS if not (self.static and name in MOVING)]
        for name in draw.sample(kinds, draw.randint(1, 4)):
            self.kinds.append(name)
            KINDS[name](self)
        self.scene = {"body": self.body, "effects": self.effects,
                      "time": {"method": self.method, "step": 1e-2, "end": 1},
                      "start": {"velocity": [0 if self.static else draw.uniform(-0.3, 0.3) for _ in range(3)]},
                      "solver": {"newton_tolerance": 1e-13, "linear_tolerance": 1e-4, "threads": 1}}
        if self.bodies:
            self.scene["bodies"] = self.bodies
        self.steps = 2 if self.static else 4

    def mesh(self, name, cells, origin, moved=None):
        """Writes a box whose nodes off x = 0 are moved slightly; on surfaces that touch others, within their plane."""
        made = flesh.Mesh.box(cells, SIZE * (1, 1, 0.5) if name == "upper" else SIZE, origin)
        if self.element != "tet4":
            made = made.raise_order()
        x, noise = made.positions.copy(), np.random.default_rng(self.seed)
        shift = noise.uniform(-0.04, 0.04, x.shape) * SIZE.min()
        shift[x[:, 0] < 1e-9] = 0
        shift[np.abs(x[:, 2] - 0.1) < 1e-9, 2] = 0
        shift[x[:, 2] < origin[2] + 1e-9, 2] = 0
        x += shift
        if name == "upper" and origin[2] > 0.1: # not in line with the edges it meets
            x[:, 2] += 0.01 * x[:, 0] + 0.02 * x[:, 1]
        if moved:
            x[moved[0], moved[1]] += moved[2]
        path = os.path.join(self.folder, f"{name}{'' if not moved else moved[2]}.mesh")
        flesh.Mesh(x, made.tet_nodes, made.regions).write(path)
        return path

    def add_keys(self, prefix, values, step=1e-3):
        self.keys += [(prefix + key, value, step * (abs(value) or 1)) for key, value in values.items()]

    def add(self, name, keys, of=(), step=1e-3):
        """Adds an effect and the keys by which to differentiate."""
        count = sum(name in effect for effect in self.effects)
        self.effects.append({name: keys})
        for key in of:
            value = keys
            for part in key.replace("]", "").replace("[", ".").split("."):
                value = value[int(part) if part.isdigit() else part]
            self.add_keys(f"effects.{name}[{count}].", {key: value}, step)

    def vector(self, size):
        return [self.draw.uniform(-size, size) for _ in range(3)]

    def clamp(self):
        box = [[-1, -1, -1], [1e-9, 1, 1]]
        if self.draw.random() < 0.7:
            self.effects.append({"pin": {"box": box}})
            return
        motion = [{"time": 0}, {"time": 0.1, "translation": self.vector(0.01), "rotation": self.vector(0.1)}]
        self.add("prescribed_motion", {"box": box, "motion": motion}, ("motion[1].translation[1]", "motion[1].rotation[0]"))


def gravity(case):
    case.add("gravity", {"acceleration": case.vector(12)}, ("acceleration[2]",))


def force(case):
    case.add("force", {"box": FAR, "force": case.vector(1), "amplitude": RAMP}, ("force[1]", "amplitude[1].value"))


def traction(case):
    case.add("traction", {"box": FAR, "traction": case.vector(60)}, ("traction[0]",))


def pressure(case):
    box = case.draw.choice([[[-1, -1, 0.09], [1, 1, 1]], [[-1, -1, -1], [1, 1, 1]], FAR])
    case.add("pressure", {"box": box, "pressure": case.draw.uniform(-200, 400), "amplitude": RAMP},
             ("pressure", "amplitude[1].value"))


def spring(case):
    keys = {"point": [0.17, 0.05, 0.06], "stiffness": case.draw.uniform(10, 100),
            "target": [{"time": 0, "position": [0.2, 0.08, 0.1]}], "radius": case.draw.choice([0, 0.07])}
    case.add("spring", keys, ("stiffness", "target[0].position[2]", "point[0]"), 1e-4)


def joint(case):
    keys = {"first": {"box": [[0.12, -1, -1], [1, 1, 1]]}, "second": {"box": [[-1, -1, -1], [0.08, 1, 1]]},
            "point": [0.11, 0.05, 0.06], "stiffness": case.draw.uniform(50, 500)}
    more = case.draw.choice([{}, {"axis": [0, 0.1, 0]}, {"to": [0.05, 0.09, 0.02], "length": 0.05}])
    case.add("joint", {**keys, **more}, ("stiffness", "point[2]") + tuple(["length", "to[1]"] if "to" in more else []))


def buoyancy(case):
    case.add("buoyancy", {"level": case.draw.choice([0.04, 0.3]), "density": case.draw.uniform(800, 1200)}, ("level", "density"), 1e-5)


def drag(case):
    case.add("drag", {"body": "lower", "density": case.draw.uniform(1, 1000), "velocity": case.vector(0.3 if case.static else 1)},
             ("density", "velocity[0]"))


def viscosity(case):
    case.add("viscosity", {"shear": case.draw.uniform(5, 50), "bulk": case.draw.choice([0, 30])}, ("shear",))


def damping(case):
    keys = {"mass": case.draw.uniform(0.1, 2), "stiffness": case.draw.uniform(1e-3, 5e-3)}
    case.add("damping", keys, ("mass", "stiffness"))


def current_damping(case):
    case.add("damping", {"stiffness": case.draw.uniform(1e-3, 5e-3), "stiffness_at": "current"}, ("stiffness",))


def settling_damping(case):
    case.add("settling_damping", {"rate": case.draw.uniform(1, 10), "speed": case.draw.choice([0, 0.01])}, ("rate",))


def muscle(case):
    keys = {"fibres": {"direction": case.vector(1)}, "peak_stress": case.draw.uniform(1e3, 5e3),
            "curve": case.draw.choice(["blemker", "thelen"]), "optimal_stretch": case.draw.uniform(0.9, 1.1),
            "activation": [{"time": 0, "value": 0.4}, {"time": 0.1, "value": 0.8}]}
    more = {} if case.static or case.draw.random() < 0.5 else {"max_shortening_velocity": 8.0}
    case.add("muscle", {**keys, **more}, ("peak_stress", "optimal_stretch", "activation[1].value") + tuple(more))


def second_body(case, offset):
    if case.bodies:
        return False
    keys = {"name": "upper", "mesh": case.mesh("upper", (1, 1, 1), offset), "element": case.element,
            "density": case.draw.uniform(300, 1500), "material": {**case.body["material"], "young": 2e4}}
    case.bodies.append(keys)
    case.add_keys("bodies[0].", {"density": keys["density"], "material.young": 2e4})
    return True


def weld(case):
    if second_body(case, (0, 0, 0.1)):
        case.add("weld", {"bodies": ["lower", "upper"], "stiffness": case.draw.uniform(3e5, 3e6)}, ("stiffness",))


def between(case):
    if second_body(case, (-1.3e-3, 7e-4, case.draw.choice([0.1045, 0.1075]))): # edges exactly above each other have no second derivative
        keys = {"between": "all", "thickness": 0.01, "stiffness": 1e5, "friction": case.draw.choice([0, 0.3])}
        case.add("contact", keys, ("stiffness", "thickness") + (("friction",) if keys["friction"] else ()), 1e-4)
        if case.static:
            case.effects.append({"pin": {"box": [[-1, -1, 0.1 + 0.05], [1, 1, 1]]}})


def ground(case):
    keys = {"plane": {"point": [0, 0, -0.007], "normal": [0.02, 0.01, 1]}, "thickness": 0.01, "stiffness": 1e5,
            "friction": case.draw.choice([0, 0.3]), "motion": [{"time": 0}, {"time": 1, "translation": [0.2, 0.1, 0.05]}]}
    case.add("contact", keys, ("stiffness", "thickness", "plane.point[2]"), 1e-4)


def ball(case):
    keys = {"sphere": {"centre": [0.15, -0.058, 0.05], "radius": 0.05}, "thickness": 0.012, "stiffness": 1e5,
            "friction": case.draw.choice([0, 0.3]), "slip_speed": 0.02}
    case.add("contact", keys, ("stiffness", "sphere.radius") + (("friction", "slip_speed") if keys["friction"] else ()), 1e-4)


KINDS = {made.__name__: made for made in (gravity, force, traction, pressure, spring, joint, buoyancy, drag, viscosity, damping,
                                          current_damping, settling_damping, muscle, weld, between, ground, ball)}
MOVING = ("viscosity", "damping", "current_damping", "settling_damping")


class Run:
    """A run of a case with some keys set and its first state changed."""

    def __init__(self, case, overrides=None, start=(0, None), record=False):
        scene = flesh.Scene(case.scene, overrides)
        self.state = scene.start()
        if case.faster is None:
            case.faster = 1 + 3 * scene.mesh.positions[:, :1]
        self.state.v[:] *= case.faster
        if start[0]:
            self.state.x += start[0] * start[1][0]
            self.state.v += start[0] * start[1][1]
        self.lower = flesh.Mesh.read(case.body["mesh"]).node_count
        self.scene, integrator = scene, scene.integrator()
        integrator.set_max_energy_gain(np.inf)
        self.trajectory = flesh.Trajectory(integrator, 1e-12) if record else None
        self.parts = 0
        for _ in range(case.steps):
            self.parts += integrator.step(self.state, 1e-2).steps
        self.integrator = integrator

    def weights(self):
        n = self.state.x.size
        return np.array([np.sin(0.7 + np.arange(n)), 0 * np.ones(n) if self.integrator.method == "static" else
                         0.03 * np.sin(0.7 + n + np.arange(n))]).reshape(2, -1, 3) / n

    def value(self):
        y = np.array([self.state.x, self.state.v])
        return float((self.weights() * (y + 0.1 * y * y)).sum())

    def by(self):
        return self.weights() * (1 + 0.2 * np.array([self.state.x, self.state.v]))


def differences(run, step):
    """Returns a fourth-order difference with half of `step`, its error from that with all of it, and the runs' parts.
    Wide steps cross kinks, such as water levels."""
    runs = {k: run(k * step) for k in (-2, -1, -0.5, 0.5, 1, 2)}
    q = {k: one.value() for k, one in runs.items()}
    whole = (q[-2] - 8 * q[-1] + 8 * q[1] - q[2]) / (12 * step)
    half = (q[-1] - 8 * q[-0.5] + 8 * q[0.5] - q[1]) / (6 * step)
    return half, abs(whole - half) / 8 + 3e-16 * abs(q[1]) / step, {one.parts for one in runs.values()}


def start_direction(case, run):
    """Returns a change of the first state that leaves constrained nodes alone."""
    noise, X = np.random.default_rng(case.seed + 1), run.scene.mesh.positions
    free = (X[:, :1] > 0.01) & (X[:, 2:] < 0.14)
    kinked = "current_damping" in case.kinds # whose matrix has no derivative at rest, where it starts
    return noise.uniform(-1, 1, (2, *run.state.x.shape)) * free * ([[[0.0 if kinked else 1e-3]], [[0.0 if case.static else 1]]])


def tangents_off(case, run, rows, by, gradient):
    """Returns a fault if tangents, along a change to which each parameter contributes equally, differ from the adjoint.
    Both use the same steps, so they agree whatever the true value, and even if differences are unreliable."""
    shares = np.abs(gradient) + 1e-9 * np.array([abs(run.value() / row[2]) for row in rows])
    amounts = [case.draw.choice((-1, 1)) for _ in rows] / shares
    by_tangents = float(by.ravel() @ run.trajectory.operator([row[1] for row in rows]).matvec(amounts))
    off = abs(by_tangents - gradient @ amounts) / len(rows)
    return [f"tangents and the adjoint differ by {off:.1e}"] if off > 1e-7 else []


def try_case(case, say):
    """Returns the faults of a case, and how many of its rows count."""
    run = Run(case, record=True)
    at_end = [k for k in np.flatnonzero(run.scene.mesh.positions[:, 0] > 0.19) if k < run.lower]
    rest = case.draw.choice(at_end), case.draw.randrange(2)

    def parameter_of(key, value):
        wider = 1e-7 if "motion[" in key else None # a stiff weld's amplification of the positions' round-off
        return flesh.Parameter(lambda p: flesh.Scene(case.scene, {key: p}).system, value, wider)

    def moved(p):
        mesh = case.mesh("lower", CELLS, (0, 0, 0), (*rest, p)) if p else case.body["mesh"]
        return {"body.mesh": mesh}

    rows = [(key, parameter_of(key, value), step, lambda p, k=key, v=value: Run(case, {k: v + p}))
            for key, value, step in case.keys]
    if len(case.keys) % 3 == 0 and "between" not in case.kinds:
        rows.append(("rest position", flesh.Parameter(lambda p: flesh.Scene(case.scene, moved(p)).system, 0, 1e-7), 2e-5,
                     lambda p: Run(case, moved(p))))
    by, faults, counted, worst = run.by(), [], 0, 0
    found = run.trajectory.gradient([row[1] for row in rows], *by)
    faults += tangents_off(case, run, rows, by, found.by_parameters)
    along = start_direction(case, run)
    at_start = float((along * [found.by_x, found.by_v]).sum())
    rows.append(("start", None, 1e-5, lambda p: Run(case, None, (p, along))))
    for k, (key, parameter, step, one) in enumerate(rows):
        slope = at_start if parameter is None else found.by_parameters[k]
        if key == "rest position":
            slope += found.by_x[rest]
        try:
            expected, noise, parts = differences(one, step)
        except (flesh.SolveError, flesh.IntegratorError): # a run with stiff contact may end elsewhere, or fail
            continue
        off = abs(slope - expected)
        small = SMALL["weld" in key] * np.abs(by[0] * run.state.x).sum() / abs(step) * 1e-3
        counts = parts == {run.parts} and noise < 0.1 * ASKED * abs(expected)
        counted += counts
        worst = max(worst, off / abs(expected) if counts and off > small else 0)
        is_off = counts and off > ASKED * abs(expected) or off > 1e-3 * abs(expected) + 100 * noise
        if parts == {run.parts} and off > small and is_off:
            faults.append(f"by {key}: {slope:.10g}, runs say {expected:.10g}, {off:.1e} off, noise {noise:.1e}")
        if say:
            print(f"  {key}: {slope:.10g}, {off / abs(expected) if expected else off:.1e} off, noise "
                  f"{noise / abs(expected) if expected else noise:.1e}{'' if counts else ' -'}", flush=True)
    return faults, counted, len(rows), worst


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--also", type=int, action="append", default=[], help="one more case")
    parser.add_argument("--only", default="", help="cases whose name has this in it")
    parser.add_argument("--full", action="store_true", help="400 cases")
    parser.add_argument("--say", action="store_true", help="every row")
    arguments = parser.parse_args()
    bad = failed = counted = all_rows = 0
    largest = 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in [*range(arguments.first, arguments.first + (400 if arguments.full else arguments.cases)), *arguments.also]:
            case = Case(seed, folder)
            name = f"{seed}: {case.method}, {case.element}, {case.body['material']['energy']}, {', '.join(case.kinds)}"
            if arguments.only not in name:
                continue
            began = time.time()
            try:
                faults, count, rows, worst = try_case(case, arguments.say)
            except (flesh.SolveError, flesh.IntegratorError) as error:
                failed += 1
                print(f"{name}: no run: {error}", flush=True)
                continue
            except flesh.ArgumentError as error:
                faults, count, rows, worst = [f"refused: {error}"], 0, 0, 0
            counted, all_rows, largest, bad = counted + count, all_rows + rows, max(largest, worst), bad + bool(faults)
            print(f"{name}: {count} of {rows} rows count, {worst:.1e} at most, {time.time() - began:.1f} s", flush=True)
            for fault in faults:
                print("  FAULT", fault, flush=True)
    print(f"{bad} cases with faults, {failed} without a run; {counted} of {all_rows} rows count, "
          f"the largest error is {largest:.1e}")
    return bad > 0


if __name__ == "__main__":
    sys.exit(main())
