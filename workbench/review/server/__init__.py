"""The web server of the review page: one process a corpus."""
