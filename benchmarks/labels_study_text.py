"""What the page of the study says in words; nothing here depends on the numbers."""

HEAD = """# What labels faces, compared

Written by `benchmarks/labels_study.py`.

**Simulated signers: the numbers below say how the methods work on them, and nothing about real signers.** The
simulator draws everybody's faces, expressions, mouthing and annotators from one recipe. Real people differ in ways
that no recipe here knows, and their annotators disagree for other reasons. What carries over is the procedure; the
figures do not.

The seeds of the corpora were never used while anything was designed or tuned, and everything runs with its
defaults. Every score stands beside that of a second annotator, simulated too, against the same first annotator.
"""

LABELLERS = """\
Signers are dealt into folds; a labeller learns from the takes of all folds but one and labels the takes of that
one, all protocols, transitions as one class (`mimique evaluate CORPUS --protocol labellers`). In brackets: 95 %
intervals, bootstrapped over takes with the same draws for all; folds, signers and the seed of the training are held
fixed. `f1 50 stable` leaves transitions out. Staccato does not count overlaps of 0.1 s or less. Offsets are of
borders within 0.25 s of the reference's; above 0 is late.
"""

LIMITS = """
What limits them by construction:

- **Per frame**: sees the weights and their change over 0.2 s. A held weak expression and a passing mouth shape can
  look the same to it. Answers that flicker cost little accuracy, and much segmental F1.
- **Per frame, merged**: takes flicker away by a least duration and a price on changes. It cannot bring back a
  segment that the frames never voted for, and it drops true segments that are shorter than its least duration.
- **Hidden Markov chain**: takes frames as independent given the state, which neighbouring frames are not; an
  exponent that is chosen in training makes up for it. It knows which label follows which, but takes durations as
  geometric.
- **Random field**: learns weights on the forest's probabilities, and so inherits what the forest cannot tell apart.
  It is trained on answers of forests that had fewer people to learn from than the one that labels in the end.
- **LSTM, GRU, temporal convolution**: learn from the sequence itself, and see seconds to both sides, so they need
  the whole take and cannot label while somebody signs. They learned from eight signers at most; other seeds give
  other scores (see the table of trainings), and when a training stops hangs on a single signer held out of the
  eight.
- **All of them** work at 25 samples a second. A border is known to 40 ms before interpolation, and the reference's
  own borders scatter, as the second annotator's do: within one or two frames (5 to 10 ms) nobody scores high,
  people included.
- **The second annotator** is no upper bound. Where a machine's borders are nearer to the first annotator's than the
  second's are, it has learned the first one's habits, which are the reference.
"""

THESIS = """\
Reverdy 2019, 4.4.3 and Figure 4.4: trained on every frame of the signer's own IE and SE takes, tested on the
segments of EU takes by their mean weights, cut by hand and by the energies; transitions left out. Both signers
together. Accuracy per segment rewards cutting what is easy into many pieces, so accuracy by duration stands beside it.
"""

READING = """\
- Intervals are over takes. They do not cover another draw of signers, another seed of the simulator, or another
  training; ten signers are few: the intervals over signers in the first table say more about other people.
- Simulated annotators differ from each other by scatter and a few opinions that the simulator states. Human
  agreement on expressive sign language is another matter, and may be far lower.
- Macro F1 is the mean over classes that the reference or the answers contain; `chance` is guessing with equal odds,
  `majority` the best constant answer.
- Agreement of people who labelled from scratch and of people who corrected proposals is never in one row. All tiers
  of these corpora are from scratch.
"""

PARTS = {
    "confidence": (
        "Confidence",
        "Each signer held out, calibrated on the others; `mimique evaluate CORPUS --protocol confidence`.\n",
    ),
    "segmentation": (
        "Segmentation",
        "Borders by energies and by others, side by side; `mimique evaluate CORPUS --protocol segmentation`.\n",
    ),
    "intensity": (
        "Intensity",
        "Degrees 0 to 3 as an ordinal target; `mimique evaluate CORPUS --protocol intensity`.\n",
    ),
}

PICTURES = {
    "labels_f1.png": "Segmental F1@50 of every labeller and the second annotator at three difficulties, simulated",
    "labels_borders.png": "F1 of borders over the tolerance, simulated",
    "labels_figure_4_4.png": "Accuracy of five classifiers, by hand and automatic, simulated",
    "labels_reliability.png": "Reliability of the probabilities, simulated",
}

SHORT = """
A second annotator is a strong witness here because the simulated two see the same blends alike; real pairs agree less.
With one annotator alone mistakes are found less well than asked: the annotator's own slips of a tenth of a second
outnumber the planted ones, so that even one who knows the true borders does not find all, and a swapped label in an
utterance is often a weak or blended expression that the models doubt anyway. A labeller that is well calibrated as it
is (tcn) gains nothing from calibration on fewer signers.
"""
