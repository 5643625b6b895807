"""Moorings in the files of other programs: MoorDyn's input, and the YAML of MoorPy and RAFT."""
