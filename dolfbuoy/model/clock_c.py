"""What is given as a function of time and wanted in every step, in C: a regular wave, an end that swings.

In Python `sea.amplitude`, `sea.time_phase` and `held.Swing` say the same, to the last bit.
"""

from ..solver import c_code
from ..solver.c_code import address
from ..solver.rows import Work

_DECLARATIONS = """
typedef struct {
    const double *t;
    double size, ramp, phase, frequency;
    double *amplitude, *time_phase;
} wave;

typedef struct {
    const double *t;
    double position[3], amplitude[3], phase[3], period, ramp;
    double *out;
} swing;

void advance_wave(const void *context);
void advance_swing(const void *context);
"""

_SOURCE = """
#include <math.h>
static const double PI = 3.141592653589793;

static double grown(double t, double duration)
{
    return t < duration ? 0.5 * (1 - cos(PI * t / duration)) : 1.0;
}

void advance_wave(const void *context)
{
    const wave *W = context;
    *W->amplitude = W->size * grown(*W->t, W->ramp);
    *W->time_phase = W->phase - W->frequency * *W->t;
}

void advance_swing(const void *context)
{
    const swing *S = context;
    const double angle = 2 * PI * *S->t / S->period, size = grown(*S->t, S->ramp);
    for (int k = 0; k < 3; ++k)
        S->out[k] = S->position[k] + size * sin(angle + S->phase[k]) * S->amplitude[k];
}
"""


def compiled():
    """The compiled module."""
    return c_code.module("clock", _DECLARATIONS, c_code.EVERY_PRODUCT_ROUNDED + _SOURCE)


def wave(time, size, ramp, phase, frequency, out):
    """A function that puts amplitude and phase of a regular wave at time[0] into the arrays `out`, (1,) each."""
    fields = [address(time), size, ramp, phase, frequency, *map(address, out)]
    return _work("wave", fields, (time, out))


def swing(time, position, amplitude, phase, period, ramp, out):
    """A function that puts the place of a `held.Swing` at time[0] into the array `out` (3,)."""
    return _work("swing", [address(time), position, amplitude, phase, period, ramp, address(out)], (time, out))


def _work(name, fields, alive):
    library = compiled()
    return Work.of(library, f"advance_{name}", library.ffi.new(f"{name} *", fields), alive)
