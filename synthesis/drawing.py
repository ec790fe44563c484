"""What the scene needs of VTK: a plotter that works on this machine, meshes, and images in parts of a window."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MimiqueError
from .lettering import BACKGROUND

if TYPE_CHECKING:
    import pyvista as pv

_TOP, _BOTTOM = "#55606d", "#262c34"  # behind the face
_OSMESA = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so", "osmesa.dll", "libOSMesa.dylib")
_NO_OPENGL = (
    "cannot draw: no OpenGL library was found; install libosmesa6, or libegl1 with libgl1-mesa-dri (Debian's names)"
)


class Picture:
    """An image that fills one part of the window."""

    def __init__(self, plotter: Any) -> None:
        from vtkmodules.vtkCommonDataModel import vtkImageData
        from vtkmodules.vtkRenderingCore import vtkActor2D, vtkImageMapper, vtkRenderer

        self._data = vtkImageData()
        mapper = vtkImageMapper()
        mapper.SetInputData(self._data)
        mapper.SetColorWindow(255)
        mapper.SetColorLevel(127.5)
        actor = vtkActor2D()
        actor.SetMapper(mapper)
        self._renderer = vtkRenderer()
        self._renderer.AddViewProp(actor)
        self._renderer.InteractiveOff()
        self._renderer.SetBackground(*(int(BACKGROUND[i : i + 2], 16) / 255 for i in (1, 3, 5)))
        plotter.render_window.AddRenderer(self._renderer)

    def place(self, left: float, bottom: float, right: float, top: float) -> None:
        """Give it a part of the window, as shares from the lower left corner."""
        self._renderer.SetViewport(left, bottom, right, top)

    def hide(self, hidden: bool = True) -> None:
        """Draw it no longer, or again."""
        self._renderer.SetDraw(not hidden)

    def show(self, image: NDArray[np.uint8]) -> None:
        """Replace the image, (height, width, 3)."""
        from vtkmodules.util.numpy_support import numpy_to_vtk

        height, width, _ = image.shape
        self._data.SetDimensions(width, height, 1)
        flipped = np.ascontiguousarray(image[::-1]).reshape(-1, 3)
        self._data.GetPointData().SetScalars(numpy_to_vtk(flipped, deep=True))
        self._data.Modified()


def make_mesh(points: NDArray[Any], triangles: NDArray[Any]) -> pv.PolyData:
    """Return triangles as PyVista's mesh, one normal a vertex to come."""
    import pyvista as pv

    faces = np.insert(triangles, 0, 3, axis=1)
    return pv.PolyData(points.astype(np.float32), faces.ravel())


def add_actor(renderer: Any, mesh: pv.PolyData, colour: str | None = None) -> Any:
    """Add a mesh to a renderer and return PyVista's actor, drawn in one colour or in those of its array ``colour``.

    The mesh itself is drawn, with its array ``Normals`` if it has one: what is changed in it later shows.
    """
    import pyvista as pv

    mapper = pv.DataSetMapper(mesh)
    if colour is None:
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray("colour")
        mapper.SetColorModeToDirectScalars()
    mapper.SetScalarVisibility(colour is None)
    actor = pv.Actor(mapper=mapper)
    if colour is not None:
        actor.prop.color = colour
    if "Normals" in mesh.point_data:
        mesh.GetPointData().SetActiveNormals("Normals")
        actor.prop.interpolation = "Phong"
    renderer.add_actor(actor, reset_camera=False)
    return actor


def set_smooth(plotter: Any, smooth: bool) -> None:
    """Smooth edges in one pass over the finished picture, far cheaper than several samples a pixel; or not at all."""
    for renderer in plotter.renderers:
        renderer.SetUseFXAA(smooth)


def read_pixels(window: Any) -> NDArray[np.uint8]:
    """Return what a window shows, (height, width, 3), without drawing it again as PyVista's screenshot does."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

    width, height = window.GetSize()
    pixels = vtkUnsignedCharArray()
    window.GetPixelData(0, 0, width - 1, height - 1, 0 if window.GetDoubleBuffer() else 1, pixels, 0)
    return np.array(vtk_to_numpy(pixels).reshape(height, width, 3)[::-1])


def open_plotter(size: tuple[int, int], off_screen: bool, columns: int = 1) -> Any:
    """Return an empty plotter, with one renderer a column.

    Raises
    ------
    MimiqueError
        If this machine has no OpenGL, or no display to open a window on.
    """
    if not off_screen and sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise MimiqueError(
            "no display to open a window on; render a film (--movie FILE.mp4) or a sheet (--sheet FILE.png) instead"
        )
    import pyvista as pv

    with _quiet_vtk():
        plotter: Any = pv.Plotter(
            off_screen=off_screen,
            window_size=list(size),
            lighting="none",
            title="mimique",
            shape=(1, columns),
            border=False,
        )
        kind = plotter.render_window.GetClassName()
        # Without X and EGL, VTK falls back to OSMesa, and crashes where that is not there either.
        if kind == "vtkOSOpenGLRenderWindow" and not _has_library(*_OSMESA):
            plotter.close()
            raise MimiqueError(_NO_OPENGL)
        # Where there is no X server, or none that draws, VTK goes on with a window that nobody sees.
        if not off_screen and kind in ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow"):
            plotter.close()
            raise MimiqueError(
                f"cannot open a window on display {os.environ.get('DISPLAY', '')!r}: it is not there or has no OpenGL; "
                "install libgl1 and libgl1-mesa-dri (Debian's names), or render a film (--movie FILE.mp4) instead"
            )
        plotter.disable_anti_aliasing()
        set_smooth(plotter, True)
        for renderer in plotter.renderers:
            renderer.set_background(_BOTTOM, top=_TOP)
    return plotter


def _has_library(*names: str) -> bool:
    for name in names:
        with contextlib.suppress(OSError):
            ctypes.CDLL(name)
            return True
    return False


@contextlib.contextmanager
def _quiet_vtk() -> Iterator[None]:
    """Keep VTK's warnings about the displays that it tries in vain off the terminal."""
    from vtkmodules.vtkCommonCore import vtkLogger

    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)
