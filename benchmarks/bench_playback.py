"""How fast faces are drawn: mimique's scene and films against PyVista alone, in one run.

PyVista alone: the same mesh in the same camera and size, smooth shading, without anti-aliasing; every frame gets new
points from a list made before, and no new normals. mimique: weights to points, normals, its own light, what stands
beside. Both draw in turn, so that whatever else the machine does meets both; the ratio of the medians counts. Then
films are written, as a person would have them, and the memory of a long one is compared with that of a short one::

    OMP_NUM_THREADS=1 python benchmarks/bench_playback.py [RIG_FOLDER_OR_FILE UNIT]
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mimique.synthesis import Rig, read_rig
from mimique.synthesis.avatar import build_avatar, vertex_colours
from mimique.synthesis.movie import write_movie
from mimique.synthesis.performance import Performance
from mimique.synthesis.scene import Scene
from mimique.synthesis.view import View

SIZE = (960, 540)
ROUNDS = 60
RATE = 25.0


def make_performance(rig: Rig, seconds: float, colours: np.ndarray | None) -> Performance:
    """A performance in which every shape comes and goes; no two frames are alike."""
    t = np.arange(round(seconds * RATE))[:, None] / RATE
    weights = np.clip(np.sin(2.3 * t + np.arange(rig.n_shapes)) - 0.6, 0, 1)
    return Performance(rig, weights, RATE, title="benchmark", vertex_colours=colours)


def make_peer(performance: Performance, scene: Scene) -> Callable[[int], None]:
    """PyVista drawing the same meshes from the same camera."""
    import pyvista as pv

    rig = performance.rig
    plotter = pv.Plotter(off_screen=True, window_size=list(SIZE))
    plotter.disable_anti_aliasing()
    mesh = pv.PolyData(rig.neutral.astype(np.float32), np.insert(rig.triangles, 0, 3, axis=1).ravel())
    actor = plotter.add_mesh(mesh, smooth_shading=True, color="tan")
    camera = scene.plotter.renderers[0].camera
    plotter.camera.position, plotter.camera.focal_point = camera.position, camera.focal_point
    plotter.camera.view_angle, plotter.camera.up = camera.view_angle, camera.up
    plotter.show(auto_close=False)
    drawn = actor.mapper.dataset
    meshes = [rig.pose(weights).astype(np.float32) for weights in performance.weights[:ROUNDS]]

    def draw(frame: int) -> None:
        drawn.points = meshes[frame]
        plotter.render()

    return draw


def compare(performance: Performance) -> None:
    """Print milliseconds a frame of each way of drawing and its rate as a share of PyVista's."""
    alone = Scene(performance, SIZE, view=View(curves=False))
    with_curves = Scene(performance, SIZE)

    def draw(scene: Scene, smooth: bool) -> Callable[[int], None]:
        def one(frame: int) -> None:
            scene.show(frame)
            scene.render(smooth=smooth)

        return one

    ways = {
        "PyVista alone": make_peer(performance, alone),
        "face, as it plays": draw(alone, smooth=False),
        "face and curves, as it plays": draw(with_curves, smooth=False),
        "face, smooth edges (films)": draw(alone, smooth=True),
    }
    times: dict[str, list[float]] = {name: [] for name in ways}
    for frame in range(ROUNDS):
        for name, way in ways.items():
            begin = time.perf_counter()
            way(frame)
            if frame >= 3:
                times[name].append(time.perf_counter() - begin)
    peer = np.median(times["PyVista alone"])
    for name, taken in times.items():
        median = float(np.median(taken))
        print(f"  {name:<30} {1000 * median:6.1f} ms  {peer / median:6.0%} of PyVista's rate")
    alone.close()
    with_curves.close()


def film(performance: Performance) -> None:
    """Print pictures per second of whole films, from nothing to the finished file."""
    with tempfile.TemporaryDirectory() as folder:
        for name, suffix, curves in (("MP4", ".mp4", False), ("MP4 with curves", ".mp4", True), ("GIF", ".gif", False)):
            begin = time.perf_counter()
            path = write_movie(performance, Path(folder) / f"film{suffix}", size=SIZE, view=View(curves=curves))
            taken = time.perf_counter() - begin
            megabytes = path.stat().st_size / 1e6
            print(f"  {name:<30} {performance.n_frames / taken:6.1f} pictures/s  {megabytes:.1f} MB")


def measure_memory(rig: Rig) -> None:
    """Print the peak of memory after a short film and after one of ten minutes, both small."""
    import resource

    for suffix in (".mp4", ".gif"):
        for seconds in (20.0, 600.0):
            performance = make_performance(rig, seconds, None)
            with tempfile.TemporaryDirectory() as folder:
                write_movie(performance, Path(folder) / f"film{suffix}", size=(96, 96), fps=5, view=View(curves=False))
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            print(f"  {suffix} of {seconds:3.0f} s: peak memory {peak:.0f} MB")


def main() -> None:
    """Measure on the avatar, or on the rig that is named."""
    if len(sys.argv) > 1:
        rig, colours = read_rig(sys.argv[1], unit=sys.argv[2] if len(sys.argv) > 2 else None), None
    else:
        rig, colours = build_avatar(), vertex_colours()
    performance = make_performance(rig, 8.0, colours)
    print(f"{rig.n_vertices} vertices, {rig.n_shapes} shapes, {SIZE[0]} × {SIZE[1]}")
    compare(performance)
    film(performance)
    measure_memory(rig)


if __name__ == "__main__":
    main()
