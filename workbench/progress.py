"""Progress of long work: what the pipeline tells, and what a person sees of it."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol, TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn


class Step(Protocol):
    """What a stage is told with: the name of what was finished, and how much of the total that was."""

    def __call__(self, name: str, amount: float = 1) -> object:
        """Advance the stage."""
        ...


class Reporter:
    """Receives stages of work and says nothing; the base of those that do.

    A stage is entered with its title and number of steps, and yields a function to call after each step with the
    name of what was finished::

        with reporter.stage("Solving", len(takes)) as finished:
            for take in takes:
                ...
                finished(take)
    """

    @contextmanager
    def stage(self, title: str, total: int, unit: str = "") -> Iterator[Step]:
        """Enter a stage of ``total`` steps, or of so much of a unit."""
        yield lambda name, amount=1: None

    def say(self, text: str) -> None:
        """Tell one line about what was done or noticed."""


class ConsoleReporter(Reporter):
    """Progress bars on a terminal, and one line with the time that each stage took.

    Parameters
    ----------
    stream
        Where to write; standard error by default, so that standard output stays for results.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._console = Console(file=stream or sys.stderr, highlight=False, soft_wrap=True)

    @contextmanager
    def stage(self, title: str, total: int, unit: str = "") -> Iterator[Step]:
        """Show a bar while the stage lasts and its duration once it is over."""
        start = time.perf_counter()
        columns = (
            TextColumn("{task.description}"),
            BarColumn(bar_width=30),
            TaskProgressColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[name]}", style="dim"),
        )
        with Progress(*columns, console=self._console, transient=True, disable=not self._console.is_terminal) as bars:
            task = bars.add_task(title, total=total, name="")
            yield lambda name, amount=1: bars.update(task, advance=amount, name=name)
        self.say(f"{title}: {total}{f' {unit}' if unit else ''} in {time.perf_counter() - start:.1f} s")

    def say(self, text: str) -> None:
        """Print one line."""
        self._console.print(text, markup=False)
