"""Instruments: ``cost`` of a joint, ``precision`` (speed against error); beside them what both use."""
