"""Draw the embedded avatar to contact sheets: ``python docs/draw_avatar.py FOLDER``.

Writes four pictures: ``avatar_neutral.png`` (front, three-quarter, side), ``avatar_affects.png``,
``avatar_shapes.png`` (all 51, and the jaw open with the lips closed) and ``avatar_people.png``. Needs no screen.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pyvista as pv
from mimique.synthesis import Rig
from mimique.synthesis.avatar import (
    AFFECTS,
    SHAPES,
    affect_pose,
    build_avatar,
    random_morphology,
    regions,
    vertex_colours,
)
from numpy.typing import NDArray

Floats = NDArray[np.float64]

VIEWS = {"front": (0.0, 0.0, 1.0), "three-quarter": (0.62, 0.06, 0.78), "side": (1.0, 0.0, 0.0)}
# region: (specular, its power); eyes and teeth are glossy, skin is not
GLOSS = {"eyeball": (0.9, 80), "teeth": (0.5, 40), "hair": (0.25, 15)}
# position, strength, colour of the lights
LIGHTS = [
    ((250, 400, 800), 0.62, "#fff6ea"),
    ((-600, 100, 500), 0.40, "#e6eeff"),
    ((0, -500, 500), 0.12, "white"),
    ((700, 100, 100), 0.30, "white"),
    ((0, 400, -700), 0.35, "white"),
]


def add_face(plotter: pv.Plotter, rig: Rig, vertices: Floats, view: str, focus: tuple[float, float, float]) -> None:
    """Add a face with its lights and camera to the current subplot."""
    colours = (vertex_colours() * 255).astype(np.uint8)
    for name, numbers in regions().items():
        inside = np.zeros(rig.n_vertices, bool)
        inside[numbers] = True
        used, triangles = np.unique(rig.triangles[inside[rig.triangles].all(1)], return_inverse=True)
        mesh = pv.PolyData.from_regular_faces(vertices[used], triangles.reshape(-1, 3))
        mesh["colours"] = colours[used]
        mesh = mesh.compute_normals(split_vertices=False, consistent_normals=False, auto_orient_normals=False)
        specular, power = GLOSS.get(name, (0.12, 12))
        plotter.add_mesh(
            mesh,
            scalars="colours",
            rgb=True,
            smooth_shading=True,
            ambient=0.35 if name == "eyeball" else 0.18,
            diffuse=0.85,
            specular=specular,
            specular_power=power,
            show_scalar_bar=False,
        )
    plotter.set_background("#eef0f3")
    plotter.remove_all_lights()
    for position, strength, colour in LIGHTS:
        plotter.add_light(pv.Light(position=position, focal_point=(0, 0, 0), intensity=strength, color=colour))
    towards = np.array(VIEWS[view]) / np.linalg.norm(VIEWS[view])
    plotter.camera_position = [tuple(np.array(focus) + 880 * towards), focus, (0, 1, 0)]
    plotter.camera.view_angle = 19


def draw_sheet(
    path: Path, cells: list[tuple[str, Rig, Floats, str]], columns: int, size: int, focus: tuple[float, float, float]
) -> None:
    """Draw cells of (title, rig, weights, view) to one picture."""
    rows = -(-len(cells) // columns)
    plotter = pv.Plotter(
        shape=(rows, columns), window_size=(size * columns, int(size * 1.2) * rows), off_screen=True, border=False
    )
    plotter.disable_anti_aliasing()
    for number, (title, rig, weights, view) in enumerate(cells):
        plotter.subplot(number // columns, number % columns)
        add_face(plotter, rig, rig.pose(weights), view, focus)
        plotter.add_text(title, font_size=8, color="black")
    plotter.screenshot(path)
    plotter.close()
    print(path)


def main() -> None:
    """Draw the four sheets."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where to write the pictures; made if it is not there")
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    rig = build_avatar()
    neutral = np.zeros(rig.n_shapes)
    draw_sheet(folder / "avatar_neutral.png", [(v, rig, neutral, v) for v in VIEWS], 3, 640, (0, -18, 0))
    affects = [a for a in AFFECTS if a != "neutral"]
    cells = [(a, rig, affect_pose(a), view) for view in ("front", "three-quarter") for a in affects]
    draw_sheet(folder / "avatar_affects.png", cells, 6, 400, (0, -12, 0))
    cells = [(shape, rig, np.eye(rig.n_shapes)[rig.index(shape)], "front") for shape in SHAPES]
    closed = neutral.copy()
    closed[[rig.index("jawOpen"), rig.index("mouthClose")]] = 1.0
    cells.append(("jawOpen + mouthClose", rig, closed, "front"))
    draw_sheet(folder / "avatar_shapes.png", cells, 8, 300, (0, -12, 0))
    rng = np.random.default_rng(1)
    people = [build_avatar(random_morphology(rng)) for _ in range(6)]
    cells = [("", person, neutral, view) for view in ("front", "three-quarter") for person in people]
    draw_sheet(folder / "avatar_people.png", cells, 6, 400, (0, -18, 0))


if __name__ == "__main__":
    main()
