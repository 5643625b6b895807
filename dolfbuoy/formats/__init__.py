"""Moorings in the files of other programs: MoorDyn, MAP++, MoorPy and RAFT, WISDEM, FAModel; and Capytaine."""
