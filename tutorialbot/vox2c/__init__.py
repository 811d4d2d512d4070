"""Paper 3: a whole C-space from voxels at once, and plans on it."""
