"""Work and precision: core time against error of the solver and of what else could solve the same joints."""
