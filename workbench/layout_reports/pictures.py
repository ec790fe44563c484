"""Pictures of a face with numbered markers, and of how large the error is where on it.

The face is drawn by VTK without perspective, so that a vertex's place in the picture is a plain projection; dots,
numbers and leader lines are drawn over it as vectors. Everything is told by form and number, nothing by colour alone.
Left and right in the captions are the subject's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch
from numpy.typing import NDArray

from ...synthesis.drawing import make_mesh, open_plotter
from ...synthesis.moving_mesh import find_normals
from ...synthesis.rig import Rig
from ...synthesis.scene import find_face_box
from .label_placement import place_labels

Array = NDArray[np.floating[Any]]

__all__ = [
    "FRONT",
    "SIDES",
    "FaceView",
    "Mark",
    "blank_views",
    "draw_marks",
    "draw_view",
    "number_layout",
    "render_views",
]

FRONT, SIDES = 0.0, (-62.0, 62.0)
"""Degrees by which the camera goes round the head: 0 before it, positive to the subject's left."""
SKIN = "#d9d4cf"
PIXELS = 900  # along the longer side
MARGIN = 27.0  # mm round what is shown
HIDDEN = 5.0  # mm; a marker so far behind the surface that is seen at its pixel cannot be seen itself
FACING = -0.3  # cosine; in a groove, as at the mouth corner, a vertex may look away a little and yet be seen
BEYOND = 2.0  # mm; a view from the side shows that side and what is so far beyond the middle
_LIGHTS = (((-0.5, 0.6, 1.0), 0.62), ((0.8, 0.2, 0.8), 0.34), ((0.0, -0.7, 0.8), 0.16))


@dataclass(frozen=True)
class Mark:
    """A marker in a picture: its number, its vertex, and whether it is one of the head's."""

    text: str
    vertex: int
    head: bool = False


@dataclass(frozen=True)
class FaceView:
    """A picture of a face, and what is needed to draw over it.

    Parameters
    ----------
    yaw
        Degrees by which the camera went round.
    image
        (height, width, 3) uint8; white where nothing could be drawn.
    extent
        Left, right, bottom, top of the picture, mm on the axes below.
    axes
        (3, 2) the picture's right and up.
    visible
        (n_vertices,) which vertices can be seen.
    near
        (n_vertices,) which are on the side that is looked at, hidden or not; none from the front.
    """

    yaw: float
    image: NDArray[np.uint8]
    extent: tuple[float, float, float, float]
    axes: Array
    visible: NDArray[np.bool_]
    near: NDArray[np.bool_]

    @property
    def aspect(self) -> float:
        """Height over width."""
        left, right, bottom, top = self.extent
        return (top - bottom) / (right - left)


def render_views(
    rig: Rig,
    yaws: Sequence[float],
    *,
    vertices: Sequence[int] = (),
    colours: NDArray[np.floating[Any]] | None = None,
    pixels: int = PIXELS,
) -> list[FaceView]:
    """Draw a rig's neutral face from several sides.

    Parameters
    ----------
    rig
        The face.
    yaws
        Degrees round the head.
    vertices
        What the picture shows, with a margin; the part that moves where none are given.
    colours
        (n_vertices, 3) in 0..1; one pale skin by default.
    pixels
        Along the longer side.

    Raises
    ------
    MimiqueError
        If this machine cannot draw.
    """
    shown = _choose_shown(rig, vertices)
    return [_render(rig, yaw, shown, colours, pixels) for yaw in yaws]


def blank_views(rig: Rig, yaws: Sequence[float], *, vertices: Sequence[int] = ()) -> list[FaceView]:
    """Return the same views without a face, for machines that cannot draw one; vertices that look away are hidden."""
    shown = _choose_shown(rig, vertices)
    normals = find_normals(rig.neutral, rig.triangles)
    out = []
    for yaw in yaws:
        axes, depth = _turn(yaw)
        extent = _frame(shown @ axes)
        seen = (normals @ depth > FACING) & _is_near(rig, yaw)
        near = seen & (yaw != 0)
        out.append(FaceView(yaw, np.full((2, 2, 3), 255, dtype=np.uint8), extent, axes, seen, near))
    return out


