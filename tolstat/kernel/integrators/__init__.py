"""Methods of integration in time, and the steps that they take."""
