"""The parts of a layout report, the same on the page and on paper: figures with captions, tables, sentences."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ...errors import InputError
from ...models.layouts.named_sets import SOURCES
from ...synthesis.landmarks import FaceLandmarks
from ...synthesis.rig import Rig
from . import words
from .drawings import draw_layout_pictures, draw_region_faces
from .figures import (
    draw_curves,
    draw_labels,
    draw_losses,
    draw_reconstructions,
    draw_response,
    draw_stability,
    draw_symmetry,
)
from .numbers import (
    CHOSEN,
    LEARNED,
    LayoutStudyLike,
    find_table,
    pick_reconstruction,
    sort_methods,
    summarise_curves,
)
from .placement_sheet import PlacementSheet, make_placement_sheet
from .thesis_figures import draw_actors, draw_man_sets, draw_star_sets, draw_training

__all__ = ["LayoutFacts", "Part", "Section", "Sections", "flatten", "gather_sections"]

_CALLED = {
    "solver": "default weight solver",
    "sogp": "sparse Gaussian process regression",
    "thin shell": "thin shell alone",
}
MOST_FACES = 4


@dataclass(frozen=True)
class LayoutFacts:
    """Where a study comes from, and the face it is about.

    Parameters
    ----------
    corpus, snapshot, version, created
        Name of the corpus, its snapshot, the mimique version, and the time (as text).
    rig, rig_name
        The face that the layouts are for.
    simulated
        Whether the performances are simulated: titles and captions then say so.
    landmarks
        The rig's landmarks, where they were found before.
    head
        The rigid head markers, name to vertex; the study's own, or chosen for the rig, by default.
    parameters
        What is to be told beside the study's own parameters.
    """

    corpus: str
    snapshot: str
    version: str
    created: str
    rig: Rig
    rig_name: str
    simulated: bool = False
    landmarks: FaceLandmarks | None = None
    head: Mapping[str, int] | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Part:
    """One figure or table with its caption; a picture brings its own white paper."""

    caption: str
    figure: Figure | None = None
    table: pd.DataFrame | None = None
    picture: bool = False


@dataclass(frozen=True)
class Section:
    """Parts under one heading, with what is said before and after them."""

    anchor: str
    title: str
    parts: tuple[Part, ...]
    before: str = ""
    after: tuple[str, ...] = ()


@dataclass(frozen=True)
class Sections:
    """All that a report shows.

    Parameters
    ----------
    highlights
        Short name and value of what a reader looks for first.
    sheet
        The recommended layout in words.
    pictures
        The recommended layout on the face: front, then sides.
    sections
        The study.
    absent
        What is not there, and why.
    notes
        Of the study, the sheet and the pictures.
    """

    highlights: tuple[tuple[str, str], ...]
    sheet: PlacementSheet
    pictures: tuple[Part, ...]
    sections: tuple[Section, ...]
    absent: tuple[str, ...]
    notes: tuple[str, ...]


def gather_sections(study: LayoutStudyLike, facts: LayoutFacts) -> Sections:
    """Draw and describe everything that a study has.

    Raises
    ------
    InputError
        If the recommended layout is not among the layouts, or its vertices are not the rig's.
    """
    layout = study.layouts[study.layouts["layout"].astype(str) == study.recommended]
    if layout.empty:
        raise InputError(f"layout study: the recommended layout {study.recommended!r} is not among its layouts")
    head = facts.head or getattr(study, "head_markers", None) or None
    sheet = make_placement_sheet(facts.rig, layout, head=head, landmarks=facts.landmarks)
    rigid = dict(zip(sheet.head["marker"], sheet.head["vertex"].astype(int), strict=True))
    drawn = draw_layout_pictures(facts.rig, sheet.markers["vertex"].astype(int).tolist(), rigid)
    notes = [str(note) for note in study.notes] + list(sheet.notes)
    if drawn.blank:
        notes.append(f"The face behind the markers could not be drawn: {drawn.blank}")
    if drawn.unseen:
        notes.append(f"Markers {', '.join(drawn.unseen)} are seen from none of the three sides.")
    sections, absent = [], []
    for fill in _FILLERS:
        section = fill(study, facts)
        if isinstance(section, Section):
            sections.append(section)
        else:
            absent.append(section)
    return Sections(
        _find_highlights(study, layout),
        sheet,
        (
            Part(words.FRONT, figure=drawn.front, picture=True),
            Part(words.SIDES, figure=drawn.sides, picture=True),
        ),
        tuple(sections),
        tuple(absent),
        tuple(dict.fromkeys(notes)),
    )


def _find_highlights(study: LayoutStudyLike, layout: pd.DataFrame) -> tuple[tuple[str, str], ...]:
    out = [("recommended layout", study.recommended), ("markers on the face", str(len(layout)))]
    errors = find_table(study, "errors", "mean_mm", "reconstruction")
    if errors is not None:
        rows, _ = pick_reconstruction(errors, CHOSEN)
        unseen = rows[~rows["same_actor"].astype(bool)]
        rows, whose = (unseen, "on unseen actors") if len(unseen) else (rows, "on its own actors")
        own = summarise_curves(rows[rows["layout"].astype(str) == study.recommended], bands=False)
        if len(own):
            error, size = float(own["value"].iloc[0]), int(own["K"].iloc[0])
            out.append((f"mean error {whose}", f"{error:.2f} mm"))
            base = summarise_curves(rows[(rows["method"] == "k-means median") & (rows["K"] == size)], bands=False)
            if len(base):
                out.append((f"of k-means with {size}", f"{100 * error / float(base['value'].iloc[0]):.0f} %"))
        named = summarise_curves(rows[rows["method"].isin(["STAR", "MAN"])], bands=False)
        if len(named):
            best = named.loc[named["value"].idxmin()]
            out.append((f"best named set: {best['set']}", f"{best['value']:.2f} mm"))
    losses = find_table(study, "losses", "lost", "worst_mm")
    if losses is not None:
        own = losses[(losses["layout"].astype(str) == study.recommended) & (losses["lost"] == 1)]
        if len(own):
            out.append(("error, worst marker lost", f"{float(own['worst_mm'].mean()):.2f} mm"))
    return tuple(out)


def _fill_curves(study: LayoutStudyLike, facts: LayoutFacts) -> Section | str:
    errors = find_table(study, "errors", "method", "K", "mean_mm", "same_actor", "reconstruction", "tested_on", "take")
    if errors is None:
        return words.ABSENT["curves"]
    rows, name = pick_reconstruction(errors, CHOSEN)
    parts = [Part(words.CURVES.format(reconstruction=_CALLED.get(name, name)), figure=draw_curves(rows))]
    for known, some in rows.groupby("same_actor", sort=True):
        whose = "Actors in the training" if known else "Unseen actors"
        sized, named = tabulate_curves(some)
        for table in (sized, named):
            if len(table):
                parts.append(Part(f"{whose}: mean vertex error, mm, and its 95 % interval", table=table))
    if errors["reconstruction"].nunique() > 1:
        unseen = errors[~errors["same_actor"].astype(bool)]
        shown, actors = (unseen, "Unseen actors") if len(unseen) else (errors, "Actors in the training")
        methods: list[str] = [
            m for m in sort_methods(shown["method"]) if shown[shown["method"] == m]["K"].nunique() > 1
        ]
        first = ["greedy + swaps", "k-means median", "MAN"]
        wanted = [m for m in first if m in methods] or methods[:3]
        if wanted:
            figure = draw_reconstructions(shown, wanted)
            parts.append(Part(words.RECONSTRUCTIONS.format(actors=actors), figure=figure))
    return Section("curves", "Error against the number of markers", tuple(parts))


def tabulate_curves(errors: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return mean errors with their intervals as text: methods by numbers of markers, and the named sets."""
    found = summarise_curves(errors)
    found["text"] = [
        f"{v:.3f}" + (f" ({low:.3f}–{high:.3f})" if np.isfinite(low) else "")
        for v, low, high in zip(found["value"], found["low"], found["high"], strict=True)
    ]
    named = found["set"] != ""
    free = found[~named]
    table = free.pivot(index="method", columns="K", values="text").reindex(list(dict.fromkeys(free["method"])))
    table.columns = [f"{k} markers" for k in table.columns]
    sets = found.loc[named, ["set", "method", "K", "text"]].rename(columns={"K": "markers", "text": "mean error"})
    return table.fillna("–").reset_index(names="layout"), sets.reset_index(drop=True)


