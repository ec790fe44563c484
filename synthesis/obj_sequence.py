"""A rig over time as a sequence of Wavefront OBJ files, one a frame.

Lengths are millimetres (OBJ has no unit of its own; the first line of every file says so). The topology, the vertices'
numbers and the parts, as groups, are the rig's. A frame whose weights are not known shows the neutral.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from os import PathLike
from pathlib import Path

from ..errors import InputError
from .animation import Animation, Frames, check_weights, fill_missing, find_missing, weight_blocks
from .partial_files import partial_folder
from .rig import Rig
from .rig_parts import join_names, split_parts


def write_obj_sequence(
    folder: str | PathLike[str],
    rig: Rig,
    weights: Frames,
    rate: float,
    *,
    name: str = "frame",
    progress: Callable[[int, int], object] | None = None,
) -> Path:
    """Write one mesh a frame: ``NAME.000000.obj`` and so on, 0.1 µm fine.

    Parameters
    ----------
    folder
        New or empty; complete or not there.
    rig
        The face.
    weights
        (n_frames, n_shapes), read a part at a time.
    rate
        Of the weights, Hz; each file says its second.
    name
        Beginning of the files' names.
    progress
        Called with the number of files written and of all.

    Returns
    -------
    The folder's path.

    Raises
    ------
    RigError, InputError
        If rig, weights or rate cannot be used, there is something in the folder, the disk has no room for all files,
        or they cannot be written.
    """
    folder = Path(folder)
    check_weights(rig, weights, rate)
    stem = "".join(c if c.isalnum() or c in "-_ " else "_" for c in name)[:80] or "frame"
    animation, faces = Animation(rig), _format_faces(rig)
    _, never = find_missing(weights)
    n_frames = len(weights)
    digits = max(6, len(str(n_frames - 1)))
    line = "v %.4f %.4f %.4f\n" * rig.n_vertices
    with partial_folder(folder) as part:
        for first, values in weight_blocks(weights, animation.block_frames):
            values[:, never] = 0
            for frame, mesh in enumerate(animation.positions(fill_missing(values)), start=first):
                head = f"# mimique, millimetres, frame {frame} of {n_frames}, {frame / rate:.6f} s\n"
                text = head + line % tuple(mesh.ravel().tolist()) + faces
                (part / f"{stem}.{frame:0{digits}d}.obj").write_text(text, encoding="utf-8", newline="\n")
                if frame == 0:
                    _check_room(folder, len(text.encode()) * (n_frames - 1))
                if progress is not None:
                    progress(frame + 1, n_frames)
    return folder


def _format_faces(rig: Rig) -> str:
    """Return the lines of groups and faces, the same in every file."""
    parts = split_parts(rig)
    pieces = []
    for part, called in zip(parts, join_names([part.name for part in parts]), strict=True):
        if len(parts) > 1:
            pieces.append("g " + "_".join(called.split()) + "\n")
        corners = (part.vertices[part.triangles] + 1).ravel().tolist()
        pieces.append("f %d %d %d\n" * len(part.triangles) % tuple(corners))
    return "".join(pieces)


def _check_room(folder: Path, needed: int) -> None:
    free = shutil.disk_usage(folder.parent).free
    if needed > free:
        raise InputError(
            f"{folder}: {needed / 1e9:.1f} GB of files do not fit, {free / 1e9:.1f} GB are free; "
            "give a lower rate, or write one file (.glb, .usdc)"
        )
