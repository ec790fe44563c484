"""Commands about the quality of what came in: ``check``, and ``repair fill``, ``repair swap``, ``repair undo``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import Annotator, At, Author, Branch, CorpusPath, Json, TakeName, TakeNames, print_table

repair_app = typer.Typer(help="Repair markers: explicit, recorded, undone at will.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command("check")(check)
    repair_app.command("fill")(repair_fill)
    repair_app.command("swap")(repair_swap)
    repair_app.command("undo")(repair_undo)
    app.add_typer(repair_app, name="repair")


def check(
    corpus: CorpusPath,
    takes: TakeNames = None,
    at: At = None,
    recorded: Annotated[
        bool, typer.Option("--recorded", help="Check the recordings even where takes were repaired.")
    ] = False,
    labels: Annotated[
        bool, typer.Option("--labels", help="Look for likely mistakes in an annotator's labels instead.")
    ] = False,
    annotator: Annotator = None,
    least_score: Annotated[
        float | None, typer.Option("--least-score", help="With --labels: 0 lists all suspicions; 0.5 by default.")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="With --labels: no labeller in time, which takes minutes.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Check markers and tiers: gaps, spikes, swaps, head markers, frame clock, axes, units, neutrals, labels.

    With --labels: swapped labels, shifted boundaries, missing, doubled and short segments, and breaches of the rules of
    annotation, the surest first, each with its reason; a second annotator's tier is a witness where there is one.

    Changes nothing. Exits 0 where there are only notes, 1 where there are warnings or errors, 2 on bad input.
    """
    import json

    from ...corpus import Corpus
    from ...errors import InputError

    if labels:
        if recorded:
            raise InputError("check --labels looks at labels, not at recordings; leave --recorded out")
        found = _check_labels(corpus, at, takes, annotator, 0.5 if least_score is None else least_score, quick, as_json)
        if found:
            raise typer.Exit(1)
        return
    if annotator is not None or least_score is not None or quick:
        raise InputError("--annotator, --least-score and --quick go with check --labels")
    from ..pipeline.checking import check_corpus, summarise_takes
    from ..progress import ConsoleReporter

    report = check_corpus(Corpus.open(corpus, at=at), takes, recorded=recorded, reporter=ConsoleReporter())
    if as_json:
        print(json.dumps(report.to_json(), indent=2, ensure_ascii=False))
    else:
        print_table(summarise_takes(report.markers), as_json=False)
        print()
        _print_findings(report.findings)
    if report.has_problems:
        raise typer.Exit(1)


def _check_labels(
    corpus: Path,
    at: str | None,
    takes: list[str] | None,
    annotator: str | None,
    least_score: float,
    quick: bool,
    as_json: bool,
) -> int:
    """Print likely mistakes and return how many there are."""
    import json

    from ...corpus import Corpus
    from ..pipeline.checking_labels import check_labels
    from ..progress import ConsoleReporter

    result = check_labels(
        Corpus.open(corpus, at=at),
        annotator=annotator,
        takes=takes,
        least_score=least_score,
        temporal=not quick,
        reporter=ConsoleReporter(),
    )
    findings = result.findings
    if as_json:
        rows = json.loads(findings.to_json(orient="records"))
        record = {"annotator": result.annotator, "second": result.second, "notes": result.notes, "findings": rows}
        print(json.dumps(record, indent=2, ensure_ascii=False))
        return len(findings)
    beside = f", a second annotator beside in {result.second} takes" if result.second else ""
    print(f"{len(findings)} likely mistakes in the labels of {result.annotator}{beside}")
    for row in findings.itertuples():
        print(f"{row.score:.2f}  {row.take}  [{row.onset}, {row.offset})  {row.problem}: {row.reason}")
    for note in result.notes:
        print(f"note: {note}")
    return len(findings)


def _print_findings(findings) -> None:  # type: ignore[no-untyped-def]  # a DataFrame; pandas is imported late
    counts = findings["severity"].value_counts()
    print(", ".join(f"{counts.get(s, 0)} {s}s" for s in ("error", "warning", "note")))
    for row in findings.itertuples():
        place = f"{row.take}  {row.where}".rstrip()
        print(f"{row.severity:<7}  {place}  {row.what}: {row.advice}")


def repair_fill(
    corpus: CorpusPath,
    takes: Annotated[list[str], typer.Argument(help="Names of takes.", metavar="TAKE…")],
    below: Annotated[float, typer.Option(help="Fill gaps of up to so many seconds.", metavar="SECONDS")] = 0.25,
    method: Annotated[str, typer.Option(help="spline, neighbours, or auto: what does better for the length.")] = "auto",
    author: Author = None,
    branch: Branch = None,
    as_json: Json = False,
) -> None:
    """Fill short gaps; what is filled is marked as filled.

    The recording stays as it is; later steps use the repaired markers. Once more with another length replaces what was
    filled before.
    """
    from ...corpus import Corpus
    from ..pipeline.repairing import fill
    from ..progress import ConsoleReporter

    opened = Corpus.open(corpus, at=branch)
    table = fill(opened, takes, below=below, method=method, author=author, reporter=ConsoleReporter())
    print_table(table, as_json)


def repair_swap(
    corpus: CorpusPath,
    take: TakeName,
    first: Annotated[str | None, typer.Argument(help="One marker.", metavar="[A]")] = None,
    second: Annotated[str | None, typer.Argument(help="The other marker.", metavar="[B]")] = None,
    onset: Annotated[int | None, typer.Option("--from", help="First frame of the swap.", metavar="FRAME")] = None,
    offset: Annotated[
        int | None, typer.Option("--to", help="First frame after it; the end of the take by default.", metavar="FRAME")
    ] = None,
    auto: Annotated[bool, typer.Option("--auto", help="Swap back all swaps that check finds.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="With --auto: do not ask.")] = False,
    author: Author = None,
    branch: Branch = None,
) -> None:
    """Give two markers each other's label for some frames.

    With --auto all swaps that check finds are listed, then swapped back.
    """
    from ...corpus import Corpus
    from ...errors import InputError
    from ..pipeline.repairing import find_swaps, swap, swap_found

    opened = Corpus.open(corpus, at=branch)
    if auto:
        if first is not None or onset is not None or offset is not None:
            raise InputError("repair swap: name two markers and --from, or --auto alone")
        found = find_swaps(opened, take)
        for operation in found:
            a, b = operation["markers"]
            print(f"{a} and {b} in frames [{operation['onset']}, {operation['offset']})")
        if found and not yes and not typer.confirm(f"Swap {len(found)} back?"):
            print("nothing changed")
            return
        print(swap_found(opened, take, found, author=author))
        return
    if first is None or second is None or onset is None:
        raise InputError("repair swap: expected two markers and --from FRAME, or --auto")
    print(swap(opened, take, first, second, onset=onset, offset=offset, author=author))


def repair_undo(corpus: CorpusPath, take: TakeName, author: Author = None, branch: Branch = None) -> None:
    """Take back all repairs of a take: its recorded markers count again."""
    from ...corpus import Corpus
    from ..pipeline.repairing import undo

    print(undo(Corpus.open(corpus, at=branch), take, author=author))
