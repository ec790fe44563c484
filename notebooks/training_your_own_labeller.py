# %% [markdown]
# # Training your own labeller
#
# The thesis's classifiers answer for one segment at a time, and somebody has to cut the segments first. A
# *labeller* answers for every frame of a take: it finds the borders, the held expressions and the transitions in
# one pass, which the thesis asks for in its outlook (Reverdy 2019, 7.2). This notebook trains some, compares them
# on takes that they have not seen, stores a model in the corpus, and puts its proposals where an annotator can
# review them.
#
# It runs on your corpus (`MIMIQUE_CORPUS`), or on a small **simulated** one.

# %%
import os
import tempfile
from pathlib import Path

import numpy as np
from mimique.corpus import Corpus
from mimique.models.labellers import (
    LABELLERS,
    check_no_take_is_split,
    frame_labels,
    label_frames,
    segments_of_labels,
    stack_takes,
)
from mimique.models.scores.bootstrap import bootstrap_interval
from mimique.models.scores.segment_metrics import pool_f1, segmental_f1
from mimique.workbench.pipeline.ingesting import ingest, read_recording_list
from mimique.workbench.pipeline.labelled_takes import choose_author, read_labelled_takes
from mimique.workbench.pipeline.labelling import label
from mimique.workbench.pipeline.model_cards import write_model_card
from mimique.workbench.pipeline.reporting import is_simulated
from mimique.workbench.pipeline.rigging import AVATAR, add_rig
from mimique.workbench.pipeline.segmenting import segment
from mimique.workbench.pipeline.session_solver import SolveOptions
from mimique.workbench.pipeline.solving import solve
from mimique.workbench.pipeline.training import train
from mimique.workbench.simulation_files import RECORDING_LIST, write_simulated_corpus

# %%
FOLDER = Path(os.environ.get("MIMIQUE_CORPUS") or Path(tempfile.mkdtemp()) / "corpus")
if not FOLDER.exists():
    recordings = FOLDER.with_name(f"{FOLDER.name}-recordings")
    write_simulated_corpus(recordings, signers=2, seconds=80, seed=1)
    new = Corpus.create(FOLDER, name="two simulated signers")
    add_rig(new, "avatar", AVATAR)
    ingest(new, read_recording_list(recordings / RECORDING_LIST))
    solve(new, SolveOptions(method="bounded"))
    segment(new)

corpus = Corpus.open(FOLDER)
mark = " (simulated)" if is_simulated(corpus) else ""
print(f"{corpus.name}{mark}: snapshot {corpus.snapshot}")

# %% [markdown]
# ## Takes to learn from, takes to be tested on
#
# A `LabelledTake` is the weights of a take and one annotator's tier. The split is by **take**: neighbouring
# frames are near copies of each other, and whoever is tested on the neighbours of training frames is tested on
# what they know. `check_no_take_is_split` refuses such a split.

# %%
annotator = choose_author(corpus)
takes = read_labelled_takes(corpus, annotator)
training = [take for take in takes if take.protocol != "EU"]
testing = [take for take in takes if take.protocol == "EU"]
frames = stack_takes(training)
check_no_take_is_split(frames.groups, [take.name for take in testing])
labels, counts = np.unique([str(name) for name in frames.y if name is not None], return_counts=True)
print(f"{len(training)} takes to learn from, {len(testing)} to be tested on; reference: {annotator}")
print("training frames: " + ", ".join(f"{name} {count}" for name, count in zip(labels, counts, strict=True)))

# %% [markdown]
# ## Train
#
# All labellers are scikit-learn estimators: `fit(X, y, groups)` with the frames of all takes one after the other
# and the take of each frame, then `predict` and `predict_proba` for every frame. They work in a `Pipeline` and in
# a `GridSearchCV` with groups. `rate` is that of the recording, in Hz.
#
# The three below are quick. `"crf"`, and with PyTorch `"lstm"`, `"gru"` and `"tcn"`, are trained in the same way;
# add their names. (They want more than a minute of material.)

# %%
NAMES = ("per-frame-forest", "forest-merging", "hmm")
labellers = {}
for name in NAMES:
    labellers[name] = LABELLERS[name](np.random.default_rng(0), rate=frames.rate)
    labellers[name].fit(frames.X, frames.y, frames.groups)

# %% [markdown]
# ## Compare
#
# Accuracy per frame hardly sees what an annotator would have to mend: a label that flickers for three frames
# costs nothing. **Segmental F1** does (Lea and others 2017): a found segment counts once, if it has the right
# label and overlaps its reference by at least 10, 25 or 50 percent of their union. Intervals are bootstrapped
# over the test takes; a few takes give wide ones.

# %%
OVERLAPS = (0.10, 0.25, 0.50)
print(f"F1@10, F1@25, F1@50 on {len(testing)} test takes{mark}, with 95 % intervals")
for name, labeller in labellers.items():
    scores = []
    for overlap in OVERLAPS:
        by_take = [
            segmental_f1(frame_labels(take), label_frames(labeller, take.weights)[0], overlap) for take in testing
        ]
        scores.append(bootstrap_interval(by_take, lambda some: pool_f1(some).f1, np.random.default_rng(0)))
    print(f"{name:<20}" + "   ".join(str(score) for score in scores))

# %% [markdown]
# One take in full: what the labeller says, beside what the person said.

# %%
take = testing[0]
merging = labellers["forest-merging"]
answers, probabilities = label_frames(merging, take.weights)
found = segments_of_labels(answers, probabilities, merging.classes_)
print(f"{take.name}{mark}, forest-merging")
print(found[["onset", "offset", "label", "confidence"]].round(2).to_string(index=False))
print(f"{take.name}{mark}, {annotator}")
print(take.segments[["onset", "offset", "label"]].to_string(index=False))

# %% [markdown]
# ## Keep a model
#
# A model in the corpus is versioned like data: its training frames, their snapshot, the split, parameters, scores
# and library versions are stored with it as plain arrays and JSON (no pickle), and it is fitted again when it is
# loaded. `train` does this for the classifiers of segments; the command line says `mimique train CORPUS`, with
# `--cross-signers` to learn for each signer from all the others.

# %%
trained = train(corpus, classifier="random-forest", author="notebook")
print(trained.to_string(index=False))

# %% [markdown]
# Its card says what one should know before believing it: `mimique model show CORPUS NAME`.

# %%
print(write_model_card(corpus, str(trained["model"].iloc[0])))

# %% [markdown]
# ## Proposals for the annotators
#
# `label` writes a tier of the model's own, origin `model`, status `proposed`. What people annotated stays as it
# is, and every later score keeps labels that began as proposals apart from those made from scratch.

# %%
proposed = label(corpus, author="notebook")
print(proposed.head().to_string(index=False))
