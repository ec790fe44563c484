"""Measure the review page and write the table of docs/reviewing.md; minutes, on a machine that does nothing else.

python docs/write_review_figures.py [RIG UNIT]     # the embedded avatar unless a rig is given
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))

import bench_review
import bench_review_page

PAGE = Path(__file__).parent / "reviewing.md"
BEGIN, END = "<!-- figures: written by docs/write_review_figures.py -->\n", "<!-- end of figures -->"


def write_table(edits: dict[str, float], page: dict[str, float]) -> str:
    """Return the table of what is asked and what was found."""
    alone, two = "take as it is", "with two faces"
    lost = "none lost" if not edits["lost"] else f"{edits['lost']:.0f} differences"
    rows = [
        (
            "edit on disk and acknowledged, eight people editing as fast as they are answered "
            f"({edits['pace']:.0f} a second)",
            "median < 50 ms, 99 % < 150 ms",
            f"{edits['median']:.0f} ms, {edits['high']:.0f} ms; of {edits['edits']:.0f} {lost}",
        ),
        ("page as it is sent, compressed, without the rig", "< 1 MB", f"{page['size']:.0f} kB"),
        (
            f"first picture after opening ({page['vertices']:.0f} vertices, {page['shapes']:.0f} shapes, "
            "ten minutes at 200 Hz)",
            "< 2 s",
            f"{page['first'] / 1000:.1f} s; {page['again'] / 1000:.1f} s when opened again",
        ),
        (
            "seek to frames that were not fetched yet",
            "< 100 ms",
            f"median {page['seek']:.0f} ms, at most {page['slowest seek']:.0f} ms",
        ),
        (
            "scripts for a picture while playing, processor time; with two faces",
            "< 8 ms",
            f"{page[f'scripts {alone}']:.1f} ms; {page[f'scripts {two}']:.1f} ms",
        ),
        (
            "pictures a second, drawn without a graphics card; with two faces",
            "–",
            f"{page[f'pictures {alone}']:.0f}; {page[f'pictures {two}']:.0f}",
        ),
    ]
    lines = ["| what | asked | found |", "|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, then write."""
    table = write_table(bench_review.measure(), bench_review_page.measure(*sys.argv[1:3]))
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}{table}{END}{rest.split(END, 1)[1]}", encoding="utf-8")
    print(table)


if __name__ == "__main__":
    main()