def number_layout(vertices: Sequence[int], head: Mapping[str, int]) -> list[Mark]:
    """Return the marks of a layout, numbered in their order, then those of the head, H1, H2 and so on."""
    marks = [Mark(str(k), int(vertex)) for k, vertex in enumerate(vertices, start=1)]
    return marks + [Mark(f"H{k}", int(vertex), True) for k, vertex in enumerate(head.values(), start=1)]


def draw_view(axis: Axes, view: FaceView) -> None:
    """Draw a view into an axis, in millimetres."""
    axis.imshow(view.image, extent=view.extent, interpolation="antialiased", zorder=0, aspect="equal")
    axis.set_xlim(view.extent[0], view.extent[1])
    axis.set_ylim(view.extent[2], view.extent[3])
    axis.set_axis_off()


def draw_marks(axis: Axes, view: FaceView, rig: Rig, marks: Sequence[Mark], *, font: float = 8.5) -> list[str]:
    """Draw the marks that can be seen in a view: dots, squares for the head, numbers, lines from one to the other.

    Marks of the head are drawn from their side even where hair hides them: they go on a band or a cap there.

    Returns
    -------
    The numbers that were drawn.
    """
    seen = [m for m in marks if view.visible[m.vertex] or (m.head and view.near[m.vertex])]
    if not seen:
        return []
    points = rig.neutral[[mark.vertex for mark in seen]] @ view.axes
    figure = axis.figure
    assert isinstance(figure, Figure)  # not a subfigure: the axis is a panel of the page
    wide = axis.get_position().width * float(figure.get_size_inches()[0])
    millimetres = (view.extent[1] - view.extent[0]) / (72 * wide)  # of one point of type
    sizes = np.array([[(0.62 * len(m.text) + 0.42) * font, 1.22 * font] for m in seen]) * millimetres
    radius = 0.30 * font * millimetres
    centres = place_labels(points, sizes, radius)
    for mark, point, centre, size in zip(seen, points, centres, sizes, strict=True):
        axis.plot(*zip(point, centre, strict=True), color="white", linewidth=2.0, zorder=3, solid_capstyle="round")
        axis.plot(*zip(point, centre, strict=True), color="black", linewidth=0.7, zorder=4)
        axis.add_patch(
            FancyBboxPatch(
                tuple(centre - size / 2 * [1, 0.94]),
                size[0],
                size[1] * 0.94,
                boxstyle=f"round,pad=0,rounding_size={0.25 * size[1]}",
                facecolor="black" if mark.head else "white",
                edgecolor="black",
                linewidth=0.6,
                zorder=6,
            )
        )
        axis.text(
            float(centre[0]),
            float(centre[1]),
            mark.text,
            fontsize=font,
            fontweight="bold",
            color="white" if mark.head else "black",
            ha="center",
            va="center_baseline",
            zorder=7,
        )
    for head, form in ((False, "o"), (True, "s")):
        chosen = np.array([m.head == head for m in seen])
        axis.plot(
            *points[chosen].T,
            form,
            markersize=0.56 * font,
            markerfacecolor="black" if head else "white",
            markeredgecolor="black",
            markeredgewidth=1.1,
            linestyle="none",
            zorder=5,
        )
    return [mark.text for mark in seen]


def _choose_shown(rig: Rig, vertices: Sequence[int]) -> Array:
    if len(vertices):
        return np.asarray(rig.neutral[np.array(list(vertices), dtype=np.int64)])
    low, high = find_face_box(rig)
    inside = ((rig.neutral >= low) & (rig.neutral <= high)).all(axis=1)
    return np.asarray(rig.neutral[inside & (rig.neutral[:, 2] > (low[2] + high[2]) / 2)])


def _turn(yaw: float) -> tuple[Array, Array]:
    """Return the picture's right and up, (3, 2), and the way to the camera, (3,)."""
    a = np.radians(yaw)
    return np.array([[np.cos(a), 0.0], [0.0, 1.0], [-np.sin(a), 0.0]]), np.array([np.sin(a), 0.0, np.cos(a)])


