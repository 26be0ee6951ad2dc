"""Which line of the drawing to change."""
