"""Model cards: what a stored model is, in Markdown, for people who are asked to believe its labels.

The form follows M. Mitchell and others, "Model cards for model reporting" (2019): what it is, what it learned from, how
it was tested, and what it must not be used for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...corpus.store.view import CorpusView

__all__ = ["write_model_card"]

METHODS = {
    "1-nn": "the nearest training frame (1-NN, Euclidean distance between weights)",
    "3-nn": "a vote of the three nearest training frames (3-NN, Euclidean distance between weights)",
    "linear-svm": "a linear support vector machine, one class against the rest, on standardised weights",
    "rbf-svm": "a support vector machine with a Gaussian kernel, on standardised weights",
    "random-forest": "a random forest",
    "per-frame-forest": "a random forest that names single frames",
    "per-frame-linear": "a logistic regression that names single frames",
    "forest-merging": "a random forest of frames, with equal neighbours merged and a least duration",
    "linear-merging": "a logistic regression of frames, with equal neighbours merged and a least duration",
    "hmm": "a hidden Markov chain over a random forest of frames",
    "crf": "a linear-chain conditional random field over a random forest of frames",
    "lstm": "a network with long short-term memory that reads the take in both directions",
    "gru": "a network of gated recurrent units that reads the take in both directions",
    "tcn": "a network of dilated convolutions over time",
}
SCORES = (
    ("accuracy", "accuracy per segment"),
    ("accuracy_duration", "accuracy by duration"),
    ("macro_f1", "macro F1"),
)
FRAME_SCORES = (
    ("accuracy", "accuracy per frame"),
    ("macro_f1", "macro F1 per frame"),
    ("f1_10", "F1@10"),
    ("f1_25", "F1@25"),
    ("f1_50", "F1@50"),
    ("edit", "edit score"),
)
"""Of labellers in time, which find their segments themselves."""


def write_model_card(corpus: CorpusView, name: str) -> str:
    """Return the card of a stored model as Markdown, ending in a newline.

    Raises
    ------
    NotFoundError
        If there is no such model.
    """
    facts = corpus.model_metadata(name)
    parts = [f"# Model {name}{' (simulated)' if _is_simulated(corpus, facts) else ''}"]
    parts += [
        _say_what(facts),
        _say_training(facts),
        _say_tests(facts),
        _say_calibration(facts),
        _say_limits(corpus, facts),
        _say_versions(facts),
    ]
    return "\n\n".join(parts) + "\n"


def _say_what(facts: Mapping[str, Any]) -> str:
    classifier = str(facts["classifier"])
    method = METHODS.get(classifier, classifier)
    if "labeller" in facts:
        moving = " and transitions between them" if facts.get("transitions") else ""
        return (
            f"Finds held expressions ({', '.join(facts['classes'])}){moving} in a take, from its "
            f"{len(facts.get('shapes') or ())} weights at {facts.get('rate'):g} frames per second, by {method}."
        )
    return (
        f"Gives a segment of a take one of the labels {', '.join(facts['classes'])}, from the mean of its "
        f"{len(facts.get('shapes') or ())} weights, by {method} (Reverdy 2019, 4.4.3)."
    )


def _say_training(facts: Mapping[str, Any]) -> str:
    across = facts.get("held_out_signer")
    unit = "labelled frames" if "labeller" in facts else "samples"
    signers = facts.get("signers") or [facts.get("signer")]
    lines = [
        "## What it learned from",
        "",
        f"- Signers: {', '.join(map(str, signers))}" + (f"; signer {across} was held out" if across else ""),
        f"- Protocols: {', '.join(facts.get('protocols', ()))}; reference tier 'affect' by {facts.get('annotator')}",
        f"- Takes ({len(facts.get('takes', ()))}): {_enumerate(facts.get('takes', ()))}",
        f"- Snapshot: {facts.get('snapshot')}",
    ]
    counts = facts.get("class_counts") or {}
    if counts:
        total = sum(counts.values())
        lines.append(
            f"- {unit.capitalize()}: {total}: " + ", ".join(f"{label} {count}" for label, count in counts.items())
        )
    own = (facts.get("labeller") or facts).get("parameters", {})
    shown = {**{key: value for key, value in own.items() if value is not None}, "seed": facts.get("seed")}
    shown |= {"device": facts["device"]} if facts.get("versions", {}).get("torch") else {}
    lines.append("- Parameters: " + ", ".join(f"{key} {value}" for key, value in shown.items()))
    return "\n".join(lines)


def _say_tests(facts: Mapping[str, Any]) -> str:
    rows = facts.get("metrics") or []
    head = "## How well it does"
    if not rows:
        return f"{head}\n\nNot tested: {facts.get('not_tested') or 'no scores were stored with it'}."
    takes = facts.get("tested_takes", ())
    if "labeller" in facts:
        return "\n".join([head, "", *_tabulate_frame_scores(rows[0], takes)])
    lines = [
        head,
        "",
        f"On {len(takes)} takes that it has not learned from: {_enumerate(takes)}. In brackets a 95 % interval, "
        "bootstrapped over takes.",
        "",
        "| segments | number | " + " | ".join(title for _, title in SCORES) + " | best constant answer | chance |",
        "|---|---|" + "---|" * (len(SCORES) + 2),
    ]
    for row in rows:
        cells = [row["segmentation"], str(row["n_segments"])]
        cells += [format_interval(row, key) for key, _ in SCORES]
        cells += [_number(row["majority"]), _number(row["chance"])]
        lines.append("| " + " | ".join(cells) + " |")
    left_out = sum(row[key] for row in rows[:1] for key in row if key.startswith("left_out"))
    lines += ["", f"{left_out} manual segments were left out: transitions, unlabelled, or without weights."]
    return "\n".join(lines)


def _tabulate_frame_scores(row: Mapping[str, Any], takes: Sequence[str]) -> list[str]:
    cells = [format_interval(row, key) for key, _ in FRAME_SCORES]
    return [
        f"On {len(takes)} takes that it has not learned from ({row['n_segments']} annotated segments): "
        f"{_enumerate(takes)}. Transitions are one class; in brackets a 95 % interval, bootstrapped over takes.",
        "",
        "| " + " | ".join(title for _, title in FRAME_SCORES) + " | best constant answer | chance |",
        "|" + "---|" * (len(FRAME_SCORES) + 2),
        "| " + " | ".join([*cells, _number(row["majority"]), _number(row["chance"])]) + " |",
    ]


def _say_calibration(facts: Mapping[str, Any]) -> str:
    told = facts.get("calibration") or {}
    head = "## How far to trust its confidence\n\n"
    if not told.get("method"):
        why = told.get("why", "no takes were held out")
        return head + f"Its confidence orders its own answers and is not calibrated: {why}."
    rows = [
        f"Calibrated ({told['method']}) on {told['n_segments']} segments of {told['held_out']} held out in turn "
        f"({told['n_folds']} folds), of which {_number(told['accuracy'])} were right"
        + (f"; {told['left_out']} of classes that a fold could not learn were left out." if told["left_out"] else "."),
        "",
        "| | before | after |",
        "|---|---|---|",
    ]
    for key, title in (("ece", "expected calibration error"), ("brier", "Brier score"), ("log_loss", "log loss")):
        rows.append(f"| {title} | {told[key]:.3f} | {told[f'{key}_calibrated']:.3f} |")
    one = str(told["held_out"]).removesuffix("s")
    rows += ["", f"What is after was measured with each {one} left out of the calibration too."]
    if told.get("tested"):
        rows += [
            "",
            f"On the takes that it was tested on ({told['tested']['n_segments']} segments) the expected calibration "
            f"error is {told['tested']['ece']:.3f}: only so far does the confidence carry over to other protocols.",
        ]
    return head + "\n".join(rows)


def _say_limits(corpus: CorpusView, facts: Mapping[str, Any]) -> str:
    lines = ["## Limits", ""]
    if _is_simulated(corpus, facts):
        lines.append("- Its takes are simulated: its scores say nothing about real signers.")
    if facts.get("held_out_signer"):
        lines.append("- Tested on one signer whom it has not seen; others may be harder.")
    elif len(facts.get("signers") or ()) > 1:
        lines.append("- Its tests, if any, are on signers whom it has seen; a new signer will be harder.")
    else:
        lines.append(f"- Learned from one signer, {facts.get('signer')}; of anybody else's face it knows nothing.")
    lines += [
        "- A transition's class is one for all; it gets the name of what lies on its two sides."
        if "labeller" in facts
        else "- It knows held expressions only; a transition gets the name of what lies on its two sides.",
        f"- It needs weights of the same {len(facts.get('shapes') or ())} shapes in the same order, and a corpus with "
        f"the same labels{', at the same rate' if 'labeller' in facts else ''}; others are refused.",
        "- It labels facial expression that a person was asked to show, not what anybody feels.",
    ]
    return "\n".join(lines)


def _say_versions(facts: Mapping[str, Any]) -> str:
    versions = facts.get("versions") or {"scikit-learn": facts.get("sklearn", "unknown")}
    return "## Made with\n\n" + ", ".join(f"{name} {version}" for name, version in versions.items())


def _is_simulated(corpus: CorpusView, facts: Mapping[str, Any]) -> bool:
    """Whether the model says so, or (a model of an earlier version) a take that it learned from does."""
    if "simulated" in facts:
        return bool(facts["simulated"])
    takes = [take for take in facts.get("takes", ()) if corpus.has_take(take)]
    return any(bool(corpus.take_attributes(take).get("simulated")) for take in takes)


def format_interval(row: Mapping[str, Any], key: str) -> str:
    """Return a score with its interval, ``0.91 [0.85, 0.96]``; without one where it has none."""
    low, high = row.get(f"{key}_low"), row.get(f"{key}_high")
    ends = "" if _is_missing(low) or _is_missing(high) else f" [{_number(low)}, {_number(high)}]"
    return _number(row.get(key)) + ends


def _number(value: Any) -> str:
    return "–" if _is_missing(value) else f"{round(float(value), 2) + 0.0:.2f}"  # no -0.00


def _is_missing(value: Any) -> bool:
    return value is None or value != value


def _enumerate(names: Sequence[str], most: int = 12) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
