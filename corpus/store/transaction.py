"""Changing a corpus: one transaction is one commit, all or nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from ...errors import ConflictError, NotFoundError
from ..take import check_take
from .arrays_io import encode_dataset, to_json, write_arrays
from .layout import markers_path, processed_path, take_path, tier_path, weights_path
from .nodes import delete_node, list_children, read_attributes, write_attributes, write_bytes, write_group
from .solved_weights import make_weights
from .tables import complete_table, fingerprint_table, pack_table
from .take_edit import TakeEdit
from .view import take_array_path

__all__ = ["Transaction"]


class Transaction(TakeEdit):
    """The edit that ``with corpus.transaction(message) as edit`` gives; reading from it sees its own changes.

    Every ``put_…`` returns whether it changed anything: what is already stored just so is not written again.

    Takes, what was computed from them and what people say of them are put here; what is kept beside a take in
    :mod:`.take_edit`; rigs, vocabularies, signers and what was learned in
    :mod:`.library_edit`.
    """

    def put_take(self, take: str, dataset: xr.Dataset, *, replace: bool = False) -> bool:
        """Store a take.

        Parameters
        ----------
        take
            Its name.
        dataset
            See :mod:`mimique.corpus.take`. Positions are stored as float32.
        replace
            Whether another take of that name gives way. What was computed from its positions (processed, weights)
            is deleted with them and stays in the history; its tiers and documents are kept.

        Raises
        ------
        InputError
            If it is no usable take.
        ConflictError
            If another take of that name is there and ``replace`` is not set, or tiers reach beyond the new take.
        """
        path = take_path(take)
        check_take(dataset, without_markers=True)
        ordered = dataset
        if dataset["position"].dims != ("time", "marker", "space") or dataset["position"].dtype != np.float64:
            position = dataset["position"].transpose("time", "marker", "space").astype(np.float64)
            ordered = dataset.assign(position=position)
        encoded = encode_dataset(ordered, where=f"take {take!r}")
        facts = {
            "attributes": encoded.header["attributes"],
            "n_frames": dataset.sizes["time"],
            "n_markers": dataset.sizes["marker"],
            "fingerprint": encoded.fingerprint,
        }
        old = read_attributes(self._store, path)
        if old is not None:
            if all(old.get(key) == value for key, value in facts.items()):
                return False
            if not replace:
                source = old["attributes"].get("source_file")
                raise ConflictError(
                    f"take {take!r}: another one{f' (from {source})' if source else ''} has this name; "
                    "replace it, or choose another name"
                )
            if old["fingerprint"] == encoded.fingerprint:  # only what is known of it changed, not the recording
                kept = {key: value for key, value in old.items() if key not in facts}
                with self._writing(path, f"take {take!r}"):
                    write_attributes(self._store, path, {**facts, **kept})
                return True
            self._check_tiers_fit(take, n_frames=dataset.sizes["time"])
        with self._writing(path, f"take {take!r}", whole=old is not None):
            for child in list_children(self._store, path) if old is not None else ():
                if child not in ("tiers", "documents"):  # people's work stays
                    delete_node(self._store, f"{path}/{child}")
            write_group(self._store, path, facts)
            write_arrays(self._store, encoded, {name: take_array_path(take, name) for name in encoded.arrays})
            header = {key: value for key, value in encoded.header.items() if key != "attributes"}
            write_attributes(self._store, markers_path(take), header)
        return True

    def delete_take(self, take: str) -> None:
        """Delete a take with all that belongs to it; it stays in the history.

        Raises
        ------
        NotFoundError
            If there is no such take.
        """
        self._take_facts(take)
        with self._writing(take_path(take), f"take {take!r}", whole=True):
            delete_node(self._store, take_path(take))

    def put_processed(
        self, take: str, step: str, dataset: xr.Dataset, *, provenance: Mapping[str, Any] | None = None
    ) -> bool:
        """Store what a processing step made of a take: any dataset of numbers and text, floats as float32.

        Raises
        ------
        NotFoundError
            If there is no such take.
        """
        self._depend_on_take(take)
        where = f"take {take!r}, step {step!r}"
        return self._put_group(processed_path(take, step), encode_dataset(dataset, where=where), where, provenance)

    def put_weights(
        self,
        take: str,
        weights: xr.Dataset | xr.DataArray | ArrayLike,
        *,
        solve: str | None = None,
        shapes: Sequence[str] | None = None,
        residual: ArrayLike | None = None,
        rig: str | None = None,
        method: str | None = None,
        provenance: Mapping[str, Any] | None = None,
        current: bool = True,
    ) -> bool:
        """Store the weights of one solve of a take.

        Parameters
        ----------
        take
            Its name.
        weights
            (n_frames, n_shapes); or a DataArray ``(time, shape)``; or a Dataset with one named ``weights``.
        solve
            Name of the solve; ``<rig>-<method>`` where both are known, else "default".
        shapes
            Names of the columns where ``weights`` is a bare array; else those of the only rig of the corpus that
            has as many shapes, else ``shape_1`` …
        residual
            (n_frames,) mm, what the weights leave unexplained in each frame; optional.
        rig, method
            What it was solved on, and how; also read from the attributes of ``weights``.
        provenance
            From :func:`~.provenance.describe_step`.
        current
            Whether ``corpus.weights(take)`` gives these weights from now on.

        Raises
        ------
        NotFoundError
            If there is no such take.
        InputError
            If the sizes do not fit the take, or the names the columns.
        """
        facts = self._depend_on_take(take)
        dataset = make_weights(
            weights,
            self._times(take),
            shapes=shapes,
            guess_shapes=self._guess_shapes,
            residual=residual,
            where=f"take {take!r}, weights",
            attributes={"rate": facts["attributes"]["rate"], "rig": rig, "method": method},
        )
        if solve is None:
            named = "rig" in dataset.attrs and "method" in dataset.attrs
            solve = f"{dataset.attrs['rig']}-{dataset.attrs['method']}" if named else "default"
        where = f"take {take!r}, solve {solve!r}"
        changed = self._put_group(weights_path(take, solve), encode_dataset(dataset, where=where), where, provenance)
        return (self.set_current_solve(take, solve) if current else False) or changed

    def set_current_solve(self, take: str, solve: str) -> bool:
        """Make one of a take's solves the current one.

        Raises
        ------
        NotFoundError
            If the take or the solve is not there.
        """
        facts = self._take_facts(take)
        if facts.get("solve") == solve:
            return False
        if read_attributes(self._store, weights_path(take, solve)) is None:
            raise NotFoundError(self._missing_of_take(take, "solve", solve))
        with self._writing(take_path(take), f"take {take!r}"):
            write_attributes(self._store, take_path(take), {**facts, "solve": solve})
        return True

    def put_tier(
        self, take: str, tier: str, table: pd.DataFrame, author: str, *, provenance: Mapping[str, Any] | None = None
    ) -> bool:
        """Store one author's tier of a take, in place of what it was.

        Parameters
        ----------
        take, tier
            Names.
        table
            At least ``onset``, ``offset`` (whole frames, half-open) and ``label``; what else there can be, and how
            it is filled, is said in :func:`~.tables.complete_table`.
        author
            Whose tier it is; two authors' tiers of one name are two tiers.
        provenance
            Where it comes from, for what a model labelled.

        Raises
        ------
        NotFoundError
            If there is no such take.
        InputError
            If segments are empty, overlap or leave the take.
        """
        path = tier_path(take, tier, author)
        facts = self._depend_on_take(take)
        where = f"take {take!r}, tier {tier!r} by {author!r}"
        previous, old = self._read_tier(take, tier, author)
        full = complete_table(table, where=where, n_frames=facts["n_frames"], previous=previous)
        attributes = {
            "fingerprint": fingerprint_table(full),
            "segments": len(full),
            "provenance": to_json(provenance or {}, where=f"{where}, provenance"),
        }
        if old == attributes:
            return False
        data = pack_table(full, where=where)
        with self._writing(path, where):
            if old is not None and old["fingerprint"] == attributes["fingerprint"]:
                write_attributes(self._store, path, attributes)
                return True
            if old is None and read_attributes(self._store, path.rpartition("/")[0]) is None:
                write_group(self._store, path.rpartition("/")[0], {})
            write_bytes(self._store, path, data, attributes)
        return True

    def delete_tier(self, take: str, tier: str, author: str) -> None:
        """Delete one author's tier; it stays in the history.

        Raises
        ------
        NotFoundError
            If there is no such tier.
        """
        self.tier(take, tier, author)
        with self._writing(tier_path(take, tier, author), f"take {take!r}, tier {tier!r} by {author!r}"):
            delete_node(self._store, tier_path(take, tier, author))

    # What the public methods share.

    def _depend_on_take(self, take: str) -> dict[str, Any]:
        """Return what is known of a take, and remember that the edit is about this very recording."""
        facts = self._take_facts(take)
        self._log.depend(take_path(take), f"take {take!r}")
        return facts

    def _check_tiers_fit(self, take: str, *, n_frames: int) -> None:
        """Refuse a recording that is too short for what people said of the one before."""
        for row in self.tiers(take).itertuples():
            table = self.tier(take, str(row.tier), str(row.author))
            if len(table) and int(table["offset"].max()) > n_frames:
                raise ConflictError(
                    f"take {take!r}: tier {row.tier!r} by {row.author!r} reaches frame {table['offset'].max()}, but "
                    f"the new take has only {n_frames}; shorten or delete the tier first"
                )

    def _times(self, take: str) -> NDArray[np.float64]:
        header = read_attributes(self._store, markers_path(take)) or {}
        clock = header["clocks"].get("time")
        if clock is None:
            return np.asarray(self.take(take)["time"].values)
        return np.asarray(clock["start"] + np.arange(clock["n"]) / clock["rate"])

    def _guess_shapes(self, n_shapes: int) -> list[str]:
        fitting = []
        for rig in self.rigs():
            names = self._rig_facts(rig)["header"]["texts"].get("shape", [])
            if len(names) == n_shapes:
                fitting.append(list(names))
        return fitting[0] if len(fitting) == 1 else [f"shape_{n + 1}" for n in range(n_shapes)]
