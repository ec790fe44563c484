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
from .timeline import BACKGROUND

if TYPE_CHECKING:
    import pyvista as pv

_TOP, _BOTTOM = "#55606d", "#262c34"  # behind the face


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


def open_plotter(size: tuple[int, int], off_screen: bool) -> Any:
    """Return an empty plotter.

    Raises
    ------
    MimiqueError
        If this machine has no OpenGL, or no display to open a window on.
    """
    if not off_screen and sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise MimiqueError("no display to open a window on; render a film instead (--movie FILE.mp4)")
    import pyvista as pv

    with _quiet_vtk():
        plotter: Any = pv.Plotter(off_screen=off_screen, window_size=list(size), lighting="none", title="mimique")
        # Without X and EGL, VTK falls back to OSMesa, and crashes where that is not there either.
        if plotter.render_window.GetClassName() == "vtkOSOpenGLRenderWindow" and not _has_osmesa():
            plotter.close()
            raise MimiqueError(
                "cannot draw off screen: no OpenGL library was found; install libosmesa6, "
                "or libegl1 with libgl1-mesa-dri (Debian's names)"
            )
        plotter.disable_anti_aliasing()
        # Smooths edges in one pass over the finished picture: far cheaper than several samples a pixel in software.
        plotter.renderer.UseFXAAOn()
        plotter.set_background(_BOTTOM, top=_TOP)
    return plotter


def _has_osmesa() -> bool:
    for name in ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so", "osmesa.dll", "libOSMesa.dylib"):
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