def _fill_thesis(study: LayoutStudyLike, facts: LayoutFacts) -> Section | str:
    errors = find_table(study, "errors", "method", "rmse_printed", "rmse_mm", "frames", "trained_on", "tested_on")
    if errors is None:
        return words.ABSENT["thesis"]
    rows, name = pick_reconstruction(errors, LEARNED)
    drawn: list[tuple[str, Callable[[pd.DataFrame], Figure | None]]] = [
        (words.FIGURE_3_3, draw_star_sets),
        (words.FIGURE_3_5, draw_man_sets),
        (words.FIGURE_3_7, draw_training),
        (words.FIGURE_3_8, draw_actors),
    ]
    parts = []
    for caption, draw in drawn:
        figure = draw(rows)
        if figure is not None:
            parts.append(Part(caption.format(reconstruction=_CALLED.get(name, name)), figure=figure))
    if not parts:
        return words.ABSENT["thesis"]
    sets = [s for s in dict.fromkeys(rows["set"].dropna().astype(str)) if s in SOURCES]
    told: dict[str, list[str]] = {}
    for one in sets:
        told.setdefault(SOURCES[one], []).append(one)
    after = tuple(f"{', '.join(some)}: {source}" for source, some in told.items())
    return Section("thesis", "The thesis's figures for this corpus", tuple(parts), words.SETS if sets else "", after)


