"""How things are shown: text, style of figures, blocks of a page."""
