"""Many joints in lock-step, one in each SIMD lane."""
