"""sweep_figure.py: runs a sweep of the program, reads its table into pandas and draws a figure by matplotlib.

    sweep_figure.py [FOLDER]

A bar of three energies hangs in equilibrium at five Poisson's ratios; FOLDER/drift.png shows how much its volume changes
(FOLDER is out/python_sweep by default). With resume=True an interrupted sweep is resumed, and a complete one only read.
"""
import os
import sys

import matplotlib

import flesh

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def make_scene(folder):
    """Writes a mesh and a scene into the folder; returns the scene's path."""
    flesh.Mesh.box((12, 3, 3), (4, 1, 1)).write(os.path.join(folder, "bar.mesh"))
    scene = flesh.Scene({
        "body": {"mesh": "bar.mesh", "density": 1000, "material": {"energy": "S", "young": 1e6, "poisson": 0.3}},
        "effects": [{"gravity": {"acceleration": [0, 0, -9.81]}}, {"pin": {"box": [[-1, -1, -1], [1e-9, 2, 2]]}}],
    }, folder=folder)
    path = os.path.join(folder, "bar.yaml")
    scene.write(path)
    return path


def main(folder="out/python_sweep"):
    os.makedirs(folder, exist_ok=True)
    result = flesh.sweep({
        "title": "how a bar hangs",
        "scene": make_scene(folder),
        "set": {"output.frame_interval": 0},
        "axes": [{"key": "body.material.energy", "name": "energy", "values": ["B", "E", "S"]},
                 {"key": "body.material.poisson", "name": "nu", "values": [0.1, 0.3, 0.4, 0.45, 0.49]}],
    }, folder, resume=True)
    table = result.table.to_pandas()
    drift = table.pivot(index="nu", columns="energy", values="max_volume_drift")
    figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
    drift.plot(ax=axes, marker="o", logy=True)
    axes.set_xlabel("Poisson's ratio")
    axes.set_ylabel("change of volume, of the volume at rest")
    figure.savefig(os.path.join(folder, "drift.png"), dpi=150)
    print(drift.to_string(float_format=lambda value: f"{value:.2e}"))
    return drift


if __name__ == "__main__":
    main(*sys.argv[1:])
