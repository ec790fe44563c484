# %% [markdown]
# # Choosing a marker layout
#
# Before a capture, somebody has to decide how many markers to glue on a face, and where. Emeline Reverdy's thesis
# (2019, chapter 3) answers by experiment: take performances whose facial weights are known, put *virtual* markers on
# the mesh, make the face anew from these markers alone, and measure how far its vertices are from where they should
# be. Fewer markers are quicker to glue and to label; too few lose the lips or the brows.
#
# Here the same question is put to a corpus of your own, or, where there is none, to a small **simulated** one. What
# comes out for simulated performances says how the method works, and nothing about real faces.

# %%
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
from mimique.corpus import Corpus
from mimique.models.layouts.study_plan import StudyPlan
from mimique.synthesis import Rig
from mimique.synthesis.landmarks import FaceLandmarks
from mimique.workbench.layout_reports.drawings import draw_layout_pictures
from mimique.workbench.layout_reports.figures import draw_curves
from mimique.workbench.layout_reports.layout_report import LayoutFacts, write_layout_report
from mimique.workbench.layout_reports.numbers import summarise_curves
from mimique.workbench.layout_reports.placement_sheet import make_placement_sheet
from mimique.workbench.pipeline.ingesting import ingest, read_recording_list
from mimique.workbench.pipeline.reporting import is_simulated
from mimique.workbench.pipeline.rigging import AVATAR, add_rig
from mimique.workbench.pipeline.segmenting import segment
from mimique.workbench.pipeline.session_solver import SolveOptions
from mimique.workbench.pipeline.solving import solve
from mimique.workbench.pipeline.studying_layouts import LayoutOptions, study_layouts, write_layout_map
from mimique.workbench.simulation_files import RECORDING_LIST, write_simulated_corpus

# %% [markdown]
# ## A corpus
#
# Set `MIMIQUE_CORPUS` to the folder of your corpus. It needs a rig, and takes with weights on it: solved from
# markers, or from a face tracker. Without it, two people of 40 seconds each are simulated, read and solved.

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
print(f"{corpus.name}{mark}: snapshot {corpus.snapshot}, {len(corpus.takes())} takes")

# %% [markdown]
# ## The study
#
# One call. Everything that is *chosen* is chosen on the range of motion of the training actors: where k-means and
# the greedy choice put their markers, the solver's prior, all settings. Everything that is *measured* is measured on
# other takes, and on an actor that no choice has seen. Without such a take and such an actor a layout would look
# better than it is.
#
# The plan here is small, so that it runs in a minute: three numbers of markers, few frames, few seeds, one way to make
# the face. `mimique layout CORPUS --report layout.html` asks everything, and takes its time.

# %%
plan = {
    "sizes": (10, 20, 40),
    "methods": ("k-means median", "greedy + swaps"),
    "sets": ("Face Robot 35",),
    "reconstructions": ("solver",),
    "n_seeds": 3,
    "n_frames": 8,
    "n_loss_frames": 3,
    "n_cluster_frames": 60,
    "n_checked": 400,
    "n_pairs": 5,
    "noises": (0.2, 1.0),
    "offs": (0.0, 3.0),
}
print(f"by default the sizes are {StudyPlan().sizes}")
study = study_layouts(corpus, options=LayoutOptions(quick=True, plan=plan))
print(f"recommended{mark}: {study.recommended}")
for note in study.notes:
    print("note:", note)

# %% [markdown]
# ## How many?
#
# Mean distance of a vertex from where it should be, averaged over pairs of an actor and a take. The curve falls
# steeply and then flattens: beyond the bend, markers cost work and bring little, because what remains is not theirs
# (two people's faces differ, and no marker mends that).

# %%
errors = study.tables["errors"]
unseen = errors[~errors["same_actor"]] if (~errors["same_actor"]).any() else errors
curves = summarise_curves(unseen)
print(f"mean vertex error{mark}, mm")
print(curves[["method", "set", "K", "value", "low", "high"]].round(3).to_string(index=False))
figure = draw_curves(errors)
figure.set_facecolor("white")
figure.savefig(FOLDER.with_name("layout_curves.png"), dpi=110)

# %% [markdown]
# Read the intervals before the means: they come from drawing the pairs of actor and take again, and with a handful
# of pairs they are too narrow rather than too wide. The sets of the literature (here Face Robot's) are placed by
# anatomical names; the lists of most were not found and are rebuilt.
#
# ## What if one falls off?
#
# Markers get lost in every session. The mean over which one is lost says what to expect, the worst what to check
# twice when gluing.

# %%
losses = study.tables["losses"]
print(f"error with markers lost{mark}, mm")
print(losses[losses["lost"] == 1].round(3).to_string(index=False))

# %% [markdown]
# ## Where?
#
# The recommended layout with numbers, and the same in words for the person who glues: distances from places that can
# be found on any face, first up or down, then level. Rigid head markers come with it, because without them nobody
# can tell a nod from a smile.

# %%
rig = Rig.from_dataset(corpus.rig(study.parameters["rig"]))
landmarks = FaceLandmarks(rig)
layout = study.layout()
sheet = make_placement_sheet(rig, layout, head=study.head_markers or None, landmarks=landmarks)
print(sheet.markers[["number", "place", "partner"]].to_string(index=False))
print(sheet.head[["number", "place"]].to_string(index=False))
rigid = dict(zip(sheet.head["marker"], sheet.head["vertex"], strict=True))
pictures = draw_layout_pictures(rig, layout["vertex"].tolist(), rigid)
pictures.front.savefig(FOLDER.with_name("layout_front.png"), dpi=110)
plt.close("all")

# %% [markdown]
# ## To take along
#
# A report to print, and the layout as a marker map that `mimique solve` understands. `mimique layout CORPUS --store
# NAME` keeps it in the corpus instead, so that takes can be solved with it by name.

# %%
facts = LayoutFacts(
    corpus=corpus.name,
    snapshot=corpus.snapshot,
    version="notebook",
    created="now",
    rig=rig,
    rig_name=str(study.parameters["rig"]),
    simulated=bool(mark),
    landmarks=landmarks,
    head=study.head_markers or None,
)
print(write_layout_report(study, FOLDER.with_name("layout.html"), facts=facts))
print(write_layout_map(study, FOLDER.with_name("layout.csv")))
