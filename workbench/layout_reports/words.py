"""What a layout report says beside its figures, on the page and on paper alike. Plain text, no markup."""

from __future__ import annotations

SHEET = (
    "Numbers are those of the pictures. Left and right are the subject's. Distances are straight and of the rig's "
    "neutral face: the first up or down, the second level; on another face they scale with it, so go by the landmarks. "
    "Outside is away from the midline. The partner is the marker on the other side."
)
HEAD = (
    "Four to six rigid markers are needed in every capture to tell the head's motion from the face's (Reverdy 2019, "
    "5.2). They sit where no expression moves the skin; where that is under hair, use a band or a cap."
)
FRONT = (
    "The recommended layout from the front. White dots are markers, black squares the rigid head markers; what is "
    "hidden here is in the side views."
)
SIDES = "The same from the subject's right and left. Head markers that hair hides are drawn all the same."
CURVES = (
    "Mean distance of a vertex from where it should be, against the number of markers. Every layout is reconstructed "
    "by the same {reconstruction}, with the same noise. Bands and whiskers: 95 % bootstrap intervals over pairs of a "
    "tested actor and a take; with few pairs they are too narrow. k-means median is the median of the seeds in every "
    "pair. STAR and MAN sets have sizes of their own."
)
RECONSTRUCTIONS = (
    "The same layouts, made into faces in three ways: by the thesis's regression (sogp), which has seen true weights "
    "of the range of motion; by the default weight solver; and by a thin shell alone, without the rig's shapes. "
    "{actors}."
)
FIGURE_3_3 = (
    "Figure 3.3 redrawn: the STAR sets, training and test by the same actor ({reconstruction}). The scale on the left "
    "is the RMSE as printed, which is divided by the frames and not by the vertices, so that it grows with the mesh; "
    "on the right it is divided by √P as well, in mm of a vertex."
)
FIGURE_3_5 = (
    "Figure 3.5 (a) redrawn: the MAN sets against their size, training and test by the same actor ({reconstruction}). "
    "Scales as in the figure before."
)
FIGURE_3_7 = (
    "Figure 3.7 redrawn: k-means learned from one actor and from several, for each tested actor ({reconstruction}). "
    "Scales as before."
)
FIGURE_3_8 = (
    "Figure 3.8 redrawn: STAR and MAN sets beside k-means, for each tested actor ({reconstruction}). Scales as before."
)
SETS = (
    "Sets of the literature are placed by anatomical names. Only MPEG-4's follow a published list; the others are "
    "rebuilt, because no list of their points was found: read a comparison with them as one with sets of that size and "
    "kind."
)
REGIONS = (
    "Error by region (after Figure 3.4), on one scale for all faces; numbers in mm. The forehead counts as brows, jaw "
    "and neck as cheeks and chin. Mean over tested actors and takes ({reconstruction})."
)
RESPONSE = (
    "What noise of the markers and their misplacement on the skin cost. One curve a layout, mean over tested actors "
    "and takes."
)
LOSSES = (
    "Error when one or two markers are lost: the mean over which (circle), and with those whose loss does most harm "
    "(diamond). Lost markers are missing from the solve, not filled in."
)
STABILITY = (
    "How far a method chooses the same places again: Jaccard index of two layouts, where vertices within 10 mm of each "
    "other count as the same. 1 is the same layout."
)
SYMMETRY = (
    "Mean distance of a layout's markers from the nearest of its mirror image, for layouts learned from one actor and "
    "from several."
)
MISMATCH = (
    "How much of the error is not the markers': what remains with the actor's own rig, or with a marker on every "
    "moving vertex, tells the noise from the difference between two people's faces."
)
LABELS = (
    "Agreement of the labels with the reference when only a layout's markers exist. Simulated takes say how the "
    "method works, and nothing about people."
)
ABSENT = {
    "curves": "errors; the study has none.",
    "thesis": "Figures 3.3 to 3.8; the study has neither named sets nor k-means from several actors.",
    "regions": "errors by region; the study has none.",
    "robustness": "noise, misplacement and lost markers; they were not tried.",
    "stability": "stability; layouts were chosen once only.",
    "mismatch": "the part of two faces' difference in the error; it was not tried.",
    "labels": "accuracy of labels; no take of this corpus is labelled and has markers on this rig.",
}
