"""Parts that are scrapped and joints that are rejected: yield before and after, and what a good joint costs."""
