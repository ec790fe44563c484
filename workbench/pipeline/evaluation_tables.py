"""An evaluation as text for people, as JSON for scripts, and as CSV files.

The two protocols of :func:`~.evaluating.evaluate` have tables of their own form. All others give a
:class:`TableResult`: tables by name, and notes; ``x_low`` and ``x_high`` beside ``x`` are the ends of its interval.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd

from ...errors import InputError
from ..text_files import write_text
from .evaluating import CorpusEvaluation
from .model_cards import format_interval

__all__ = [
    "TableResult",
    "check_csv",
    "format_evaluation",
    "format_tables",
    "join_intervals",
    "tables_to_json",
    "to_json",
    "write_csv",
    "write_tables",
]

GROUPS = ("signer", "segmentation")
SIMULATED = "simulated signers: these numbers say how the methods work, not how people are recognised"
TITLES = {
    "reverdy2019": "Per signer, as Reverdy 2019, Figure 4.4: trained on the signer's own takes",
    "across-signers": "Across signers: trained on all other signers' takes",
}


class TableResult(Protocol):
    """What an evaluation gives that is not one of classifiers on segments."""

    @property
    def tables(self) -> Mapping[str, pd.DataFrame]:
        """Tables by name."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences that a reader of the numbers should know."""


def format_tables(result: TableResult, protocol: str, simulated: bool) -> str:
    """Return the tables and notes as text; numbers with an interval carry it in brackets."""
    mark = " (simulated)" if simulated else ""
    whose = getattr(result, "annotator", "")
    parts = [SIMULATED] if simulated else []
    for name, table in result.tables.items():
        title = f"{protocol}: {name.replace('_', ' ')}{mark}{f'; reference: {whose}' if whose else ''}"
        parts.append(f"{title}\n{_text(join_intervals(table)) if len(table) else 'nothing'}")
    return "\n\n".join(parts + [f"note: {note}" for note in result.notes])


def tables_to_json(result: TableResult, protocol: str, snapshot: str, simulated: bool) -> str:
    """Return all tables as one JSON object; numbers that are not known are null."""
    record: dict[str, Any] = {"snapshot": snapshot, "simulated": simulated, "protocol": protocol}
    record["annotator"] = getattr(result, "annotator", None)
    record["tables"] = {name: _records(table) for name, table in result.tables.items()}
    return json.dumps({**record, "notes": list(result.notes)}, indent=2, ensure_ascii=False)


def write_tables(result: TableResult, path: Path, protocol: str, simulated: bool) -> list[Path]:
    """Write each table as ``…_name.csv`` beside the path; a column says what is simulated."""
    written = []
    for name, table in result.tables.items():
        target = path.with_name(f"{path.stem}_{name}{path.suffix}")
        write_text(target, table.assign(protocol=protocol, simulated=simulated).to_csv(index=False))
        written.append(target)
    return written


def format_evaluation(result: CorpusEvaluation, simulated: bool) -> str:
    """Return the scores, the class counts and the people beside the machine as text."""
    mark = " (simulated)" if simulated else ""
    parts = []
    if simulated:
        parts.append(SIMULATED)
    parts.append(f"{TITLES[result.protocol]}{mark}; reference: {result.annotator}\n" + _text(_score_table(result)))
    parts.append(f"Class counts{mark}: training frames, and tested segments\n" + _text(_class_table(result.classes)))
    if len(result.people):
        for reading, some in result.people.groupby("reading", sort=False):
            title = f"People and machine on the same segments{mark}, against {result.annotator}; annotated {reading}"
            parts.append(f"{title}\n" + _text(_people_table(some)))
    parts += [f"note: {note}" for note in result.notes]
    return "\n\n".join(parts)


def to_json(result: CorpusEvaluation, snapshot: str, simulated: bool) -> str:
    """Return all tables as one JSON object; numbers that are not known are null."""
    record: dict[str, Any] = {
        "snapshot": snapshot,
        "simulated": simulated,
        "protocol": result.protocol,
        "annotator": result.annotator,
        "results": _records(result.table),
        "classes": _records(result.classes),
        "people": _records(result.people),
        "notes": list(result.notes),
    }
    return json.dumps(record, indent=2, ensure_ascii=False)


