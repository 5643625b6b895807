"""Small motions about an equilibrium."""

#: Value of k R above which strips of a hull of radius R have errors of 20 to 100 % in waves (measured against potential
#: flow).
LARGEST_KR = 0.6
