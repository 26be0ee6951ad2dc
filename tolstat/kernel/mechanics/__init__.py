"""The joint's mechanics: geometry, bushings, contact, equations of motion and their tangent."""
