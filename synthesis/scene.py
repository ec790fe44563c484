"""The picture of a performance: the face, its markers, the panel and the timeline. Window and film draw this one.

Drawn with VTK through PyVista. Off screen it needs no display, only an OpenGL library: EGL with a driver, or OSMesa.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..errors import InputError
from .drawing import Picture, make_mesh, open_plotter
from .performance import Performance
from .posed_mesh import PosedMesh
from .rig import Rig
from .timeline import Layout, Timeline

if TYPE_CHECKING:
    import pyvista as pv

SKIN = (0.85, 0.65, 0.54)
_CAVITY = "#5d4034"  # what shows through an open mouth or lid of a mesh that has nothing behind it
_MARKER = "#f4f7fa"
_VIEW_ANGLE = 18.0  # degrees; a long lens, as portraits are taken


class Scene:
    """A performance, drawn one frame at a time.

    Parameters
    ----------
    performance
        What is shown.
    size
        Width and height of the picture, pixels.
    off_screen
        Whether to draw without a window.

    Raises
    ------
    MimiqueError
        If this machine has no way to draw, or no display to open a window on.
    """

    def __init__(
        self, performance: Performance, size: tuple[int, int] = (960, 540), *, off_screen: bool = True
    ) -> None:
        if min(size) < 64:
            raise InputError(f"size: expected at least 64 × 64 pixels, but got {size[0]} × {size[1]}")
        self.performance = performance
        self.frame = -1
        rig = performance.rig
        self._pose = PosedMesh(rig)
        self._plotter: Any = open_plotter(size, off_screen)  # PyVista types much of it as perhaps absent
        self._mesh, self._markers = self._add_face(), self._add_markers()
        self._light()
        self._aim()
        self._pictures = [Picture(self._plotter) for _ in range(2)]
        self._layout = Layout(0, 0)
        self.show(0)

    @property
    def plotter(self) -> Any:
        """The PyVista plotter that draws."""
        return self._plotter

    @property
    def timeline(self) -> Timeline:
        """The panel and timeline at the picture's present size."""
        return self._timeline

    def show(self, frame: int) -> None:
        """Bring everything to ``frame``; :meth:`render` draws it.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        p = self.performance
        if not 0 <= frame < p.n_frames:
            raise InputError(f"frame: expected 0 to {p.n_frames - 1}, but got {frame}")
        self.fit()
        if frame == self.frame:
            return
        weights = p.weights[frame]
        points = self._pose.points(weights if np.isfinite(weights).all() else np.zeros_like(weights))
        self._mesh.points = points
        self._mesh.point_data["Normals"] = self._pose.normals(points)
        if self._markers is not None:
            self._markers.points = self._ball_points(frame)
        self.frame = frame
        self._pictures[0].show(self._timeline.draw_panel(frame))
        self._pictures[1].show(self._timeline.draw_timeline(frame))

    def render(self) -> None:
        """Draw the present frame."""
        self._plotter.render()

    def image(self, frame: int | None = None) -> NDArray[np.uint8]:
        """Return the picture of ``frame`` (the present one by default), (height, width, 3)."""
        if frame is not None:
            self.show(frame)
        self.render()
        return np.asarray(self._plotter.screenshot(return_img=True))[..., :3]

    def png(self, frame: int | None = None) -> bytes:
        """Return the picture of ``frame`` (the present one by default) as a PNG file's bytes."""
        buffer = io.BytesIO()
        Image.fromarray(self.image(frame)).save(buffer, format="png", optimize=True)
        return buffer.getvalue()

    def close(self) -> None:
        """Free the window and what it holds."""
        self._plotter.close()

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _add_face(self) -> pv.PolyData:
        p = self.performance
        mesh = make_mesh(p.rig.neutral, p.rig.triangles)
        mesh.point_data["Normals"] = self._pose.normals(p.rig.neutral)
        colours = np.broadcast_to(SKIN, (p.rig.n_vertices, 3)) if p.vertex_colours is None else p.vertex_colours
        mesh.point_data["colour"] = np.round(np.asarray(colours) * 255).astype(np.uint8)
        actor = self._plotter.add_mesh(
            mesh,
            scalars="colour",
            rgb=True,
            ambient=0.06,
            diffuse=0.94,
            specular=0.14,
            specular_power=18,
            copy_mesh=False,
            show_scalar_bar=False,
            reset_camera=False,
        )
        # The normals are computed here, not by PyVista, which would copy the mesh and let the copy go stale.
        mesh.GetPointData().SetActiveNormals("Normals")
        actor.prop.interpolation = "Phong"
        if p.vertex_colours is None:
            actor.prop.culling = "back"
            self._plotter.add_mesh(
                mesh, scalars=None, color=_CAVITY, culling="front", lighting=False, copy_mesh=False, reset_camera=False
            )
        return mesh

    def _add_markers(self) -> pv.PolyData | None:
        """One mesh of small balls; a missing marker's ball has no size."""
        import pyvista as pv

        p = self.performance
        if p.markers is None or p.markers.shape[1] == 0:
            return None
        ball = pv.Icosphere(radius=1.0, nsub=1)
        self._ball = np.asarray(ball.points, dtype=np.float32)
        self._ball_radius = 0.0085 * float(np.linalg.norm(np.ptp(find_face_box(p.rig), axis=0)))
        n_markers = p.markers.shape[1]
        faces = np.asarray(ball.regular_faces) + len(self._ball) * np.arange(n_markers)[:, None, None]
        mesh = make_mesh(self._ball_points(0), faces.reshape(-1, 3))
        mesh.point_data["Normals"] = np.tile(self._ball, (n_markers, 1))
        actor = self._plotter.add_mesh(
            mesh, color=_MARKER, ambient=0.25, diffuse=0.75, specular=0.5, specular_power=30, reset_camera=False
        )
        mesh.GetPointData().SetActiveNormals("Normals")
        actor.prop.interpolation = "Phong"
        return mesh

    def _ball_points(self, frame: int) -> NDArray[np.float32]:
        assert self.performance.markers is not None
        centres = self.performance.markers[frame]
        seen = np.isfinite(centres).all(axis=1)
        centres = np.where(seen[:, None], centres, self._pose.rig.neutral.mean(axis=0))
        balls = centres[:, None] + np.where(seen, self._ball_radius, 0.0)[:, None, None] * self._ball
        return balls.reshape(-1, 3).astype(np.float32)

    def _light(self) -> None:
        """Key light from above left, a cooler fill from the right, and a rim that lifts the head off its ground."""
        import pyvista as pv

        low, high = find_face_box(self.performance.rig)
        centre, reach = (low + high) / 2, float(np.linalg.norm(high - low))
        for direction, intensity, colour in (
            ((-0.55, 0.75, 1.0), 0.78, "#fff3e6"),
            ((0.95, 0.05, 0.75), 0.40, "#e4ecff"),
            ((0.0, -0.6, 0.9), 0.22, "#ffe8dc"),
            ((0.75, 0.9, -0.9), 0.45, "#ffffff"),
            ((-0.9, 0.6, -0.8), 0.30, "#ffffff"),
        ):
            position = centre + 4 * reach * np.asarray(direction)
            self._plotter.add_light(
                pv.Light(position=tuple(position), focal_point=tuple(centre), intensity=intensity, color=colour)
            )

    def _aim(self) -> None:
        """Point the camera at the part of the mesh that moves, with the forehead, straight ahead and a little above."""
        rig = self.performance.rig
        low, high = find_face_box(rig)
        width = float(high[0] - low[0])
        bottom = low[1] - 0.1 * width
        top = min(max(bottom + 1.8 * width, high[1] + 0.1 * width), float(rig.neutral[:, 1].max()) + 0.06 * width)
        centre = np.array([(low[0] + high[0]) / 2, (bottom + top) / 2, high[2] - 0.6 * width])
        distance = (top - bottom) / 2 / np.tan(np.radians(_VIEW_ANGLE / 2)) + high[2] - centre[2]
        camera = self._plotter.camera
        camera.view_angle = _VIEW_ANGLE
        camera.focal_point = tuple(centre)
        camera.position = tuple(centre + distance * np.array([0.0, 0.05, 1.0]))
        camera.up = (0.0, 1.0, 0.0)
        self._plotter.renderer.reset_camera_clipping_range()

    def fit(self) -> bool:
        """Fit face, panel and timeline into the window's present size; return whether it had changed."""
        width, height = self._plotter.render_window.GetSize()
        layout = Layout(width, height)
        if layout == self._layout:
            return False
        self._layout, self.frame = layout, -1
        self._timeline = Timeline(self.performance, layout)
        x, y = layout.panel_width / width, layout.strip_height / height
        self._plotter.renderer.SetViewport(x, y, 1, 1)
        self._pictures[0].place(0, y, x, 1)
        self._pictures[1].place(0, 0, 1, y)
        return True


def find_face_box(rig: Rig) -> NDArray[np.float64]:
    """Return the box round the part of the neutral that the shapes move, (2, 3): lowest and highest corner, mm.

    A vertex counts where some shape moves it by a tenth of the largest displacement or more; where nothing moves,
    the whole mesh counts.
    """
    reach = np.linalg.norm(rig.deltas, axis=2).max(axis=0)
    face = rig.neutral[reach >= 0.1 * reach.max()] if reach.max() > 0 else rig.neutral
    return np.stack([face.min(axis=0), face.max(axis=0)])
