"""What must hold of each kind of unit, read whole from one snapshot."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from zarr.abc.store import Store

from ...errors import CorpusError, MimiqueError
from ..annotations.tier_table import ORIGINS, STATUSES
from ..store.arrays_io import EncodedDataset, encode_dataset
from ..store.layout import decode_name, encode_name, markers_path, rig_path, take_path, weights_path
from ..store.library_view import array_path
from ..store.nodes import read_array, read_attributes, read_bytes
from ..store.provenance import compute_fingerprint
from ..store.tables import complete_table, fingerprint_table, unpack_table
from ..store.unit_paths import kind_of_unit
from ..store.view import take_array_path
from ..take import check_take
from .node_history import SnapshotView

__all__ = ["check_unit"]


def check_unit(store: Store, unit: str) -> Iterator[str]:
    """Yield everything that is wrong with a unit, in words; nothing where it is whole.

    Every array is read and its fingerprint computed anew.

    Raises
    ------
    Exception
        Whatever the store raises on damaged bytes; the caller names the unit.
    """
    for segment in unit.split("/"):
        if encode_name(decode_name(segment)) != segment:
            yield f"its name {segment!r} in the store is not one that mimique writes"
    facts = read_attributes(store, unit)
    if facts is None:
        yield "its metadata are missing"
        return
    yield from CHECKS.get(kind_of_unit(unit), _check_nothing)(store, unit, facts)
    provenance = facts.get("provenance") or {}
    if "fingerprint" in provenance and compute_fingerprint(provenance) != provenance["fingerprint"]:
        yield "what it says of where it comes from does not match its own fingerprint"


def _check_take(store: Store, unit: str, facts: dict[str, Any]) -> Iterator[str]:
    take = decode_name(unit.split("/")[1])
    header = read_attributes(store, markers_path(take))
    if header is None:
        yield "its positions are missing"
        return
    arrays = _read_arrays(store, header, lambda name: take_array_path(take, name))
    yield from _compare(EncodedDataset(header, arrays, {}).fingerprint, facts["fingerprint"])
    position = arrays["position"]
    if position.shape != (facts["n_frames"], facts["n_markers"], 3):
        yield f"expected {facts['n_frames']} frames and {facts['n_markers']} markers, but got {position.shape}"
        return
    try:
        check_take(SnapshotView(store).take(take), without_markers=True)
    except MimiqueError as error:
        yield f"it is no usable take: {error}"
    digest = facts["attributes"].get("source_sha256")
    if digest is not None and not re.fullmatch("[0-9a-f]{64}", str(digest)):
        yield f"the hash of its source file is none: {digest!r}"
    solve = facts.get("solve")
    if solve is not None and read_attributes(store, weights_path(take, solve)) is None:
        yield f"its current solve {solve!r} is not there"


def _check_dataset(store: Store, unit: str, facts: dict[str, Any]) -> Iterator[str]:
    """Check processed markers or weights."""
    take = decode_name(unit.split("/")[1])
    header = facts["header"]
    arrays = _read_arrays(store, header, lambda name: array_path(unit, name))
    yield from _compare(EncodedDataset(header, arrays, {}).fingerprint, facts["fingerprint"])
    of_take = read_attributes(store, take_path(take))
    if of_take is None:
        yield "its take is not there"
        return
    for name, entry in header["variables"].items():
        values = arrays.get(name)
        if values is None:
            continue
        if values.ndim != len(entry["dims"]):
            yield f"{name!r} has {values.ndim} dimensions, expected {', '.join(entry['dims'])}"
        elif "time" in entry["dims"] and values.shape[entry["dims"].index("time")] != of_take["n_frames"]:
            yield f"{name!r} has {values.shape[entry['dims'].index('time')]} frames, the take {of_take['n_frames']}"
        if values.dtype.kind == "f" and np.isinf(values).any():
            yield f"{name!r} has infinite values"
    if kind_of_unit(unit) == "weights":
        if "weights" not in arrays:
            yield "it holds no weights"
        rig = header["attributes"].get("rig")
        known = read_attributes(store, rig_path(rig)) if isinstance(rig, str) and rig else None
        shapes, used = _shapes(known), header["texts"].get("shape")
        same_rig = known is not None and _rig_input(facts) in (None, known.get("fingerprint"))
        if shapes is not None and same_rig and shapes != used:
            yield f"its shapes are not those of the rig {rig!r}"


def _check_tier(store: Store, unit: str, facts: dict[str, Any]) -> Iterator[str]:
    stored = read_bytes(store, unit)
    table = unpack_table(stored[0] if stored else np.empty(0, np.uint8), where="its table")
    yield from _compare(fingerprint_table(table), facts["fingerprint"])
    if len(table) != facts["segments"]:
        yield f"expected {facts['segments']} segments, but got {len(table)}"
    of_take = read_attributes(store, take_path(decode_name(unit.split("/")[1])))
    if of_take is None:
        yield "its take is not there"
        return
    try:
        complete_table(table, where="its table", n_frames=of_take["n_frames"])
    except MimiqueError as error:
        yield str(error)
        return
    if not table["onset"].is_monotonic_increasing:
        yield "its segments are not in the order of time"
    if table["id"].duplicated().any():
        yield f"two segments have the id {table.loc[table['id'].duplicated(), 'id'].iloc[0]}"
    confidence = table["confidence"].to_numpy(np.float64)
    if ((confidence < 0) | (confidence > 1)).any():
        yield "a confidence is not between 0 and 1"
    for column, allowed in (("status", STATUSES), ("origin", ORIGINS)):
        wrong = sorted(set(table[column].astype(str)) - set(allowed))
        if wrong:
            yield f"{column} {wrong[0]!r} is none of {', '.join(allowed)}"


def _check_document(store: Store, unit: str, facts: dict[str, Any]) -> Iterator[str]:
    stored = read_bytes(store, unit)
    data = stored[0].tobytes() if stored else b""
    if len(data) != facts["bytes"]:
        yield f"expected {facts['bytes']} bytes, but got {len(data)}"
    yield from _compare(hashlib.sha256(data).hexdigest(), facts["sha256"], "SHA-256")


def _check_rig(store: Store, unit: str, facts: dict[str, Any]) -> Iterator[str]:
    header = facts["header"]
    arrays = _read_arrays(store, header, lambda name: array_path(unit, name))
    yield from _compare(EncodedDataset(header, arrays, {}).fingerprint, facts["fingerprint"])
    for name, values in arrays.items():
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            yield f"{name!r} is not finite"
    n_vertices = facts.get("sizes", {}).get("vertex")
    if n_vertices is not None and "triangles" in arrays and arrays["triangles"].size:
        used = arrays["triangles"]
        if used.min() < 0 or used.max() >= n_vertices:
            yield f"a triangle has a vertex that is none of its {n_vertices}"
    for name, columns in facts.get("marker_maps", {}).items():
        vertices = np.asarray(columns["vertex"], dtype=np.int64)
        if len(columns["marker"]) != len(vertices) or len(set(columns["marker"])) != len(vertices):
            yield f"marker map {name!r}: markers and vertices do not go together"
        if n_vertices is not None and vertices.size and not 0 <= vertices.min() <= vertices.max() < n_vertices:
            yield f"marker map {name!r}: a vertex is none of the rig's {n_vertices}"


def _check_learned(store: Store, unit: str, facts: dict[str, Any]) -> Iterator[str]:
    values: dict[str, NDArray] = {key: np.asarray(value, dtype=str) for key, value in facts["texts"].items()}
    values |= {key: read_array(store, array_path(unit, key))[0] for key in facts["arrays"]}
    dataset = xr.Dataset({key: ([f"{key}_{axis}" for axis in range(v.ndim)], v) for key, v in values.items()})
    yield from _compare(encode_dataset(dataset, where="it", single=False).fingerprint, facts["fingerprint"])


def _check_signer(store: Store, unit: str, facts: dict[str, Any]) -> Iterator[str]:
    if not isinstance(facts.get("record"), dict):
        yield "the record is missing"


def _check_nothing(store: Store, unit: str, facts: dict[str, Any]) -> Iterator[str]:
    return iter(())


CHECKS: dict[str, Callable[[Store, str, dict[str, Any]], Iterator[str]]] = {
    "take": _check_take,
    "processed": _check_dataset,
    "weights": _check_dataset,
    "tier": _check_tier,
    "document": _check_document,
    "rig": _check_rig,
    "model": _check_learned,
    "prior": _check_learned,
    "signer": _check_signer,
}


def _read_arrays(store: Store, header: dict[str, Any], path: Callable[[str], str]) -> dict[str, NDArray]:
    stored = [name for name in header["variables"] if name not in header["texts"] and name not in header["clocks"]]
    for name in stored:
        if read_attributes(store, path(name)) is None:
            raise CorpusError(f"its array {name!r} is missing")
    return {name: read_array(store, path(name))[0] for name in stored}


def _compare(found: str, recorded: str, what: str = "fingerprint") -> Iterator[str]:
    if found != recorded:
        yield f"its bytes are not those that were stored ({what} {found[:12]}…, recorded {recorded[:12]}…)"


def _shapes(rig: dict[str, Any] | None) -> Any:
    return None if rig is None else json.loads(json.dumps(rig["header"]["texts"].get("shape")))


def _rig_input(facts: dict[str, Any]) -> Any:
    return ((facts.get("provenance") or {}).get("inputs") or {}).get("rig")
