"""Which orders of the input speed the loads of the shafts have, and how their lateral force turns."""