def _frame(points: Array) -> tuple[float, float, float, float]:
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def _render(rig: Rig, yaw: float, shown: Array, colours: Array | None, pixels: int) -> FaceView:
    import pyvista as pv

    axes, depth = _turn(yaw)
    extent = _frame(shown @ axes)
    wide, tall = extent[1] - extent[0], extent[3] - extent[2]
    size = (round(pixels * min(1, wide / tall)), round(pixels * min(1, tall / wide)))
    plotter = open_plotter(size, True)
    try:
        plotter.set_background("white")
        mesh = make_mesh(rig.neutral, rig.triangles)
        mesh.point_data["Normals"] = find_normals(rig.neutral, rig.triangles)
        mesh.GetPointData().SetActiveNormals("Normals")
        look: dict[str, Any] = {"ambient": 0.34, "diffuse": 0.72, "specular": 0.0, "show_scalar_bar": False}
        if colours is None:
            actor = plotter.add_mesh(mesh, color=SKIN, **look)
        else:
            mesh.point_data["colour"] = np.round(np.asarray(colours) * 255).astype(np.uint8)
            actor = plotter.add_mesh(mesh, scalars="colour", rgb=True, **look)
        actor.prop.interpolation = "Phong"
        reach = float(np.linalg.norm(np.ptp(rig.neutral, axis=0)))
        middle = axes @ [(extent[0] + extent[1]) / 2, (extent[2] + extent[3]) / 2]
        turn = np.stack([axes[:, 0], axes[:, 1], depth])
        for direction, intensity in _LIGHTS:
            place = middle + 4 * reach * (np.asarray(direction) @ turn)
            plotter.add_light(pv.Light(position=tuple(place), focal_point=tuple(middle), intensity=intensity))
        camera = plotter.camera
        camera.parallel_projection = True
        camera.focal_point, camera.position = tuple(middle), tuple(middle + 3 * reach * depth)
        camera.up, camera.parallel_scale = (0.0, 1.0, 0.0), tall / 2
        plotter.renderer.reset_camera_clipping_range()
        image = np.asarray(plotter.screenshot(return_img=True))[..., :3]
        away = -np.asarray(plotter.get_image_depth(fill_value=np.nan))
    finally:
        plotter.close()
    seen = _see(rig, axes, depth, extent, 3 * reach - away, middle) & _is_near(rig, yaw)
    near = _is_near(rig, yaw) & (find_normals(rig.neutral, rig.triangles) @ depth > FACING) & (yaw != 0)
    return FaceView(yaw, image, extent, axes, seen, near)


def _see(
    rig: Rig, axes: Array, depth: Array, extent: tuple[float, float, float, float], front: Array, middle: Array
) -> NDArray[np.bool_]:
    """Compare each vertex's depth with that of the surface that is seen round its pixel."""
    height, width = front.shape
    flat = rig.neutral @ axes
    column = np.clip(((flat[:, 0] - extent[0]) / (extent[1] - extent[0]) * width).astype(int), 0, width - 1)
    row = np.clip(((extent[3] - flat[:, 1]) / (extent[3] - extent[2]) * height).astype(int), 0, height - 1)
    # On a slope the depth changes within a pixel: the farthest of the neighbours decides.
    padded = np.pad(np.nan_to_num(front, nan=-np.inf), 1, mode="edge")
    seen = np.min([padded[row + i, column + j] for i in range(3) for j in range(3)], axis=0)
    inside = (flat[:, 0] > extent[0]) & (flat[:, 0] < extent[1]) & (flat[:, 1] > extent[2]) & (flat[:, 1] < extent[3])
    facing = find_normals(rig.neutral, rig.triangles) @ depth > FACING
    return np.asarray(inside & facing & ((rig.neutral - middle) @ depth >= seen - HIDDEN))


def _is_near(rig: Rig, yaw: float) -> NDArray[np.bool_]:
    """Return which vertices are on the side that is looked at; all of them from the front."""
    middle = float(find_face_box(rig)[:, 0].mean())
    return np.asarray((rig.neutral[:, 0] - middle) * np.sign(yaw) >= -BEYOND)
