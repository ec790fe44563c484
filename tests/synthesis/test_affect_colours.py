"""The colours that stand for affects, and labels in any of the corpus's spellings."""

import numpy as np
import pytest
from mimique.synthesis.affect_colours import AFFECT_COLOURS, find_affects, find_label_colours, find_text_colour

# Linear-RGB simulations of full dichromacy: Viénot, Brettel and Mollon (1999), Color Research and Application 24(4),
# Table: protanopia and deuteranopia.
DICHROMATS = {
    "protan": [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
    "deutan": [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
}


def linear(colour: str) -> np.ndarray:
    c = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("kind", [None, *DICHROMATS])
def test_affects_stay_apart_for_colour_blind_readers(kind):
    seen = [linear(c) for c in AFFECT_COLOURS.values()]
    if kind:
        seen = [np.asarray(DICHROMATS[kind]) @ c for c in seen]
    seen = np.cbrt(np.clip(seen, 0, 1))  # roughly even steps to the eye
    gaps = [np.linalg.norm(a - b) for i, a in enumerate(seen) for b in seen[:i]]
    assert min(gaps) > 0.12


@pytest.mark.parametrize(
    ("label", "affects"),
    [
        ("joy", ("joy",)),
        ("Joy", ("joy",)),
        ("J", ("joy",)),
        ("C", ("anger",)),
        ("T", ("sadness",)),
        ("Su", ("surprise",)),
        ("NA", ("neutral", "anger")),
        ("SaSu", ("sadness", "surprise")),
        ("neutral → fear", ("neutral", "fear")),
        ("What?", ()),
        ("", ()),
        ("NASu", ()),
    ],
)
def test_labels_are_understood_in_any_spelling(label, affects):
    assert find_affects(label) == affects
    if affects:
        assert find_label_colours(label) == tuple(AFFECT_COLOURS[a] for a in affects)


def test_other_labels_keep_one_colour_that_is_no_affect():
    assert find_label_colours("MOI") == find_label_colours("MOI")
    assert find_label_colours("MOI")[0] not in AFFECT_COLOURS.values()


@pytest.mark.parametrize("colour", [*AFFECT_COLOURS.values(), "#000000", "#ffffff", "#767676"])
def test_text_on_a_colour_is_readable(colour):
    ground = linear(colour) @ [0.2126, 0.7152, 0.0722]
    ink = linear(find_text_colour(colour)) @ [0.2126, 0.7152, 0.0722]
    contrast = (max(ground, ink) + 0.05) / (min(ground, ink) + 0.05)
    assert contrast >= 4.5  # WCAG 2.2, success criterion 1.4.3
