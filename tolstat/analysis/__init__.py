"""One file a question, each on plain arrays: no file, no figure, no physics is known here."""
