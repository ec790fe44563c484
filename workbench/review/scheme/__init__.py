"""The coding scheme in the page: labels, colours, keys, tiers and the coding manual."""
