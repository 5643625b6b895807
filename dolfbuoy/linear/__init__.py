"""Small motions about an equilibrium."""

#: Strips of a hull of radius R are 20 to 100 % wrong in waves whose k R is more than this (measured against potential
#: flow).
LARGEST_KR = 0.6
