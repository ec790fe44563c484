"""The command that scores what labels faces: ``evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import Annotator, At, CorpusPath, Json, Signers

Seed = Annotated[int, typer.Option(help="Of the forests and the bootstrap.")]


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command("evaluate")(evaluate)


def evaluate(
    corpus: CorpusPath,
    protocol: Annotated[str, typer.Option(help="reverdy2019 or across-signers.")] = "reverdy2019",
    annotator: Annotator = None,
    classifiers: Annotated[str | None, typer.Option(help="Names, separated by commas; all five by default.")] = None,
    train_protocols: Annotated[str, typer.Option("--train", help="Protocols to learn from.")] = "IE,SE",
    test_protocols: Annotated[str, typer.Option("--test", help="Protocols to test on.")] = "EU",
    signers: Signers = None,
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
        typer.Option("--out", help="Write the scores here too; people and classes beside it.", metavar="FILE.csv"),
    ] = None,
    at: At = None,
    as_json: Json = False,
) -> None:
    """Train and test classifiers, on manual and automatic segments.

    reverdy2019: per signer, as the thesis does (Figure 4.4). across-signers: each signer by what the others taught. In
    brackets a 95 % interval, bootstrapped over takes.
    """
    from ...corpus import Corpus
    from ...models import CLASSIFIERS
    from ..pipeline.evaluating import evaluate as run
    from ..pipeline.evaluation_tables import check_csv, format_evaluation, to_json, write_csv
    from ..pipeline.ingesting import split_names
    from ..pipeline.reporting import is_simulated

    if out is not None:
        check_csv(out)
    if per_second is None:
        per_second = 0.0 if protocol == "reverdy2019" else 10.0
    opened = Corpus.open(corpus, at=at)
    result = run(
        opened,
        protocol=protocol,
        annotator=annotator,
        signers=signers,
        classifiers=split_names(classifiers) or CLASSIFIERS,
        train_protocols=split_names(train_protocols),
        test_protocols=split_names(test_protocols),
        per_second=None if per_second == 0 else per_second,
        strict=not lenient,
        seed=seed,
    )
    simulated = is_simulated(opened)
    print(to_json(result, opened.snapshot, simulated) if as_json else format_evaluation(result, simulated))
    if out is not None:
        paths = write_csv(result, out, simulated)
        if not as_json:
            print("written: " + ", ".join(map(str, paths)))