def check_csv(path: Path) -> None:
    """Refuse a file that is no CSV, or a folder that is not there, before anything is computed."""
    if path.suffix.lower() != ".csv":
        raise InputError(f"--out {path}: expected a file that ends in .csv")
    if not path.absolute().parent.is_dir():
        raise InputError(f"--out {path}: there is no folder {path.absolute().parent}; make it first")


def write_csv(result: CorpusEvaluation, path: Path, simulated: bool) -> list[Path]:
    """Write the scores, and beside them ``…_classes.csv`` and ``…_people.csv``; a column says what is simulated."""
    written = []
    for ending, table in (("", result.table), ("_classes", result.classes), ("_people", result.people)):
        if len(table):
            target = path.with_name(f"{path.stem}{ending}{path.suffix}")
            marked = table.assign(protocol=result.protocol, annotator=result.annotator, simulated=simulated)
            write_text(target, marked.to_csv(index=False))
            written.append(target)
    return written


def _score_table(result: CorpusEvaluation) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "signer": row["signer"],
            "segments": row["segmentation"],
            "classifier": row["classifier"],
            "n": row["n_segments"],
            "per segment": format_interval(row, "accuracy"),
            "by duration": format_interval(row, "accuracy_duration"),
            "macro F1": format_interval(row, "macro_f1"),
            "majority": f"{row['majority']:.2f}",
            "by duration ": f"{row['majority_duration']:.2f}",
            "chance": f"{row['chance']:.2f}",
            "left out": row["left_out_transition"] + row["left_out_unlabelled"] + row["left_out_missing"],
        }
        for row in _in_groups(result.table).to_dict("records")
    )


def _class_table(classes: pd.DataFrame) -> pd.DataFrame:
    return classes.rename(columns={"n_train": "training", "n_manual": "manual", "n_automatic": "automatic"})


def _people_table(people: pd.DataFrame) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "signer": row["signer"],
            "segments": row["segmentation"],
            "rater": f"{row['rater']} (person)" if row["kind"] == "person" else row["rater"],
            "n": row["n_segments"],
            "per segment": format_interval(row, "accuracy"),
            "macro F1": format_interval(row, "macro_f1"),
            "kappa": format_interval(row, "kappa"),
            "kappa by duration": format_interval(row, "kappa_duration"),
            "left out": row["left_out"],
        }
        for row in _in_groups(people).to_dict("records")
    )


def _in_groups(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows with those of one signer and segmentation together, in the order of the table."""
    places = [table[column].map({name: k for k, name in enumerate(table[column].unique())}) for column in GROUPS]
    return table.iloc[np.lexsort([place.to_numpy() for place in reversed(places)])]


def _text(table: pd.DataFrame) -> str:
    return table.to_string(index=False)


def join_intervals(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table as text, with the ends of an interval behind its number."""
    shown = {}
    for name in table.columns:
        if str(name).endswith(("_low", "_high")) and str(name).rpartition("_")[0] in table.columns:
            continue
        cells = [_cell(value) for value in table[name]]
        if f"{name}_low" in table.columns and f"{name}_high" in table.columns:
            ends = zip(table[f"{name}_low"], table[f"{name}_high"], strict=True)
            cells = [
                cell if pd.isna(low) or pd.isna(high) else f"{cell} [{_cell(low)}, {_cell(high)}]"
                for cell, (low, high) in zip(cells, ends, strict=True)
            ]
        shown[str(name).replace("_", " ")] = cells
    return pd.DataFrame(shown)


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and np.isnan(value)):
        return "–"
    if isinstance(value, float):
        return f"{value:.1f}" if abs(value) >= 10 else f"{round(value, 3) + 0.0:.3f}"
    return str(value)


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    return list(json.loads(table.to_json(orient="records")))
