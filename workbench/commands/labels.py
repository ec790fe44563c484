"""Commands about labels: ``train``, ``label``, ``evaluate``."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from .options import At, Author, CorpusPath, Json, Signers, TakeNames, print_table

Annotator = Annotated[
    str | None, typer.Option(help="Whose tier 'affect' is the reference; who annotated most by default.")
]
Seed = Annotated[int, typer.Option(help="Of the random forest.")]


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command("train")(train)
    app.command("label")(label)
    app.command("evaluate")(evaluate)


def train(
    corpus: CorpusPath,
    classifier: Annotated[
        str, typer.Option(help="1-nn, 3-nn, linear-svm, rbf-svm or random-forest.")
    ] = "random-forest",
    annotator: Annotator = None,
    protocols: Annotated[str, typer.Option(help="Protocols to learn from.")] = "IE,SE",
    signers: Signers = None,
    name: Annotated[str | None, typer.Option(help="Of the model; SIGNER-CLASSIFIER by default.")] = None,
    seed: Seed = 0,
    author: Author = None,
    as_json: Json = False,
) -> None:
    """Learn an affect classifier per signer from annotated takes."""
    from ...corpus import Corpus
    from ..pipeline.ingesting import split_names
    from ..pipeline.training import train as run
    from ..progress import ConsoleReporter

    table = run(
        Corpus.open(corpus),
        classifier=classifier,
        annotator=annotator,
        protocols=split_names(protocols),
        signers=signers,
        name=name,
        seed=seed,
        author=author,
        reporter=ConsoleReporter(),
    )
    print_table(table, as_json)


def label(
    corpus: CorpusPath,
    model: Annotated[str | None, typer.Option(help="Name of the model; each signer's own by default.")] = None,
    takes: TakeNames = None,
    author: Author = None,
    as_json: Json = False,
) -> None:
    """Label the segments of takes by a model.

    The labels are a tier of the model's own; what people annotated stays.
    """
    from ...corpus import Corpus
    from ..pipeline.labelling import label as run
    from ..progress import ConsoleReporter

    print_table(run(Corpus.open(corpus), model=model, takes=takes, author=author, reporter=ConsoleReporter()), as_json)


def evaluate(
    corpus: CorpusPath,
    annotator: Annotator = None,
    classifiers: Annotated[str | None, typer.Option(help="Names, separated by commas; all five by default.")] = None,
    train_protocols: Annotated[str, typer.Option("--train", help="Protocols to learn from.")] = "IE,SE",
    test_protocols: Annotated[str, typer.Option("--test", help="Protocols to test on.")] = "EU",
    signers: Signers = None,
    seed: Seed = 0,
    at: At = None,
    as_json: Json = False,
) -> None:
    """Train and test classifiers as the thesis does.

    Per signer, on manual and automatic segments (Reverdy 2019, Figure 4.4).
    """
    from ...corpus import Corpus
    from ...models import CLASSIFIERS
    from ..pipeline.evaluating import evaluate as run
    from ..pipeline.ingesting import split_names
    from ..pipeline.reporting import is_simulated

    opened = Corpus.open(corpus, at=at)
    result = run(
        opened,
        annotator=annotator,
        signers=signers,
        classifiers=split_names(classifiers) or CLASSIFIERS,
        train_protocols=split_names(train_protocols),
        test_protocols=split_names(test_protocols),
        seed=seed,
    )
    simulated = is_simulated(opened)
    if as_json:
        records = json.loads(result.table.to_json(orient="records"))
        print(json.dumps({"snapshot": opened.snapshot, "simulated": simulated, "results": records}, indent=2))
        return
    if simulated:
        print("simulated signers: these numbers say how the methods work, not how people are recognised")
    columns = ["signer", "classifier", "segmentation", "n_segments", "accuracy", "accuracy_duration", "majority"]
    print_table(result.table[columns], as_json)
