"""Commands that learn and use models of labels: ``train``, ``label``, ``model show``."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import Annotator, At, Author, Branch, CorpusPath, Json, Signers, TakeNames, print_table

Seed = Annotated[int, typer.Option(help="Of what is random in learning.")]
model_app = typer.Typer(help="Models of a corpus.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command("train")(train)
    app.command("label")(label)
    model_app.command("show")(show_model)
    app.add_typer(model_app, name="model")


def train(
    corpus: CorpusPath,
    classifier: Annotated[
        str,
        typer.Option(
            help="Of segments: 1-nn, 3-nn, linear-svm, rbf-svm or random-forest. In time: per-frame-forest, "
            "per-frame-linear, forest-merging, linear-merging, hmm, crf, or the networks lstm, gru and tcn."
        ),
    ] = "random-forest",
    annotator: Annotator = None,
    protocols: Annotated[str, typer.Option(help="Protocols to learn from.")] = "IE,SE",
    signers: Signers = None,
    cross_signers: Annotated[
        bool, typer.Option("--cross-signers", help="Learn for each signer from all the others instead.")
    ] = False,
    all_signers: Annotated[
        bool, typer.Option("--all-signers", help="Learn one model from all signers, for those to come.")
    ] = False,
    name: Annotated[
        str | None,
        typer.Option(
            help="Of the model; SIGNER-CLASSIFIER, without-SIGNER-CLASSIFIER or all-signers-CLASSIFIER by default."
        ),
    ] = None,
    seed: Seed = 0,
    device: Annotated[str, typer.Option(help="Where networks are trained: auto, cpu, cuda ...")] = "auto",
    author: Author = None,
    branch: Branch = None,
    as_json: Json = False,
) -> None:
    """Learn a model of affects per signer from annotated takes.

    Its confidence is calibrated on takes held out in turn; it is tested on the signer's annotated EU takes, and stored
    with all that it was made from: see mimique model show. An interrupted training goes on when it is run again.
    """
    from ...corpus import Corpus
    from ..pipeline.ingesting import split_names
    from ..pipeline.training import train as run
    from ..progress import ConsoleReporter

    table = run(
        Corpus.open(corpus, at=branch),
        classifier=classifier,
        annotator=annotator,
        protocols=split_names(protocols),
        signers=signers,
        cross_signers=cross_signers,
        all_signers=all_signers,
        name=name,
        seed=seed,
        device=device,
        author=author,
        reporter=ConsoleReporter(),
    )
    print_table(table, as_json)


def label(
    corpus: CorpusPath,
    model: Annotated[str | None, typer.Option(help="Name of the model; each signer's own by default.")] = None,
    takes: TakeNames = None,
    author: Author = None,
    branch: Branch = None,
    as_json: Json = False,
) -> None:
    """Label takes by a model.

    Classifiers name the segments that mimique segment cut; labellers in time find segments and transitions themselves.
    The labels are a tier of the model's own; what people annotated stays.
    """
    from ...corpus import Corpus
    from ..pipeline.labelling import label as run
    from ..progress import ConsoleReporter

    print_table(
        run(Corpus.open(corpus, at=branch), model=model, takes=takes, author=author, reporter=ConsoleReporter()),
        as_json,
    )


def show_model(
    corpus: CorpusPath,
    name: Annotated[str, typer.Argument(help="Name of the model.", metavar="NAME")],
    at: At = None,
    as_json: Json = False,
) -> None:
    """Print a model's card: what it is, learned from, its scores and its limits.

    The card is Markdown; mimique model show CORPUS NAME > card.md keeps it.
    """
    import json

    from ...corpus import Corpus
    from ..pipeline.model_cards import write_model_card

    opened = Corpus.open(corpus, at=at)
    if as_json:
        print(json.dumps(opened.model_metadata(name), indent=2, ensure_ascii=False))
        return
    print(write_model_card(opened, name), end="")
