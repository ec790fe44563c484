"""The page of the study of marker layouts: what the thesis found and whether it holds here, figures, tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure
from mimique.workbench.layout_reports.drawings import draw_layout_pictures, draw_region_faces
from mimique.workbench.layout_reports.figures import draw_curves, draw_losses, draw_reconstructions, draw_response
from mimique.workbench.layout_reports.layout_report import LayoutFacts
from mimique.workbench.layout_reports.numbers import CHOSEN, LEARNED, LayoutStudyLike, find_table, pick_reconstruction
from mimique.workbench.layout_reports.parts import tabulate_curves
from mimique.workbench.layout_reports.placement_sheet import make_placement_sheet
from mimique.workbench.layout_reports.thesis_figures import draw_actors, draw_man_sets, draw_star_sets, draw_training

HEAD = """# Marker layouts

How many markers a face needs, and where (Reverdy 2019, chapter 3), measured on real performances. Written by
`benchmarks/layouts_study.py --out`; for a corpus of your own run `mimique layout CORPUS --report layout.html`.

Performances were tracked by ARKit on people and drive the ICT FaceKit rig on several identities; the markers are
virtual, with noise.
"""
SHARED = "The identities share the rig's shapes, which is kinder than faces that move in ways of their own.\n"
OWN = (
    "Every identity moves in its own way: each shape is 0.7 to 1.3 times as strong, "
    "other in each of some soft regions.\n"
)
FINDINGS = (
    "That k-means does not beat the named sets has reasons: it looks at how trajectories resemble each other, not at "
    "what is lost without them; the sets are mirror symmetric as rebuilt here, and all but Sign3D have markers on the "
    "lids, where much of these performances happens and where chosen layouts put none unless asked. The thesis "
    "compared on four actors of its own, with sets whose exact points are not published.\n"
)
SETS = (
    "STAR and MAN sets are placed by anatomical names. Only MPEG-4's points follow a published list; the others are "
    "rebuilt by region and count, because no list was found. A comparison with them is one with sets of that size and "
    "kind.\n"
)
PRINTED = (
    "Reconstruction by {reconstruction}. The scale on the left is the RMSE as printed in (3.5): divided by frames, not "
    "by vertices. On the right it is divided by √P, in mm of a vertex.\n"
)
READING = (
    "Errors are mean distances of moving vertices, mm. Intervals are 95 % bootstrap intervals over pairs of a tested "
    "actor and a take; pairs are few, so they are too narrow. Layouts and settings are chosen on the range of motion "
    "of the training actors only.\n"
)
DPI = 130


def write_page(
    study: LayoutStudyLike,
    path: Path,
    pictures: Path,
    *,
    facts: LayoutFacts | None = None,
    findings: Sequence[tuple[str, str, str]] = (),
    own_shapes: bool = False,
) -> None:
    """Write the page and its pictures (``layouts_*.png``).

    ``findings`` are rows of the thesis's finding, whether it holds here, and the numbers that say so. The recommended
    layout is drawn and put into words where ``facts`` tell the rig.
    """
    pictures.mkdir(parents=True, exist_ok=True)
    parts = [HEAD, OWN if own_shapes else SHARED, _summarise(study, facts)]
    if findings:
        parts += ["## Do the thesis's findings hold?\n", _markdown(["finding", "here", "numbers"], findings), FINDINGS]
    parts += _tell_curves(study, pictures)
    parts += _tell_thesis(study, pictures)
    parts += _tell_regions(study, pictures, facts)
    parts += _tell_robustness(study, pictures)
    for name, title in (
        ("mismatch", "What no layout can mend"),
        ("stability", "Stability"),
        ("symmetry", "Symmetry"),
        ("labels", "Labels"),
    ):
        table = find_table(study, name)
        if table is not None:
            parts += [f"## {title}\n", _table(table)]
    parts += _tell_layout(study, pictures, facts)
    parts += ["## Parameters and notes\n", _markdown(["parameter", "value"], _parameters(study))]
    parts.append("\n".join(f"- {note}" for note in study.notes) + "\n")
    path.write_text("\n".join(parts), encoding="utf-8")


def _summarise(study: LayoutStudyLike, facts: LayoutFacts | None) -> str:
    where = f" mimique {facts.version}{f', {facts.created}' if facts.created else ''}." if facts else ""
    return f"Recommended here: **{study.recommended}**.{where}\n"


def _tell_curves(study: LayoutStudyLike, pictures: Path) -> list[str]:
    errors = find_table(study, "errors")
    if errors is None:
        return []
    rows, _ = pick_reconstruction(errors, CHOSEN)
    parts = ["## Error against the number of markers\n", READING, _save(draw_curves(rows), pictures, "curves")]
    for known, some in rows.groupby("same_actor", sort=True):
        parts.append(f"### {'Actors in the training' if known else 'Unseen actors'}\n")
        parts += [_table(table) for table in tabulate_curves(some) if len(table)]
    unseen = errors[~errors["same_actor"].astype(bool)]
    shown = unseen if len(unseen) else errors
    methods = [m for m in ("greedy + swaps", "k-means median", "MAN") if (shown["method"] == m).any()]
    if errors["reconstruction"].nunique() > 1 and methods:
        parts.append("### Three ways to make a face of the same markers\n")
        parts.append(_save(draw_reconstructions(shown, methods), pictures, "reconstructions"))
    return parts


def _tell_thesis(study: LayoutStudyLike, pictures: Path) -> list[str]:
    errors = find_table(study, "errors")
    if errors is None:
        return []
    rows, name = pick_reconstruction(errors, LEARNED)
    parts = ["## Figures 3.3, 3.5, 3.7 and 3.8\n", PRINTED.format(reconstruction=name), SETS]
    for title, draw, file in (
        ("Figure 3.3: STAR sets, same actor in training and test", draw_star_sets, "figure_3_3"),
        ("Figure 3.5 (a): MAN sets by size, same actor", draw_man_sets, "figure_3_5"),
        ("Figure 3.7: k-means learned from one actor and from several", draw_training, "figure_3_7"),
        ("Figure 3.8: STAR, MAN and k-means", draw_actors, "figure_3_8"),
    ):
        figure = draw(rows)
        if figure is not None:
            parts += [f"{title}:\n", _save(figure, pictures, file)]
    return parts


def _tell_regions(study: LayoutStudyLike, pictures: Path, facts: LayoutFacts | None) -> list[str]:
    regions = find_table(study, "regions")
    if regions is None:
        return []
    rows, _ = pick_reconstruction(regions, CHOSEN)
    unseen = rows[~rows["same_actor"].astype(bool)]
    rows = unseen if len(unseen) else rows
    table = rows.groupby(["layout", "region"], sort=False)["mean_mm"].mean().unstack()
    size = str(study.recommended).rpartition(" ")[2]
    wanted = [study.recommended, f"k-means median {size}", "Face Robot 35", "SignCom 41", "MPEG-4 53", "Sign3D 60"]
    shown = table.loc[[name for name in dict.fromkeys(wanted) if name in table.index]]
    parts = ["## By region (after Figure 3.4)\n"]
    if facts is not None and len(shown):
        figure = draw_region_faces(facts.rig, shown.iloc[:4], landmarks=facts.landmarks)
        if figure is not None:
            parts.append(_save(figure, pictures, "regions"))
    return [*parts, _table((shown if len(shown) else table).reset_index())]


def _tell_robustness(study: LayoutStudyLike, pictures: Path) -> list[str]:
    tried = [
        (table, column, text)
        for name, column, text in (
            ("noise", "noise_mm", "noise of a coordinate (mm)"),
            ("misplacement", "off_mm", "marker off its place by (mm)"),
        )
        if (table := find_table(study, name)) is not None
    ]
    parts = ["## When something goes wrong\n"] if tried else []
    if tried:
        parts.append(_save(draw_response(tried, study.recommended), pictures, "response"))
    losses = find_table(study, "losses")
    if losses is not None:
        parts.append(_save(draw_losses(losses, study.recommended), pictures, "losses"))
    return parts


def _tell_layout(study: LayoutStudyLike, pictures: Path, facts: LayoutFacts | None) -> list[str]:
    if facts is None:
        return []
    layout = study.layouts[study.layouts["layout"] == study.recommended]
    head = facts.head or getattr(study, "head_markers", None) or None
    sheet = make_placement_sheet(facts.rig, layout, head=head, landmarks=facts.landmarks)
    rigid = dict(zip(sheet.head["marker"], sheet.head["vertex"].astype(int), strict=True))
    drawn = draw_layout_pictures(facts.rig, sheet.markers["vertex"].astype(int).tolist(), rigid)
    columns = ["number", "place", "region", "partner", "nearest"]
    return [
        "## The recommended layout\n",
        _save(drawn.front, pictures, "front"),
        _save(drawn.sides, pictures, "sides"),
        _table(sheet.markers[columns]),
        _table(sheet.head[["number", "marker", "place"]]),
    ]


def _parameters(study: LayoutStudyLike) -> list[tuple[str, str]]:
    return [(str(name), str(value).replace("|", "/")) for name, value in study.parameters.items()]


def _save(figure: Figure, folder: Path, name: str) -> str:
    figure.set_facecolor("white")
    figure.savefig(folder / f"layouts_{name}.png", dpi=DPI)
    return f"![{name.replace('_', ' ')}]({folder.parent.name}/{folder.name}/layouts_{name}.png)\n"


def _table(table: pd.DataFrame) -> str:
    shown = table.copy()
    for column in shown.select_dtypes("float"):
        shown[column] = [f"{v:.3f}" if v == v else "–" for v in shown[column]]
    return _markdown([str(c) for c in shown.columns], shown.astype(str).to_numpy().tolist())


def _markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [list(head), ["---"] * len(head), *(list(row) for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"
