"""Commands over the number of joints: time, memory and size of their files, each in a process of its own."""
