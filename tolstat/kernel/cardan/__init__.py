"""Statics of rigid Cardan joints: the guess of an equilibrium, and loads of the ideal joint in closed form."""
