"""Many joints in lock-step, one in each SIMD lane.

Arguments
---------
batch : Batch
    Memory of the lanes.
queue : Queue
    The joints, and where their results are written.
control, motion : records
    Those of the batch, read joint by joint or, in functions of all lanes, read as lanes.
tangent : record of WORK, read as lanes
    Blocks of the factorised tangents.
lanes : tuple
    Parameters, work and motion of all joints, read as lanes.
joint : int
    Row of the joint among those of the queue.
"""
