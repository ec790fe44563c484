"""The study of marker layouts of a corpus (Reverdy 2019, ch. 3), and what becomes of its layouts."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...corpus import Corpus, write_take
from ...corpus.store.provenance import describe_step
from ...corpus.take import make_take
from ...errors import InputError, MimiqueError
from ...models.layouts import LayoutStudy, StudyPlan, run_study
from ...models.layouts.label_loss import measure_label_loss
from ...models.layouts.study_plan import CHOSEN, MEDIAN
from ...synthesis import Rig, write_marker_map
from ..progress import Reporter
from ..scratch import Scratch
from ..text_files import write_text
from .labelled_takes import choose_author, read_labelled_takes
from .layout_actors import Cast, gather_cast
from .rig_weights import read_rig_weights

__all__ = [
    "LayoutOptions",
    "describe_markers",
    "store_layout",
    "study_layouts",
    "write_layout_map",
    "write_layout_tables",
    "write_marker_labels",
]


@dataclass(frozen=True)
class LayoutOptions:
    """What a person can choose of a study.

    Parameters
    ----------
    rig, faces, range_of_motion, unseen
        See :func:`.gather_cast`.
    markers
        Number of markers to recommend; chosen by the study if left out.
    sets
        Named sets that must be compared; by default those that the rig can carry.
    quick
        Whether fewer sizes, seeds and frames do.
    mirror
        Whether a mirror symmetric layout is recommended.
    lids
        Whether chosen layouts may have markers on the lids.
    seed
        Of everything random.
    plan
        More of the plan, see :class:`.StudyPlan`.
    """

    rig: str | None = None
    faces: tuple[str, ...] = ()
    range_of_motion: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()
    markers: int | None = None
    sets: tuple[str, ...] = ()
    quick: bool = False
    mirror: bool = True
    lids: bool = False
    seed: int = 0
    plan: dict[str, Any] = field(default_factory=dict)

    def make_plan(self) -> StudyPlan:
        """Return the plan, with the wanted number of markers among its sizes."""
        more = {"mirror": self.mirror, "lids": self.lids, "named": self.sets, **self.plan}
        plan = StudyPlan.quick(**more) if self.quick else StudyPlan(**more)
        if self.markers is None:
            return plan
        if self.markers < 4:
            raise InputError(f"--markers: expected 4 or more, but got {self.markers}")
        return replace(plan, sizes=tuple(sorted({*plan.sizes, self.markers})), wanted=self.markers)


def study_layouts(
    corpus: Corpus, *, options: LayoutOptions | None = None, reporter: Reporter | None = None
) -> LayoutStudy:
    """Compare marker layouts on the rigs and performances of a corpus, which is only read.

    What an interrupted run has finished is kept beside the corpus and used again.

    Raises
    ------
    MimiqueError
        If the corpus has no rig or no weights, or what was asked for by name cannot be had.
    """
    options, reporter = options or LayoutOptions(), reporter or Reporter()
    plan = options.make_plan()
    cast = gather_cast(
        corpus,
        rig=options.rig,
        faces=options.faces or None,
        range_of_motion=options.range_of_motion or None,
        unseen=options.unseen or None,
    )
    roles = {"training": [a.name for a in cast.training], "unseen": [a.name for a in cast.unseen]}
    ranges = {"range_of_motion": list(options.range_of_motion), "seed": options.seed}
    what = describe_step("study layouts", inputs=cast.inputs, parameters={**asdict(plan), **roles, **ranges})
    kept = _Pieces(Scratch(corpus.path), what["fingerprint"])
    with reporter.stage("Studying layouts", 100, "%") as finished:
        study = run_study(
            cast.base,
            cast.training,
            cast.unseen,
            plan,
            rng=np.random.default_rng(options.seed),
            done=kept,
            progress=lambda name, share: finished(name, 100.0 * share),
        )
    labels, notes = _measure_labels(corpus, cast, study, plan, options.seed, kept, reporter)
    tables = study.tables if labels is None else {**study.tables, "labels": labels}
    study = replace(
        study,
        tables=tables,
        notes=(*cast.notes, *study.notes, *notes),
        parameters={**study.parameters, "rig": cast.rig_name, "snapshot": corpus.snapshot},
    )
    kept.drop()
    return study


def store_layout(
    corpus: Corpus, study: LayoutStudy, name: str, *, layout: str | None = None, author: str | None = None
) -> str:
    """Keep a layout, head markers included, as a marker map of its rig, in one commit; return what was done."""
    table = describe_markers(study, layout)
    rig, which = str(study.parameters["rig"]), layout or study.recommended
    parameters = {"layout": which, "map": name, "study": study.parameters}
    message = f"Keep the layout {which} as marker map {name!r} of {rig}"
    with corpus.transaction(message, command="layout", parameters=parameters, author=author) as edit:
        changed = edit.put_marker_map(rig, table, name)
    what = f"{len(table)} markers ({len(study.head_markers)} on the head)"
    if not changed:
        return f"marker map {name!r} of {rig}: unchanged, {what}"
    return f"marker map {name!r} of {rig}: {what}; use it with: mimique solve CORPUS --rig {rig} --map {name}"


def describe_markers(study: LayoutStudy, layout: str | None = None) -> pd.DataFrame:
    """Return ``marker, vertex`` of a layout, the head markers last; a vertex that has a marker gets no second one."""
    table = study.layout(layout)
    taken = set(table["vertex"])
    head = [(name, vertex) for name, vertex in study.head_markers.items() if vertex not in taken]
    extra = pd.DataFrame(head, columns=["marker", "vertex"]).astype({"marker": "str", "vertex": np.int64})
    return pd.concat([table.astype({"marker": "str", "vertex": np.int64}), extra], ignore_index=True)


def write_layout_map(study: LayoutStudy, path: Path, layout: str | None = None) -> Path:
    """Write a layout as a CSV ``marker,vertex``."""
    try:
        write_marker_map(path, describe_markers(study, layout))
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from error
    return path


def write_marker_labels(study: LayoutStudy, rig: Rig, path: Path, layout: str | None = None) -> Path:
    """Write a C3D whose labels are a layout's markers, in one frame at their places on the rig's neutral, mm."""
    if path.suffix.lower() != ".c3d":
        raise InputError(f"{path}: expected a file name that ends in .c3d")
    table = describe_markers(study, layout)
    take = make_take(rig.neutral[table["vertex"].to_numpy()][None], table["marker"].tolist(), 100.0)
    try:
        write_take(path, take)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from error
    return path


def write_layout_tables(study: LayoutStudy, folder: Path) -> list[Path]:
    """Write every table of a study, and its layouts, as CSV files into a folder."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror or error}); choose another place") from error
    written = []
    for title, table in {**study.tables, "layouts": study.layouts}.items():
        path = folder / f"{title}.csv"
        write_text(path, table.to_csv(index=False, lineterminator="\n"))
        written.append(path)
    return written


