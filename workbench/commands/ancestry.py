"""Commands about trust: ``trace``, ``verify``, ``forget``."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from .options import At, Author, CorpusPath, Json, TakeNames


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command("trace")(trace)
    app.command("verify")(verify)
    app.command("forget")(forget)


def trace(
    corpus: CorpusPath,
    place: Annotated[
        str, typer.Argument(help="A frame of a take, or a time: TAKE@120, TAKE@0.6s.", metavar="TAKE@FRAME")
    ],
    tier: Annotated[str | None, typer.Option(help="Only tiers of this name.")] = None,
    at: At = None,
    as_json: Json = False,
) -> None:
    """Tell where a label comes from, back to the raw file.

    Every step with its parameters, what it says of this frame, and the commit that made it.
    """
    from ...corpus import Corpus
    from ...corpus.checks.ancestry import trace as run
    from ..pipeline.tracing import format_trace, parse_place

    opened = Corpus.open(corpus, at=at)
    take, frame = parse_place(opened, place)
    steps = run(opened, take, frame, tier=tier)
    if as_json:
        record = {"take": take, "frame": frame, "snapshot": opened.snapshot, "steps": [s.to_record() for s in steps]}
        print(json.dumps(record, indent=2, ensure_ascii=False))
        return
    print(f"{take}, frame {frame}, {frame / float(opened.take_attributes(take)['rate']):.3f} s")
    print(format_trace(steps))


def verify(
    corpus: CorpusPath,
    regenerate: Annotated[
        bool, typer.Option("--regenerate", help="Also derive again what was derived, and compare bit for bit.")
    ] = False,
    takes: TakeNames = None,
    everything: Annotated[bool, typer.Option("--all", help="All of the history, not only one version.")] = False,
    at: At = None,
    as_json: Json = False,
) -> None:
    """Read everything again and check that it is whole.

    Exit code 1 where problems were found, a line each; notes alone are no problem.
    """
    from ...corpus.checks.verification import verify_folder
    from ...corpus.store.location import locate
    from ..pipeline.regenerating import Regenerator

    done = verify_folder(
        locate(corpus),
        at,
        takes=takes,
        all_snapshots=everything,
        regenerator=Regenerator if regenerate else None,
    )
    if as_json:
        print(json.dumps(done.to_record(), indent=2, ensure_ascii=False))
    else:
        for finding in done.findings:
            print(" ".join(str(finding).split()))
        again = f", {done.regenerated} derived again bit for bit" if regenerate else ""
        size = f"{done.units} units in {done.snapshots} snapshots read{again}"
        print(f"{len(done.problems)} problems; {size}" if done.problems else f"all is whole: {size}")
    if done.problems:
        raise typer.Exit(1)


def forget(
    corpus: CorpusPath,
    signer: Annotated[str, typer.Argument(help="Code of the signer.", metavar="SIGNER")],
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    author: Author = None,
    as_json: Json = False,
) -> None:
    """Remove a signer from all history, for good.

    Takes, what was derived and learned from them, and their name; every snapshot gets a new id. What the review page
    keeps of their takes goes too, edits that are not published included; a review that is running must be ended first.
    Clones, backups and exports elsewhere are not touched.
    """
    from dataclasses import asdict

    from ...corpus import Corpus
    from ...corpus.privacy.forgetting import forget as run
    from ...corpus.privacy.forgetting import plan_forgetting
    from ...errors import InputError
    from ..progress import ConsoleReporter
    from ..review.forgetting import reviews_closed

    opened = Corpus.open(corpus)
    if not yes:
        plan = plan_forgetting(opened, signer)
        typer.echo(f"From all {plan.snapshots} snapshots of {opened.path}, for good:", err=True)
        for line in plan.describe():
            typer.echo(f"  {line}", err=True)
        typer.echo(ELSEWHERE, err=True)
        try:
            agreed = typer.confirm(f"Forget signer {signer}?", err=True)
        except typer.Abort:
            raise InputError("forget: nobody answered; nothing was changed; give --yes to do it unasked") from None
        if not agreed:
            raise InputError("forget: not confirmed; nothing was changed")
    with (
        reviews_closed(opened.path) as purge_review,
        ConsoleReporter().stage("Making the history again", 1) as finished,
    ):
        done = run(
            opened,
            signer,
            author=author,
            on_snapshot=lambda total: finished("snapshot", 1 / total),
            purge_review=purge_review,
        )
    if as_json:
        print(json.dumps(asdict(done), indent=2, ensure_ascii=False))
        return
    print(f"forgotten: {len(done.takes)} takes, {len(done.models) + len(done.priors)} models and priors")
    if done.unread:
        print(f"not looked into: {', '.join(done.unread)} in the corpus's folder")
    if purge_review.drafts:
        print(f"forgotten on the review page: {purge_review.drafts} drafts")
    if purge_review.namesake:
        print(f"kept on the review page: the reviewer {purge_review.namesake!r}, and their work on others' takes")
    if done.ambiguous:
        print(f"kept, though they bear the code: {', '.join(done.ambiguous)}")
    print(ELSEWHERE)


ELSEWHERE = "Clones, backups and exports of this corpus elsewhere are not touched; see to them yourself."
