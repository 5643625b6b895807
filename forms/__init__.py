"""The mathematics of a tethered buoy as plain UFL functions, one per physical term.

Independent of dolfinx, meshes, time schemes and scenes: arguments are UFL expressions, results are UFL
expressions or forms.  Equation numbers are those of Montano, Restelli and Sacco, *Modeling and numerical
simulation of tethered buoy dynamics*.

===============  ===============================================================
`rotation`       quaternions, angular velocity and acceleration
`sea`            Airy waves, stretching, current profiles
`morison`        drag and inertia of a slender member, Eq. (1)
`cable`          mixed form of the cable, Eqs. (6), (11)
`hull`           strips of the buoy's hull: wet section, Archimedes, Morison, Eq. (10)
`buoy`           Euler equations of the buoy, Eq. (8), and its static counterpart
`radiation`      radiation and diffraction of waves by a hull, from potential flow
`wind`           wind force, Eq. (2)
`coupling`       rigid link to the mooring point and coupling, Eqs. (9), (29)
`kinds`          types of arguments and results
===============  ===============================================================
"""
