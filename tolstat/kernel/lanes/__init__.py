"""Many joints in lock-step, one in each SIMD lane.

Arguments
---------
batch : Batch
    Memory of the lanes.
queue : Queue
    The joints, and where their results are written.
control, motion : records
    Those of the batch, read joint by joint or, in functions of all lanes, read as lanes.
tangent : record of FACTORS, read as lanes
    The factorised tangents in use.
lanes : tuple
    Parameters, work and motion of all joints, read as lanes.
joint : int
    Row of the joint among those of the queue.
"""
