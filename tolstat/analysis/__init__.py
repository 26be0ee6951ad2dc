"""Statistical estimates with intervals, one file per question: plain arrays only, no files, figures or physics."""
