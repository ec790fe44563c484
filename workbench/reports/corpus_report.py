"""The report: one HTML file that needs nothing else, to read on a screen, to send, and to print."""

from __future__ import annotations

import base64
from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from importlib import resources

import pandas as pd

from .corpus_data import ReportData, SegmentationExample
from .corpus_figures import draw_evaluation, draw_recording_times, draw_residuals, draw_segmentation
from .corpus_quality import Quality, draw_gaps, make_findings_table, make_quality_summary, make_shade_legend
from .tables import make_confusion_table, make_parameter_table, make_table, make_time_table

__all__ = ["ReportData", "SegmentationExample", "build_report"]


@dataclass(frozen=True)
class _Section:
    """A part of the report: where the table of contents leads, what stands above it, and what fills it."""

    anchor: str
    title: str
    fill: Callable[[_Page], str]  # empty where the data is absent
    absent: str  # what is then said, after "No section …:"
    computed: bool = True  # from the recordings, and so simulated where they are


class _Page:
    """The data, with figures numbered and captioned as they come."""

    def __init__(self, data: ReportData) -> None:
        self.data = data
        self._n_figures = 0

    def figure(self, svg: str, caption: str) -> str:
        """Return a figure; the caption is HTML, made here from escaped parts."""
        self._n_figures += 1
        return (
            f"<figure>{svg}<figcaption><b>Figure {self._n_figures}.</b> {self.simulated}{caption}</figcaption></figure>"
        )

    @property
    def simulated(self) -> str:
        """What a caption of computed things begins with."""
        return "Simulated data. " if self.data.simulated else ""


