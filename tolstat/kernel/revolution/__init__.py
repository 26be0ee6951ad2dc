"""One joint, from its equilibrium through revolution after revolution until it settles."""
