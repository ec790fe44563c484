"""Rigs and marker maps into the corpus."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from ...corpus import Corpus
from ...errors import InputError
from ...synthesis import Rig, read_rig
from ...synthesis.marker_map import check_marker_map, read_marker_map
from ...synthesis.rig_checks import describe_markers, describe_rig

AVATAR = "avatar"
"""In place of a path: the face that mimique draws itself."""


def add_rig(
    corpus: Corpus,
    name: str,
    path: str,
    *,
    unit: str | None = None,
    marker_map: Path | None = None,
    map_name: str = "default",
    author: str | None = None,
) -> str:
    """Read a rig and, where given, its marker map, and store both in one commit.

    Parameters
    ----------
    corpus, name
        Where to, and what it is called there.
    path
        A rig file or folder, or ``avatar``, which brings its own marker map.
    unit
        Of the file's lengths.
    marker_map
        CSV with the columns ``marker,vertex``.
    map_name
        A rig can have several maps, one a marker set.

    Returns
    -------
    A line that says what was added, and one for each thing to know: shapes that repeat or cancel each other, shapes
    that no marker sees.

    Raises
    ------
    MimiqueError
        If the rig or the map cannot be used; nothing is changed then.
    """
    if path == AVATAR and not Path(path).exists():
        rig, table = _embedded_avatar()
    else:
        rig, table = read_rig(path, unit=unit), None
    if marker_map is not None:
        table = read_marker_map(marker_map)
        try:
            check_marker_map(rig, table)
        except InputError as error:
            raise type(error)(f"{marker_map.name}: {error}") from error
    source = AVATAR if path == AVATAR else Path(path).name
    parameters = {"rig": name, "source": source, "unit": unit, "map": map_name if table is not None else None}
    message = f"Add rig {name} from {source}"
    with corpus.transaction(message, command="rig add", parameters=parameters, author=author) as edit:
        edit.put_rig(name, rig.to_dataset(), provenance={"source": source, "unit": unit})
        if table is not None:
            edit.put_marker_map(name, table, map_name)
    mapped = "no marker map" if table is None else f"{len(table)} markers mapped"
    notes = describe_rig(rig) + ([] if table is None else describe_markers(rig, table["vertex"].to_numpy()))
    return "\n".join(
        [f"rig {name}: {rig.n_vertices} vertices, {rig.n_shapes} shapes, {mapped}", *(f"  {note}" for note in notes)]
    )


def _embedded_avatar() -> tuple[Rig, pd.DataFrame]:
    from ...synthesis.avatar import build_avatar, default_markers

    markers = default_markers()
    return build_avatar(), pd.DataFrame({"marker": list(markers), "vertex": list(markers.values())})
