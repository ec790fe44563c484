"""Draw docs/images/film.png: one picture of the film that ``mimique demo`` makes."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from mimique.corpus import Corpus
from mimique.synthesis.scene import Scene
from mimique.workbench.demo import run_demo
from mimique.workbench.pipeline.playing import prepare_performance
from mimique.workbench.progress import ConsoleReporter
from PIL import Image

TAKE = "s1_EU_surprise_1"


def main() -> None:
    """Run the demo in a temporary folder and save its most expressive frame."""
    target = Path(__file__).parent / "images" / "film.png"
    with tempfile.TemporaryDirectory() as folder:
        run_demo(Path(folder) / "demo", reporter=ConsoleReporter())
        performance = prepare_performance(Corpus.open(Path(folder) / "demo" / "corpus"), TAKE)
        with Scene(performance, (960, 540)) as scene:
            image = scene.image(int(np.nan_to_num(np.linalg.norm(performance.weights, axis=1)).argmax()))
    Image.fromarray(image).save(target, optimize=True)
    print(target)


if __name__ == "__main__":
    main()
