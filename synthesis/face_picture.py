"""One column of the scene: a performance's skin, its markers, or both, with light and camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .drawing import add_actor, make_mesh
from .heat import Heat
from .marker_balls import Markers
from .moving_mesh import MovingMesh, Piece
from .performance import Performance
from .rig import Rig
from .view import CAMERAS

if TYPE_CHECKING:
    import pyvista as pv

SKIN = (0.85, 0.65, 0.54)
_LOST = (150, 156, 163)  # a face whose weights are not known is grey
_CAVITY = "#5d4034"  # what shows through an open mouth or lid of a mesh that has nothing behind it
_VIEW_ANGLE = 18.0  # degrees; a long lens, as portraits are taken


class FacePicture:
    """A performance in one renderer.

    Parameters
    ----------
    renderer
        PyVista's renderer to draw with.
    performance
        What is shown.
    skin
        Whether the mesh is shown.
    kinds
        Which markers, of :data:`.view.MARKER_KINDS`; what the performance does not have is left out.
    heat
        What colours the skin; its own colours if left out.
    """

    def __init__(
        self,
        renderer: Any,
        performance: Performance,
        *,
        skin: bool = True,
        kinds: tuple[str, ...] = (),
        heat: Heat | None = None,
    ) -> None:
        p = performance
        self.renderer, self.performance, self.heat = renderer, performance, heat
        self._box = find_face_box(p.rig)
        self._surface = MovingMesh(p.rig) if skin else None
        colours = np.broadcast_to(SKIN, (p.rig.n_vertices, 3)) if p.vertex_colours is None else p.vertex_colours
        self._colours = np.round(np.asarray(colours) * 255).astype(np.uint8)
        self._lost = False
        self._meshes: list[tuple[Piece, pv.PolyData]] = []
        if self._surface is not None:
            self._meshes = [(piece, self._add_skin(piece)) for piece in self._surface.pieces]
        self.markers = Markers(renderer, p, kinds, 0.0085 * float(np.linalg.norm(np.ptp(self._box, axis=0))))
        self._light()

    @property
    def has_skin(self) -> bool:
        """Whether the mesh is shown."""
        return self._surface is not None

    def show(self, frame: int) -> None:
        """Bring everything to ``frame`` of the performance."""
        if self._surface is not None:
            self._surface.pose(self.performance.weights[frame])
            lost = self.performance.is_lost(frame)
            colours = self._find_colours(frame, lost)
            for piece, mesh in self._meshes:
                if piece.moves:
                    mesh.points = self._surface.points[piece.vertices]
                    mesh.point_data["Normals"] = self._surface.normals[piece.vertices]
                if colours is not None:
                    mesh.point_data["colour"] = colours[piece.vertices]
            self._lost = lost
        self.markers.show(frame)

    def aim(self, camera: str, aspect: float) -> None:
        """Point the camera at the part of the mesh that moves, with the forehead, a little from above.

        Parameters
        ----------
        camera
            One of :data:`.view.CAMERAS`.
        aspect
            Width of the picture divided by its height.
        """
        rig, (low, high) = self.performance.rig, self._box
        width = float(high[0] - low[0])
        bottom = low[1] - 0.1 * width
        top = min(max(bottom + 1.8 * width, high[1] + 0.1 * width), float(rig.neutral[:, 1].max()) + 0.06 * width)
        centre = np.array([(low[0] + high[0]) / 2, (bottom + top) / 2, high[2] - 0.6 * width])
        half = max((top - bottom) / 2, 0.62 * width / aspect)  # in a narrow picture the width decides
        distance = half / np.tan(np.radians(_VIEW_ANGLE / 2)) + high[2] - centre[2]
        turn = np.radians(CAMERAS[camera])
        centre = centre - np.array([0, 0, 0.3 * width * np.sin(turn)])  # from the side the head reaches farther back
        eye = self.renderer.camera
        eye.view_angle = _VIEW_ANGLE
        eye.focal_point = tuple(centre)
        eye.position = tuple(centre + distance * np.array([np.sin(turn), 0.05, np.cos(turn)]))
        eye.up = (0.0, 1.0, 0.0)
        self.renderer.camera_set = True
        # Faces that share a camera differ in depth: a range for all of them, however they are turned.
        reach = 3 * float(np.linalg.norm(np.ptp(rig.neutral, axis=0)))
        eye.clipping_range = (max(distance - reach, 0.02 * distance), distance + reach)

    def _find_colours(self, frame: int, lost: bool) -> NDArray[np.uint8] | None:
        """Return the colours for ``frame``, None where those that the mesh has still hold."""
        assert self._surface is not None
        if lost:
            grey = self._colours.mean(axis=1, keepdims=True) / self._colours.mean()
            return np.clip(grey * np.array(_LOST), 0, 255).astype(np.uint8) if not self._lost else None
        if self.heat is not None:
            return self.heat.colours(frame, self._surface, self._colours)
        return self._colours if self._lost else None

    def _add_skin(self, piece: Piece) -> pv.PolyData:
        assert self._surface is not None
        mesh = make_mesh(self._surface.points[piece.vertices], piece.triangles)
        mesh.point_data["Normals"] = self._surface.normals[piece.vertices]
        mesh.point_data["colour"] = self._colours[piece.vertices]
        warm = self.heat is None  # a heat map is read by its colours: less light and shade, no gloss
        look = add_actor(self.renderer, mesh).prop
        look.ambient, look.diffuse = (0.06, 0.94) if warm else (0.34, 0.72)
        look.specular, look.specular_power = (0.14 if warm else 0.0), 18
        if self.performance.vertex_colours is None:
            look.culling = "back"
            inside = add_actor(self.renderer, mesh, _CAVITY).prop
            inside.culling, inside.lighting = "front", False
        return mesh

    def _light(self) -> None:
        """Key light from above left, a cooler fill from the right, and a rim that lifts the head off its ground."""
        import pyvista as pv

        low, high = self._box
        centre, reach = (low + high) / 2, float(np.linalg.norm(high - low))
        for direction, intensity, colour in (
            ((-0.55, 0.70, 1.0), 0.84, "#fff3e6"),
            ((0.85, -0.15, 0.85), 0.50, "#e9ecfb"),
            ((0.75, 0.9, -0.9), 0.45, "#ffffff"),
        ):
            position = centre + 4 * reach * np.asarray(direction)
            self.renderer.add_light(
                pv.Light(position=tuple(position), focal_point=tuple(centre), intensity=intensity, color=colour)
            )


def find_face_box(rig: Rig) -> NDArray[np.float64]:
    """Return the box round the part of the neutral that the shapes move, (2, 3): lowest and highest corner, mm.

    A vertex counts where some shape moves it by a tenth of the largest displacement or more; where nothing moves,
    the whole mesh counts.
    """
    reach = np.linalg.norm(rig.deltas, axis=2).max(axis=0)
    face = rig.neutral[reach >= 0.1 * reach.max()] if reach.max() > 0 else rig.neutral
    return np.stack([face.min(axis=0), face.max(axis=0)])