def _fill_regions(study: LayoutStudyLike, facts: LayoutFacts) -> Section | str:
    regions = find_table(study, "regions", "layout", "region", "mean_mm")
    if regions is None:
        return words.ABSENT["regions"]
    rows, name = pick_reconstruction(regions, CHOSEN) if "reconstruction" in regions else (regions, "solver")
    unseen = rows[~rows["same_actor"].astype(bool)] if "same_actor" in rows else rows
    rows = unseen if len(unseen) else rows
    table = rows.groupby(["layout", "region"], sort=False)["mean_mm"].mean().unstack()
    size = dict(zip(rows["layout"], rows["K"], strict=True)) if "K" in rows else {}
    best = study.recommended
    wanted = [best, *_find_rival(rows, size.get(best)), "Face Robot 35", "Sign3D 60"]
    wanted += [n for n in table.index if "set" in rows and n in SOURCES]
    shown = [n for n in dict.fromkeys(wanted) if n in table.index][:MOST_FACES]
    parts = []
    if shown:
        figure = draw_region_faces(facts.rig, table.loc[shown], landmarks=facts.landmarks)
        if figure is not None:
            caption = words.REGIONS.format(reconstruction=_CALLED.get(name, name))
            parts.append(Part(caption, figure=figure, picture=True))
    order = [*shown, *[n for n in table.index if n not in shown]]
    parts.append(Part("Mean vertex error by region, mm", table=table.loc[order].round(3).reset_index()))
    return Section("regions", "Error by region", tuple(parts))


def _find_rival(rows: pd.DataFrame, size: int | None) -> list[str]:
    """Return k-means's layout of the recommended one's size, if it is there."""
    if size is None or "method" not in rows:
        return []
    same = rows[(rows["K"] == size) & (rows["method"] == "k-means median")]
    return [str(same["layout"].iloc[0])] if len(same) else []


