"""Many joints in lock-step, one in each SIMD lane.

Arguments
---------
batch : Batch
    Memory of the lanes.
control, motion : records of CONTROL and MOTION
    Those of the batch, read joint by joint or, in functions of all lanes, read as lanes.
kept : record of WORK, read as lanes
    Blocks of the factorised tangents.
lanes : tuple
    Parameters, work and motion of all joints, read as lanes.
joint : int
    Row of the joint among those simulated together.
words : ndarray, shape (n, words)
    The memory of `rows` as doubles.
starts : ndarray, shape (n, 56)
    Where the search for each joint's start begins, see `revolution.starts`.
steps : ndarray of int, shape (n,)
    Steps of the first revolution of each joint.
left : ndarray of int, shape (n,)
    Newton iterations still allowed to each joint.
samples : ndarray of SAMPLE, shape (n, steps_per_rev) or (0, steps_per_rev)
    The last revolution of every joint, written unless empty; in `course` that of the lane's joint.
blocks : ndarray of KERNEL_RESULT, shape (n, revolutions) or (0, revolutions)
    Statistics of the last revolutions of every joint, written unless empty.
results : ndarray of KERNEL_RESULT, shape (n,)
    Written: results of all joints.
"""
