# TEST part_of=test_python_runs
"""test_threads.py: calls release the interpreter's lock; Ctrl-C ends steps and runs in order; threads share systems."""
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import flesh
from conftest import interpreter_environment

# A body whose steps take long enough to be interrupted; a separate Python runs {loop}.
CODE = """
import sys
import numpy as np
import flesh
mesh = flesh.Mesh.box((24, 8, 8), (3, 1, 1))
body = flesh.Body(mesh, flesh.Material("S", young=1e5, poisson=0.49), 1000)
system = flesh.System(mesh, [flesh.Inertia(body), flesh.Elasticity(body), flesh.Gravity(body)])
system.pin(mesh.nodes_in_box((0, -1, -1), (0, 2, 2)))
integrator, state, h = flesh.Integrator(system), flesh.State.at_rest(mesh), 1 / 60
adaptive = flesh.Integrator(system, "ida", adaptive=flesh.AdaptiveOptions(max_steps=10**9))
print("ready", flush=True)
try:
    {loop}
except KeyboardInterrupt:
    print("interrupted", flush=True)
    if state.t:  # whole steps, as if nothing had been (but that a run's times are multiples of h, not sums)
        again, integrator = flesh.State.at_rest(mesh), flesh.Integrator(system)
        while again.t < state.t - h / 2:
            integrator.step(again, h)
        assert abs(again.t - state.t) < 1e-12 and np.abs(again.x - state.x).max() < 1e-10
    else:
        adaptive.step(state, 1e-3)
    sys.exit(7)
"""


def interrupt(loop):
    """Sends SIGINT to a Python in that loop; its output becomes part of the assertion if it is not as expected."""
    child = subprocess.Popen([sys.executable, "-c", CODE.format(loop=loop)], stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, universal_newlines=True, env=interpreter_environment())
    first = child.stdout.readline()
    assert first == "ready\n", child.communicate()
    time.sleep(0.7)
    child.send_signal(signal.SIGINT)
    try:
        said, errors = child.communicate(timeout=1800)
    finally:
        child.kill()
    assert (child.returncode, said, errors) == (7, "interrupted\n", "")


@pytest.mark.parametrize("loop", [
    "while True: integrator.step(state, h)",
    "flesh.run(integrator, state, h, 1e6)",
    "for record in flesh.steps(integrator, state, h, 1e6): pass",
    "copy = state.copy(); adaptive.step(copy, 3600)",  # one step that would take hours
], ids=["step", "run", "steps", "one-long-step"])
def test_ctrl_c_ends_it_in_order(loop):
    interrupt(loop)


def test_another_thread_runs_while_a_call_does():
    mesh = flesh.Mesh.box((24, 8, 8), (3, 1, 1))
    body = flesh.Body(mesh, flesh.Material("S", young=1e5, poisson=0.49), 1000)
    system = flesh.System(mesh, [flesh.Elasticity(body), flesh.Gravity(body)])
    system.pin(mesh.nodes_in_box((0, -1, -1), (0, 2, 2)))
    count, done = 0, threading.Event()

    def counts():
        nonlocal count
        while not done.is_set():
            count += 1
            time.sleep(0.0005)
    thread = threading.Thread(target=counts)
    thread.start()
    x, began, before = mesh.positions * 1.01, time.monotonic(), count
    while time.monotonic() - began < 0.3:
        system.potential(x)
    apart, elapsed = count - before, time.monotonic() - began
    # One call that takes as long as all of these, during which Python runs nothing in this thread.
    problem = flesh.KinsolProblem(system, flesh.SolverOptions(linear_solver="klu"))
    u, before, began = problem.start(), count, time.monotonic()
    problem.preconditioner_setup(u)
    within, factoring = count - before, time.monotonic() - began
    done.set()
    thread.join()
    assert within / factoring > 0.2 * apart / elapsed > 1, (within, factoring, apart, elapsed)


def test_threads_share_a_system(system, mesh):
    ends = [None] * 4

    def work(k):
        integrator, state = flesh.Integrator(system), flesh.State.at_rest(mesh)
        for _ in range(10):
            integrator.step(state, 1 / 60)
        ends[k] = state.x
    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(end, ends[0]) for end in ends) and ends[0][-1, 2] < 0.95


def test_an_integrator_makes_one_step_at_a_time(system, mesh):
    integrator, state, refused = flesh.Integrator(system), flesh.State.at_rest(mesh), []

    def step_within():
        try:
            integrator.step(state.copy(), 1 / 60)
        except flesh.ArgumentError as error:
            refused.append(str(error))
    integrator.stop = step_within
    integrator.step(state, 1 / 60)
    assert refused and "the integrator is making a step" in refused[0] and state.t == 1 / 60
    integrator.stop = None
    integrator.step(state, 1 / 60)


def test_a_run_leaves_the_stop_of_its_integrator(system, mesh):
    integrator, state = flesh.Integrator(system), flesh.State.at_rest(mesh)
    trajectory = flesh.Trajectory(integrator)
    flesh.run(integrator, state, 0.01, 0.03)
    ones = np.ones(state.x.shape)
    whole = trajectory.gradient(by_x=ones).by_x
    integrator.stop = lambda: True
    for call in (lambda: integrator.step(state, 0.01), lambda: trajectory.gradient(by_x=ones)):
        with pytest.raises(flesh.StoppedError):
            call()
    integrator.stop = None
    assert np.array_equal(trajectory.gradient(by_x=ones).by_x, whole)
    asked = []
    integrator.stop = lambda: asked.append(1)
    flesh.run(integrator, state, 0.01, state.t + 0.01)
    asked.clear()
    integrator.step(state, 0.01)
    assert asked


def test_errors_belong_to_their_threads(tmp_path):
    said = {}

    def fail(k):
        for _ in range(200):
            try:
                flesh.Mesh.read(tmp_path / f"nowhere{k}.mesh")
            except flesh.FileError as error:
                said.setdefault(k, set()).add(str(error))
    threads = [threading.Thread(target=fail, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(len(said[k]) == 1 and f"nowhere{k}.mesh" in said[k].pop() for k in range(4))


def test_tasks_run_once_each():
    seen = []
    flesh.Threads(3).run(50, seen.append)
    assert sorted(seen) == list(range(50))