def build_report(data: ReportData) -> str:
    """Return a report as the text of one HTML page.

    Style and figures are inside it; it loads nothing. It reads in light and dark and prints. Sections without data
    are left out and named at the end of the summary.

    Parameters
    ----------
    data
        What is reported.

    Returns
    -------
    The page; write it as UTF-8.
    """
    page = _Page(data)
    bodies = [(section, section.fill(page)) for section in _SECTIONS]
    shown = [(section, body) for section, body in bodies if body]
    missing = [section for section, body in bodies if not body]
    badge = '<span class="badge">simulated</span>' if data.simulated else ""
    contents = "".join(f'<li><a href="#{s.anchor}">{escape(s.title)}</a></li>' for s, _ in shown)
    parts = [
        f'<section id="{s.anchor}"><h2>{escape(s.title)}{badge if s.computed else ""}</h2>{body}</section>'
        for s, body in shown
    ]
    absent = "".join(f'<p class="absent">Not in this report: {escape(s.absent)}</p>' for s in missing)
    style = resources.files(__package__).joinpath("report.css").read_text(encoding="utf-8")
    title = f"{data.corpus}: corpus report"
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="mimique {escape(data.version)}">
<title>{escape(title)}{" (simulated)" if data.simulated else ""}</title>
<style>
{style}</style>
</head>
<body>
<header>
<h1>{escape(data.corpus)}{badge}</h1>
<p class="byline">Corpus report, {escape(data.created)} · snapshot <code>{escape(data.snapshot)}</code> ·
mimique {escape(data.version)}</p>
</header>
{_summarise(data)}
<nav aria-label="Contents"><ol>{contents}</ol></nav>
{absent}
{"".join(parts)}
<footer>Made by mimique {escape(data.version)} from snapshot <code>{escape(data.snapshot)}</code>.
Affect colours after Okabe and Ito, chosen to be told apart by colour-blind readers.</footer>
</body>
</html>
"""


def _summarise(data: ReportData) -> str:
    facts: list[tuple[str, str]] = []
    takes = data.takes
    if takes is not None and len(takes):
        facts.append(("takes", str(len(takes))))
        if "signer" in takes:
            facts.append(("signers", str(takes["signer"].nunique())))
        if "seconds" in takes:
            facts.append(("recorded", _say_duration(float(takes["seconds"].sum()))))
        if "n_markers" in takes:
            low, high = int(takes["n_markers"].min()), int(takes["n_markers"].max())
            facts.append(("markers", str(low) if low == high else f"{low}–{high}"))
    if data.residuals is not None and len(data.residuals):
        facts.append(("median residual", f"{float(data.residuals['mean'].median()):.2f} mm"))
    if data.evaluation is not None and data.evaluation["accuracy"].notna().any():
        low, high = (round(100 * float(f(data.evaluation["accuracy"]))) for f in (pd.Series.min, pd.Series.max))
        facts.append(("accuracy", f"{low}–{high} %" if low < high else f"{low} %"))
    cells = "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in facts)
    notice = ""
    if data.simulated:
        notice = (
            '<p class="notice">Every recording in this corpus is simulated. The numbers below say how the pipeline '
            "behaves on the simulation, and nothing about people.</p>"
        )
    portrait = ""
    if data.portrait:
        encoded = base64.b64encode(data.portrait).decode("ascii")
        portrait = f'<figure><img alt="A frame of the film" src="data:image/png;base64,{encoded}"></figure>'
    return notice + (f'<dl class="facts">{cells}</dl>' if cells else "") + portrait


def _say_duration(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def _has_rows(table: pd.DataFrame | None) -> bool:
    return table is not None and len(table) > 0


def _fill_takes(page: _Page) -> str:
    takes = page.data.takes
    if takes is None or takes.empty:
        return ""
    text = ""
    if {"signer", "protocol", "seconds"} <= set(takes.columns):
        groups = takes.groupby(["signer", "protocol"], sort=False, dropna=False)["seconds"]
        overview = groups.agg(takes="size", seconds="sum").reset_index()
        text = make_table(overview, page.simulated + "Takes by signer and protocol.")
    return text + make_table(takes, page.simulated + "All takes", fold_beyond=12)


def _fill_quality(page: _Page) -> str:
    notes = "".join(f"<li>{escape(note)}</li>" for note in page.data.quality_notes)
    text = "" if page.data.quality is None else _show_quality(page, page.data.quality)
    if not notes:
        return text
    return f"{text}<h3>Notes on the solve</h3><ul>{notes}</ul>" if text else f"<ul>{notes}</ul>"


def _show_quality(page: _Page, quality: Quality) -> str:
    caption = (
        "Share of frames in which a marker is missing, take by take. Spikes and jumps leave a marker's own path within "
        "a frame or two; swapped markers bear each other's label for some frames."
    )
    picture = page.figure(draw_gaps(quality.markers) + make_shade_legend(), caption)
    findings = make_findings_table(quality.findings)
    return make_quality_summary(quality) + picture + (f"<h3>Findings</h3>{findings}" if findings else "")


def _fill_times(page: _Page) -> str:
    times = page.data.recording_times
    if times is None or times.empty:
        return ""
    caption = page.simulated + (
        "Recorded seconds per label according to the annotation, by signer and protocol (Reverdy 2019, Table B.1). "
        "Intensity 0 counts as neutral; a gap is time that nobody annotated."
    )
    return make_time_table(times, caption) + page.figure(draw_recording_times(times), "The same table, drawn to scale.")


def _fill_residuals(page: _Page) -> str:
    residuals = page.data.residuals
    if residuals is None or residuals.empty:
        return ""
    caption = (
        "Distance between the adapted markers and the face that was solved from them, mean and 95th percentile over "
        "all markers and frames of a take. A small residual says that the rig can follow the markers, not that the "
        "weights are the true ones."
    )
    return page.figure(draw_residuals(residuals), caption) + make_table(
        residuals, page.simulated + "Residuals of all takes", 12
    )


def _fill_example(page: _Page) -> str:
    example = page.data.example
    if example is None:
        return ""
    caption = (
        f"Take <code>{escape(example.take)}</code>: {escape(' and '.join(example.energies))}, with the tiers "
        f"{escape(', '.join(example.tiers)) or 'none'} below (after Reverdy 2019, Figure 4.3). Vertical lines are the "
        "last tier's boundaries; a box cut along its diagonal is a transition from one affect to another."
    )
    return page.figure(draw_segmentation(example), caption)


def _fill_evaluation(page: _Page) -> str:
    evaluation = page.data.evaluation
    if evaluation is None or evaluation.empty:
        return ""
    caption = (
        "Share of test segments that each classifier labels as the annotator did, on manual and on automatic segments "
        "(after Reverdy 2019, Figure 4.4). Whiskers: 95 % intervals, bootstrapped over takes (Wilson's where there are "
        "too few). Diamonds: the same share weighted by duration, because accuracy per segment rewards cutting too "
        "finely. Red: what always naming the most frequent label would reach. Dotted: a second annotator on the same "
        "segments, where there is one."
    )
    people = page.data.people
    humans = (
        ""
        if people is None or people.empty
        else "<h3>People and machines on the same segments</h3><p>Readings that began from a machine's proposals stand "
        "apart from those from scratch.</p>"
        + make_table(people, page.simulated + "Second annotators beside the classifiers", 30)
    )
    matrices = "".join(
        make_confusion_table(counts, page.simulated + title) for title, counts in page.data.confusions.items()
    )
    if matrices:
        matrices = (
            "<h3>Confusions</h3><p>Rows are the reference, columns what was predicted, in segments; shading is the "
            f'share of the row.</p><div class="matrices">{matrices}</div>'
        )
    return (
        page.figure(draw_evaluation(evaluation, people), caption)
        + make_table(evaluation, page.simulated + "All scores; in brackets 95 % intervals", 40)
        + humans
        + matrices
    )


def _fill_provenance(page: _Page) -> str:
    data = page.data
    text = (
        f"<p>Everything above was read from snapshot <code>{escape(data.snapshot)}</code> of the corpus "
        f"“{escape(data.corpus)}” with mimique {escape(data.version)}, {escape(data.created)}.</p>"
    )
    if data.parameters:
        text += "<h3>Parameters</h3>" + make_parameter_table(data.parameters)
    if _has_rows(data.history):
        assert data.history is not None
        text += "<h3>History</h3>" + make_table(data.history, "Snapshots", 12)
    return text


_SECTIONS = (
    _Section("takes", "Takes", _fill_takes, "takes; the corpus has none yet."),
    _Section("quality", "Quality", _fill_quality, "quality; nothing was checked."),
    _Section("times", "Recording times", _fill_times, "recording times; no take has been annotated."),
    _Section(
        "residuals", "Residuals of the solve", _fill_residuals, "residuals of the solve; no take has been solved."
    ),
    _Section(
        "segmentation",
        "Energies and segments",
        _fill_example,
        "an example of segmentation; no take has been segmented.",
    ),
    _Section(
        "evaluation", "Evaluation of the labels", _fill_evaluation, "an evaluation; no classifier has been tested."
    ),
    _Section("provenance", "Provenance", _fill_provenance, "provenance.", computed=False),
)
