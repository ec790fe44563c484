"""Draw the embedded avatar to contact sheets: ``python docs/draw_avatar.py [FOLDER]``.

Writes four pictures: ``avatar_neutral.png`` (front, three-quarter, side), ``avatar_affects.png``,
``avatar_shapes.png`` (all 51, and the jaw open with the lips closed) and ``avatar_people.png``. Needs no screen.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

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
from mimique.synthesis.drawing import make_mesh, open_plotter
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

Floats = NDArray[np.float64]

VIEWS = {"front": (0.0, 0.0, 1.0), "three-quarter": (0.62, 0.06, 0.78), "side": (1.0, 0.0, 0.0)}
# region: (specular, its power); eyes and teeth are glossy, skin is not
GLOSS = {"eyeball": (0.9, 80), "teeth": (0.5, 40), "hair": (0.25, 15)}
# position, strength, colour of the lights
LIGHTS = [
    ((250, 400, 800), 0.60, "#fff6ea"),
    ((-600, 100, 500), 0.40, "#e6eeff"),
    ((0, -300, 700), 0.20, "white"),
    ((700, 100, 100), 0.46, "white"),
    ((0, 400, -700), 0.35, "white"),
]
BACKGROUND = "#eef0f3"
WIDTH = 1600  # of a sheet, pixels
TITLE = 20  # height of the strip above a face with its title, pixels
OVERSAMPLING = 2  # a cell is drawn this much larger, and made smaller, for smooth edges


class Cell(NamedTuple):
    """One face of a sheet."""

    title: str
    rig: Rig
    weights: Floats
    view: str = "front"


def draw_face(
    plotter: Any, cell: Cell, focus: tuple[float, float, float], view_angle: float = 19.0
) -> NDArray[np.uint8]:
    """Return the picture of one face."""
    plotter.clear_actors()
    vertices = cell.rig.pose(cell.weights)
    colours = (vertex_colours() * 255).astype(np.uint8)
    for name, numbers in regions().items():
        inside = np.zeros(len(vertices), bool)
        inside[numbers] = True
        used, triangles = np.unique(cell.rig.triangles[inside[cell.rig.triangles].all(1)], return_inverse=True)
        mesh = make_mesh(vertices[used], triangles.reshape(-1, 3))
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
    towards = np.array(VIEWS[cell.view]) / np.linalg.norm(VIEWS[cell.view])
    plotter.camera_position = [tuple(np.array(focus) + 880 * towards), focus, (0, 1, 0)]
    plotter.camera.view_angle = view_angle
    plotter.render()
    return np.asarray(plotter.screenshot(return_img=True))[..., :3]


def draw_sheet(
    path: Path, cells: list[Cell], columns: int, focus: tuple[float, float, float], view_angle: float = 19.0
) -> None:
    """Draw cells row by row to one picture, each with its title."""
    width = WIDTH // columns
    height = round(1.2 * width)
    strip = TITLE if any(cell.title for cell in cells) else 0
    plotter = open_plotter((OVERSAMPLING * width, OVERSAMPLING * height), off_screen=True)
    plotter.set_background(BACKGROUND)
    for position, strength, colour in LIGHTS:
        plotter.add_light(pv.Light(position=position, focal_point=(0, 0, 0), intensity=strength, color=colour))
    sheet = Image.new("RGB", (width * columns, (strip + height) * -(-len(cells) // columns)), BACKGROUND)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=15 if columns < 8 else 13)
    for number, cell in enumerate(cells):
        corner = (number % columns * width, number // columns * (strip + height))
        face = Image.fromarray(draw_face(plotter, cell, focus, view_angle))
        sheet.paste(face.resize((width, height), Image.Resampling.LANCZOS), (corner[0], corner[1] + strip))
        pen.text((corner[0] + 6, corner[1] + 3), cell.title, fill="#20242a", font=font)
    plotter.close()
    palette = sheet.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=2)
    # dithering keeps large faces smooth; in small ones it only makes the file larger
    dither = Image.Dither.FLOYDSTEINBERG if columns < 8 else Image.Dither.NONE
    sheet.quantize(palette=palette, dither=dither).save(path, optimize=True)
    print(path)


def main() -> None:
    """Draw the four sheets."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "folder",
        type=Path,
        nargs="?",
        default=Path(__file__).resolve().parent / "images",
        help="where to write the pictures; made if it is not there (default: images, beside this script)",
    )
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    rig = build_avatar()
    neutral = np.zeros(rig.n_shapes)
    draw_sheet(folder / "avatar_neutral.png", [Cell(v, rig, neutral, v) for v in VIEWS], 3, (0, -18, 0))
    affects = [a for a in AFFECTS if a != "neutral"]
    cells = [Cell(a, rig, affect_pose(a), view) for view in ("front", "three-quarter") for a in affects]
    draw_sheet(folder / "avatar_affects.png", cells, 6, (0, -12, 0))
    cells = [Cell(shape, rig, np.eye(rig.n_shapes)[rig.index(shape)]) for shape in SHAPES]
    closed = neutral.copy()
    closed[[rig.index("jawOpen"), rig.index("mouthClose")]] = 1.0
    cells.append(Cell("jawOpen + mouthClose", rig, closed))
    draw_sheet(folder / "avatar_shapes.png", cells, 8, (0, -12, 0))
    rng = np.random.default_rng(1)
    people = [build_avatar(random_morphology(rng)) for _ in range(6)]
    cells = [Cell("", person, neutral, view) for view in ("front", "three-quarter") for person in people]
    draw_sheet(folder / "avatar_people.png", cells, 6, (0, -18, 0))


if __name__ == "__main__":
    main()
