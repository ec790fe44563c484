"""The review page: the server that keeps annotators' edits, and the page in the browser."""
