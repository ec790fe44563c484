"""The command that scores what labels faces: ``evaluate``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .options import Annotator, At, CorpusPath, Json, Signers

if TYPE_CHECKING:
    from ..pipeline.evaluation_tables import TableResult

Seed = Annotated[int, typer.Option(help="Of the forests, the networks, the folds and the bootstrap.")]

OPTIONS: dict[str, tuple[str, ...]] = {
    "reverdy2019": ("--classifiers", "--train", "--test", "--frames-per-second", "--lenient"),
    "across-signers": ("--classifiers", "--train", "--test", "--frames-per-second", "--lenient"),
    "labellers": ("--classifiers", "--train", "--test", "--folds", "--lenient"),
    "confidence": ("--folds",),
    "segmentation": ("--classifiers", "--folds"),
    "intensity": (),
}
"""Every protocol, and the options that only some of them take."""


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command("evaluate")(evaluate)


def evaluate(
    corpus: CorpusPath,
    protocol: Annotated[
        str,
        typer.Option(help="reverdy2019, across-signers, labellers, confidence, segmentation or intensity."),
    ] = "reverdy2019",
    annotator: Annotator = None,
    classifiers: Annotated[
        str | None,
        typer.Option(help="Names, separated by commas, of classifiers, or of labellers where these are scored."),
    ] = None,
    train_protocols: Annotated[
        str | None, typer.Option("--train", help="Protocols to learn from; IE,SE by default, labellers: all.")
    ] = None,
    test_protocols: Annotated[
        str | None, typer.Option("--test", help="Protocols to test on; EU by default, labellers: all.")
    ] = None,
    signers: Signers = None,
    folds: Annotated[
        int | None,
        typer.Option("--folds", help="Of signers, for labellers, confidence and segmentation; 5 by default."),
    ] = None,
    per_second: Annotated[
        float | None,
        typer.Option(
            "--frames-per-second", help="Training frames; 0 for all, as in the thesis; across-signers 10 by default."
        ),
    ] = None,
    lenient: Annotated[
        bool,
        typer.Option("--lenient", help="Go on where a signer has no reference, or a class is on one side only."),
    ] = False,
    seed: Seed = 0,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Write the scores here too; further tables beside it.", metavar="FILE.csv"),
    ] = None,
    at: At = None,
    as_json: Json = False,
) -> None:
    """Train and test what labels faces; everything stands beside a second annotator.

    reverdy2019: classifiers of segments per signer, as the thesis does (Figure 4.4). across-signers: each signer by
    what the others taught. labellers: labellers of frames in time, on signers they never saw. confidence, segmentation,
    intensity: how sure the labels are, where the borders lie, and degrees. In brackets a 95 % interval, bootstrapped
    over takes.
    """
    from ...corpus import Corpus
    from ...errors import InputError
    from ..pipeline.evaluation_tables import check_csv

    if protocol not in OPTIONS:
        raise InputError(f"--protocol: expected one of {', '.join(OPTIONS)}, but got {protocol!r}")
    given = {
        "--classifiers": classifiers,
        "--train": train_protocols,
        "--test": test_protocols,
        "--folds": folds,
        "--frames-per-second": per_second,
        "--lenient": lenient or None,
    }
    _refuse_idle(protocol, given)
    if out is not None:
        check_csv(out)
    opened = Corpus.open(corpus, at=at)
    common = {"annotator": annotator, "signers": signers, "seed": seed}
    if protocol in ("reverdy2019", "across-signers"):
        _evaluate_classifiers(opened, protocol, given, common, out, as_json)
    else:
        _evaluate_tables(opened, protocol, given, common, out, as_json)


def _refuse_idle(protocol: str, given: Mapping[str, Any]) -> None:
    """Refuse options that the protocol would not look at."""
    from ...errors import InputError

    for option, value in given.items():
        if value is not None and option not in OPTIONS[protocol]:
            where = [name for name, options in OPTIONS.items() if option in options]
            raise InputError(f"{option} goes with --protocol {' or '.join(where)}, not with {protocol}; leave it out")


def _evaluate_classifiers(
    opened: Any, protocol: str, given: Mapping[str, Any], common: Mapping[str, Any], out: Path | None, as_json: bool
) -> None:
    from ...models import CLASSIFIERS
    from ..pipeline.evaluating import TEST_PROTOCOLS, TRAIN_PROTOCOLS, evaluate
    from ..pipeline.evaluation_tables import format_evaluation, to_json, write_csv
    from ..pipeline.ingesting import split_names
    from ..pipeline.reporting import is_simulated

    per_second = given["--frames-per-second"]
    if per_second is None:
        per_second = 0.0 if protocol == "reverdy2019" else 10.0
    result = evaluate(
        opened,
        protocol=protocol,
        classifiers=split_names(given["--classifiers"]) or CLASSIFIERS,
        train_protocols=split_names(given["--train"]) or TRAIN_PROTOCOLS,
        test_protocols=split_names(given["--test"]) or TEST_PROTOCOLS,
        per_second=None if per_second == 0 else per_second,
        strict=not given["--lenient"],
        **common,
    )
    simulated = is_simulated(opened)
    print(to_json(result, opened.snapshot, simulated) if as_json else format_evaluation(result, simulated))
    _tell(write_csv(result, out, simulated) if out is not None else [], as_json)


def _evaluate_tables(
    opened: Any, protocol: str, given: Mapping[str, Any], common: Mapping[str, Any], out: Path | None, as_json: bool
) -> None:
    from ..pipeline.evaluation_tables import format_tables, tables_to_json, write_tables
    from ..pipeline.ingesting import split_names
    from ..pipeline.reporting import is_simulated
    from ..progress import ConsoleReporter

    own: dict[str, Any] = {}
    if given["--classifiers"] is not None:
        own["labellers"] = split_names(given["--classifiers"])
    if given["--folds"] is not None:
        own["n_folds"] = given["--folds"]
    if protocol == "labellers":
        own["train_protocols"] = split_names(given["--train"]) or None
        own["test_protocols"] = split_names(given["--test"]) or None
        own["strict"] = not given["--lenient"]
    result = _find_evaluation(protocol)(opened, **common, **own, reporter=ConsoleReporter())
    simulated = is_simulated(opened)
    if as_json:
        print(tables_to_json(result, protocol, opened.snapshot, simulated))
    else:
        print(format_tables(result, protocol, simulated))
    written = []
    if out is not None:
        written = write_tables(result, out, protocol, simulated)
        draw = getattr(result, "plot_reliability", None)
        if draw is not None:
            written.append(out.with_name(f"{out.stem}_reliability.png"))
            draw(written[-1])
    _tell(written, as_json)


def _find_evaluation(protocol: str) -> Callable[..., TableResult]:
    if protocol == "labellers":
        from ..pipeline.evaluating_labellers import evaluate_labellers

        return evaluate_labellers
    if protocol == "confidence":
        from ..pipeline.evaluating_confidence import evaluate_confidence

        return evaluate_confidence
    if protocol == "segmentation":
        from ..pipeline.evaluating_segmentation import evaluate_segmentation

        return evaluate_segmentation
    from ..pipeline.evaluating_intensity import evaluate_intensity

    return evaluate_intensity


def _tell(written: list[Path], as_json: bool) -> None:
    if written and not as_json:
        print("written: " + ", ".join(map(str, written)))
