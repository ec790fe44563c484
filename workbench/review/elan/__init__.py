"""ELAN's files from and to the page: drafts as ``.eaf``, and ``.eaf`` as an edit of a draft."""
