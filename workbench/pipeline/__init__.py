"""From a recording to labelled segments: one file a stage, each working on a whole corpus.

A stage reads the corpus, calls the plain functions of ``features``, ``synthesis`` and ``models``, and writes one
commit. What was derived before from the same inputs with the same parameters is not derived again.
"""