def _fill_robustness(study: LayoutStudyLike, facts: LayoutFacts) -> Section | str:
    parts = []
    tried = [
        (table, column, text)
        for table, column, text in (
            (find_table(study, "noise", "noise_mm", "mean_mm", "K"), "noise_mm", "noise of a coordinate (mm)"),
            (find_table(study, "misplacement", "off_mm", "mean_mm", "K"), "off_mm", "marker off its place by (mm)"),
        )
        if table is not None
    ]
    if tried:
        parts.append(Part(words.RESPONSE, figure=draw_response(tried, study.recommended)))
    losses = find_table(study, "losses", "layout", "K", "lost", "mean_mm", "worst_mm")
    if losses is not None:
        parts.append(Part(words.LOSSES, figure=draw_losses(losses, study.recommended)))
        own = losses[losses["layout"].astype(str) == study.recommended]
        parts.append(Part("The recommended layout without some of its markers", table=own if len(own) else losses))
    return Section("robustness", "When something goes wrong", tuple(parts)) if parts else words.ABSENT["robustness"]


def _fill_stability(study: LayoutStudyLike, facts: LayoutFacts) -> Section | str:
    parts = []
    stability = find_table(study, "stability", "method", "K", "over", "jaccard", "jaccard_near")
    if stability is not None:
        parts.append(Part(words.STABILITY, figure=draw_stability(stability)))
        parts.append(Part("Jaccard index, exact / within 10 mm", table=_tabulate_stability(stability)))
    symmetry = find_table(study, "symmetry", "K", "trained_on_n_actors", "asymmetry_mm")
    if symmetry is not None:
        parts.append(Part(words.SYMMETRY, figure=draw_symmetry(symmetry)))
    return Section("stability", "Stability and symmetry", tuple(parts)) if parts else words.ABSENT["stability"]


def _tabulate_stability(stability: pd.DataFrame) -> pd.DataFrame:
    text = [f"{a:.2f} / {b:.2f}" for a, b in zip(stability["jaccard"], stability["jaccard_near"], strict=True)]
    table = stability.assign(text=text).pivot_table(
        index=["method", "over"], columns="K", values="text", aggfunc="first", sort=False
    )
    table.columns = [f"{k} markers" for k in table.columns]
    return table.fillna("–").reset_index()


def _fill_mismatch(study: LayoutStudyLike, facts: LayoutFacts) -> Section | str:
    table = find_table(study, "mismatch")
    if table is None:
        return words.ABSENT["mismatch"]
    names = {
        "error_mm": "error",
        "own_rig_mm": "with the actor's own rig",
        "every_vertex_mm": "with a marker on every vertex",
        "share_of_mismatch": "share that goes with the own rig",
        "share": "share that goes with the own rig",
    }
    part = Part("Mean vertex error, mm", table=table.round(3).rename(columns=names))
    return Section("mismatch", "What no layout can mend", (part,), words.MISMATCH)


def _fill_labels(study: LayoutStudyLike, facts: LayoutFacts) -> Section | str:
    labels = find_table(study, "labels", "layout", "K", "accuracy", "macro_f1")
    if labels is None:
        return words.ABSENT["labels"]
    parts = (
        Part(words.LABELS, figure=draw_labels(labels, study.recommended)),
        Part("Agreement of labels", table=labels.round(3)),
    )
    return Section("labels", "What the labels lose", parts)


def flatten(parameters: Mapping[str, Any]) -> dict[str, object]:
    """Return parameters with lists and mappings as text, so that each is one line."""
    out: dict[str, object] = {}
    for name, value in parameters.items():
        if isinstance(value, Mapping):
            out[str(name)] = ", ".join(f"{k}: {v}" for k, v in value.items())
        elif isinstance(value, list | tuple | set):
            out[str(name)] = ", ".join(str(v) for v in value)
        else:
            out[str(name)] = value
    return out


_FILLERS: tuple[Callable[[LayoutStudyLike, LayoutFacts], Section | str], ...] = (
    _fill_curves,
    _fill_regions,
    _fill_robustness,
    _fill_stability,
    _fill_mismatch,
    _fill_labels,
    _fill_thesis,
)
