"""Compilation of kernels, and SIMD arithmetic on several joints at once."""
