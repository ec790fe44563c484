"""The page of the study of labels: tables, what limits each method, and what the numbers do not say."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from labels_study_plots import DIFFICULTIES, of_all_takes
from labels_study_text import HEAD, LABELLERS, LIMITS, PARTS, PICTURES, READING, SHORT, THESIS
from mimique.workbench.pipeline.evaluation_tables import join_intervals

Results = dict[str, dict[str, Any]]

ASKED = 3.0
"""Points of F1@50 by which the best temporal labeller is to beat the best merged per-frame one."""


def write_page(path: Path, results: Results, drawn: Sequence[str], missing: Sequence[str]) -> None:
    """Write the page from the pieces that are there; what was not run is listed at its end."""
    parts = [HEAD, _short(results), "## The corpora\n", _corpora(results)]
    parts += [
        "## Labellers on signers they never saw\n",
        LABELLERS,
        _headline(results),
        _picture("labels_f1.png", drawn),
    ]
    for name in (one for one in DIFFICULTIES if f"labellers-{one}" in results):
        parts += [f"### Difficulty {name}\n", _labellers(results[f"labellers-{name}"])]
    parts += [_picture("labels_borders.png", drawn), _trainings(results)]
    parts += ["## What limits each method\n", _limits(results), LIMITS]
    parts += ["## The thesis's protocol\n", THESIS, _picture("labels_figure_4_4.png", drawn)]
    for name in (one for one in DIFFICULTIES if f"reverdy2019-{one}" in results):
        parts += [f"### Per signer, difficulty {name}\n", _classifiers(results[f"reverdy2019-{name}"])]
    if "across-signers-medium" in results:
        parts += [
            "### Across signers, ten signers, difficulty medium\n",
            _classifiers(results["across-signers-medium"]),
        ]
    for part, (title, text) in PARTS.items():
        if part in results:
            parts += [f"## {title}\n", text, _own(results[part])]
            parts += [_picture("labels_reliability.png", drawn)] if part == "confidence" else []
    parts += ["## How to read the numbers\n", READING, _times(results)]
    if missing:
        parts.append(f"Not run for this page: {', '.join(missing)}.\n")
    path.write_text("\n".join(part for part in parts if part), encoding="utf-8")


def markdown(table: pd.DataFrame, intervals: bool = True) -> str:
    """Return a table in Markdown, with intervals in brackets."""
    shown = join_intervals(table) if intervals else table
    rows = [list(shown.columns), ["---"] * shown.shape[1], *shown.astype(str).to_numpy().tolist()]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows) + "\n"


def _picture(name: str, drawn: Sequence[str]) -> str:
    return f"![{PICTURES[name]}](images/{name})\n" if name in drawn else ""


def _corpora(results: Results) -> str:
    tables = [record["tables"]["corpus"] for piece, record in results.items() if piece.startswith("corpus-")]
    return markdown(pd.concat(tables).drop(columns="corpus").round(0)) if tables else "None is finished.\n"


def _short(results: Results) -> str:
    """What was asked, beside what was found, at the middle difficulty."""
    rows: list[tuple[str, str, str]] = []
    tables = {piece: record["tables"] for piece, record in results.items()}
    compared = tables.get("labellers-medium", {})
    if len(compared.get("differences", ())):
        row = of_all_takes(compared["differences"]).iloc[0]
        what = f"{row['rater']} less {row['against']}, F1@50, signers never seen"
        rows.append((what, "3 points", f"{100 * row['difference']:+.1f} ({_span(row.to_dict(), 'difference')})"))
    if len(compared.get("times", ())):
        slowest = compared["times"]["times_real_time_cpu"].min()
        rows.append(("labelling, slowest labeller", "1000 × real time", f"{slowest:.0f} × (processor time)"))
    sure = tables.get("confidence", {})
    for row in sure.get("calibration", pd.DataFrame()).to_dict("records"):
        what = f"{row['method']}, {row['segmentation']} segments: calibration error; Brier; log loss"
        found = "; ".join(f"{row[f'{k}_before']:.3f} → {row[f'{k}_after']:.3f}" for k in ("ece", "brier", "log_loss"))
        rows.append((what, "0.05; better; better", found))
    queue = sure.get("queue", pd.DataFrame({"order": []}))
    for (method, cut), own in queue[queue["order"] == "expected gain"].groupby(["method", "segmentation"], sort=False):
        found = ", ".join(f"{100 * row['saved']:.0f} % to {row['target']:g}" for row in own.to_dict("records"))
        rows.append((f"looks saved by the queue to reach a macro F1, {method}, {cut} segments", "40 %", found))
    mistakes = sure.get("mistakes", pd.DataFrame({"annotators": []}))
    for count, own in mistakes.groupby("annotators"):
        f1 = own.set_index("problem")["f1"]
        found = f"**{f1['all']:.3f}**: " + ", ".join(f"{name} {f1[name]:.2f}" for name in f1.index if name != "all")
        who = "one annotator" if count == 1 else "a second annotator as witness"
        rows.append((f"planted mistakes found, F1, {who}", "0.9", found))
    oracle = sure.get("oracle", pd.DataFrame({"f1": []}))
    if len(oracle):
        ends = f"{oracle['f1'].min():.2f} to {oracle['f1'].max():.2f}"
        rows.append(("shifted borders, by one who knows the true borders", "–", ends))
    if not rows:
        return ""
    return "## In short\n\n" + markdown(pd.DataFrame(rows, columns=["what", "asked", "found"]), intervals=False) + SHORT


def _headline(results: Results) -> str:
    """What was asked, beside what was found, difficulty by difficulty."""
    rows = []
    for name in DIFFICULTIES:
        table = results.get(f"labellers-{name}", {}).get("tables", {}).get("differences", pd.DataFrame())
        if not len(table):
            continue
        for row in of_all_takes(table).head(1).to_dict("records"):
            reached = 100 * row["difference"] >= ASKED
            sure = 100 * row["difference_low"] >= ASKED
            rows.append(
                {
                    "difficulty": name,
                    "best temporal": row["rater"],
                    "best merged per-frame": row["against"],
                    "difference in F1@50, points": f"{100 * row['difference']:+.1f}",
                    "95 % over takes": _span(row, "difference"),
                    "95 % over signers": _span(row, "difference_signers"),
                    f"asked: {ASKED:.0f}": "missed" if not reached else "reached, interval too" if sure else "reached",
                }
            )
    if not rows:
        return ""
    return markdown(pd.DataFrame(rows), intervals=False) + (
        "\nWhich two are compared was read from these very scores, which favours both; the other temporal labellers "
        "are in the tables below.\n"
    )


def _span(row: dict[str, Any], name: str) -> str:
    low, high = row[f"{name}_low"], row[f"{name}_high"]
    return "–" if low is None or high is None or np.isnan(low) else f"{100 * low:+.1f} to {100 * high:+.1f}"


def _labellers(record: dict[str, Any]) -> str:
    tables = record["tables"]
    parts = []
    for title in ("frames", "segments"):
        some = of_all_takes(tables[title]).drop(columns=["reading", "takes"])
        parts.append(markdown(some.drop(columns=["n_takes", "n_signers", "n_frames", "n_missed"], errors="ignore")))
    borders = of_all_takes(tables["borders"])
    rows = []
    for rater, some in borders.groupby("rater", sort=False):
        row = {"borders": rater}
        for one in join_intervals(some.drop(columns=["reading", "takes"])).to_dict("records"):
            row[f"P, R, F1 within {one['within frames']}"] = (
                f"{one['precision'].split(' ')[0]}, {one['recall'].split(' ')[0]}, {one['f1']}"
            )
        rows.append(row)
    parts.append(markdown(pd.DataFrame(rows), intervals=False))
    parts.append(markdown(of_all_takes(tables["differences"]).drop(columns=["reading", "takes"])))
    parts.append(markdown(tables["classes"]))
    parts.append(markdown(tables["times"]))
    return "\n".join(parts) + "\n" + "".join(f"- {note}\n" for note in record["notes"])


def _trainings(results: Results) -> str:
    """F1@50 of the networks, one training beside the other, less the merged labeller of the table above."""
    if "labellers-medium" not in results:
        return ""
    first = results["labellers-medium"]["tables"]
    base = of_all_takes(first["differences"])
    rows: dict[str, dict[str, str]] = {}
    found: dict[str, list[float]] = {}
    for piece in ("labellers-medium", *(piece for piece in results if piece.startswith("training-"))):
        table = of_all_takes(results[piece]["tables"]["segments"])
        own = piece.split("-", 2)
        seed, names = ("0", None) if piece == "labellers-medium" else (own[1], own[2])
        for row in table.to_dict("records"):
            if row["kind"] == "temporal" and (names is None or row["rater"] == names):
                rows.setdefault(row["rater"], {"labeller": row["rater"]})[f"seed {seed}"] = f"{row['f1_50']:.3f}"
                found.setdefault(row["rater"], []).append(row["f1_50"])
    rows = {name: row for name, row in rows.items() if len(found[name]) > 1}
    if not rows or not len(base):
        return ""
    against = base.iloc[0]
    merged = of_all_takes(first["segments"]).set_index("rater").loc[against["against"], "f1_50"]
    for name, row in rows.items():
        points = [100 * (value - merged) for value in found[name]]
        row[f"less {against['against']}, points"] = f"{min(points):+.1f} to {max(points):+.1f}"
    return (
        "### Several trainings of the networks, difficulty medium\n\n"
        "F1@50 on the same folds, from other first parameters and windows.\n\n"
        + markdown(pd.DataFrame(rows.values()).fillna("–"), intervals=False)
    )


def _limits(results: Results) -> str:
    """What the numbers of the middle difficulty (or the one that is there) say about each rater's weak spot."""
    name = next((one for one in ("medium", *DIFFICULTIES) if f"labellers-{one}" in results), None)
    if name is None:
        return ""
    tables = results[f"labellers-{name}"]["tables"]
    segments, parts, mistakes = (of_all_takes(tables[title]) for title in ("segments", "parts", "mistakes"))
    rows = []
    for row in segments.to_dict("records"):
        own = parts[(parts["rater"] == row["rater"]) & (parts["part"] == "protocol")]
        worst = own.loc[own["f1_50"].astype(float).idxmin()]
        signers = parts[(parts["rater"] == row["rater"]) & (parts["part"] == "signer")]["f1_50"]
        wrong = mistakes[mistakes["rater"] == row["rater"]].head(2)
        rows.append(
            {
                "rater": row["rater"],
                "F1@50": f"{row['f1_50']:.3f}",
                "stable segments only": f"{row['f1_50_stable']:.3f}",
                "weakest protocol": f"{worst['of']} ({worst['f1_50']:.2f})",
                "weakest to best signer": f"{signers.min():.2f} to {signers.max():.2f}",
                "most frequent confusions (of the reference's time)": "; ".join(
                    f"{one['reference']} → {one['answer']} {100 * one['share']:.0f} %"
                    for one in wrong.to_dict("records")
                ),
                "borders off by, ms": f"{row['distance_ms']:.0f}",
            }
        )
    return f"Difficulty {name}, simulated.\n\n" + markdown(pd.DataFrame(rows), intervals=False)