class _Pieces:
    """Finished pieces of one study, in the scratch folder."""

    def __init__(self, scratch: Scratch, fingerprint: str) -> None:
        self._scratch, self._fingerprint, self._used = scratch, fingerprint, set[str]()

    def get(self, name: str) -> dict[str, NDArray[Any]] | None:
        return self._scratch.get(self._key(name))

    def put(self, name: str, arrays: dict[str, NDArray[Any]]) -> None:
        with suppress(OSError):  # beside a corpus that can only be read nothing can be kept
            self._scratch.put(self._key(name), arrays)

    def drop(self) -> None:
        """Forget all of them."""
        with suppress(OSError):
            self._scratch.drop(self._used)

    def _key(self, name: str) -> str:
        key = hashlib.sha256(f"{self._fingerprint} {name}".encode()).hexdigest()
        self._used.add(key)
        return key


def _measure_labels(
    corpus: Corpus, cast: Cast, study: LayoutStudy, plan: StudyPlan, seed: int, kept: _Pieces, reporter: Reporter
) -> tuple[pd.DataFrame | None, list[str]]:
    """Measure what labels lose with only a layout's markers, where takes are labelled."""
    try:
        author = choose_author(corpus)
    except MimiqueError:
        return None, []
    wanted = {f"{m} {size}" for m in (MEDIAN, *CHOSEN) for size in plan.sizes}
    layouts = {
        str(name): rows["vertex"].to_numpy()
        for name, rows in study.layouts.groupby("layout", sort=False)
        if name in wanted
    }
    try:
        takes = [
            replace(take, weights=read_rig_weights(corpus, take.name, rig=cast.rig_name).weights)
            for take in read_labelled_takes(corpus, author)
            if f"weights {take.name}" in cast.inputs
        ]
        if not takes:
            return None, ["labels: no labelled take has weights of this rig"]
        tiers = [corpus.fingerprint(take.name, "tier", "affect", author) for take in takes]
        name = "labels " + " ".join(tiers)
        found = kept.get(name)
        if found is None:
            with reporter.stage("Labels with these markers", len(layouts), "layouts") as finished:
                table = measure_label_loss(
                    cast.base, cast.face_of, takes, layouts, noise=plan.noise, seed=seed, finished=finished
                )
            found = {column: table[column].to_numpy(dtype=None if column != "layout" else "U") for column in table}
            kept.put(name, found)
    except MimiqueError as error:
        return None, [f"labels: what they lose was not measured: {error}"]
    note = f"labels are those of {author}, on {len(takes)} takes; signers were apart in learning and testing"
    return pd.DataFrame(found), [note]
