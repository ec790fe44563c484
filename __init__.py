"""mimique: a workbench for facial motion-capture corpora.

Marker recordings go in; a versioned, annotated, animatable corpus comes out. The work is done in

- :mod:`mimique.corpus`: files in and out, annotation tiers, the versioned store;
- :mod:`mimique.synthesis`: rigs, morph adaptation, weight solving, the avatar, simulated signers, playback;
- :mod:`mimique.features`: head stabilisation, energies, segments;
- :mod:`mimique.models`: classifiers, metrics, layouts;
- :mod:`mimique.workbench`: command line, pipeline, reports.

Conventions, everywhere: millimetres, seconds, hertz; +X is the subject's left, +Y up, +Z out of the face; frames
are integers counted from zero and intervals are half-open, ``[onset, offset)``.
"""

from .errors import (
    ConflictError,
    CorpusError,
    FileFormatError,
    InputError,
    MimiqueError,
    NotFoundError,
    RigError,
)

__version__ = "0.1.0"

__all__ = [
    "ConflictError",
    "CorpusError",
    "FileFormatError",
    "InputError",
    "MimiqueError",
    "NotFoundError",
    "RigError",
    "__version__",
]