def _classifiers(record: dict[str, Any]) -> str:
    columns = ["classifier", "segmentation", "n_segments"]
    for score in ("accuracy", "accuracy_duration", "macro_f1"):
        columns += [score, f"{score}_low", f"{score}_high"]
    scores, people = record["tables"]["scores"], record["tables"]["people"]
    parts = [markdown(scores[scores["signer"] == "all"][[*columns, "majority", "majority_duration", "chance"]])]
    if len(people):
        chosen = people[(people["signer"] == "all") & (people["kind"] == "person")]
        columns = ["reading", "rater", "segmentation", "n_segments"]
        for score in ("accuracy", "accuracy_duration", "macro_f1", "kappa"):
            columns += [score, f"{score}_low", f"{score}_high"]
        parts.append("The second annotator on the same segments:\n\n" + markdown(chosen[columns]))
    classes = record["tables"]["classes"]
    parts.append(markdown(classes[classes["signer"] == "all"].drop(columns="signer")))
    return "\n".join(parts) + "".join(f"\n- {note}" for note in record["notes"]) + "\n"


def _own(record: dict[str, Any], most: int = 60) -> str:
    """Tables and notes of a part that states its own."""
    parts = []
    for name, table in record["tables"].items():
        if len(table):
            more = f"\nThe first {most} of {len(table)} rows.\n" if len(table) > most else ""
            parts.append(f"### {name.replace('_', ' ').capitalize()}\n\n{markdown(table.head(most))}{more}")
    return "\n".join(parts) + "\n" + "".join(f"- {note}\n" for note in record["notes"])


def _times(results: Results) -> str:
    spent = sum(record["seconds"] for record in results.values())
    return f"All pieces of this page took {spent / 60:.0f} minutes, on a machine that was shared.\n"
