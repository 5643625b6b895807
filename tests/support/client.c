/* A program in C that steps a scene: prints time and pull of every step; tests/coupling/test_c_client.py compares. */

#include "dolfbuoy.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define CHECK(call) do { int code = (call); if (code) { printf("%d %s\n", code, dolfbuoy_message(s)); return code; } } while (0)

int main(int argc, char **argv)
{
    double t, x[3], v[3], f[3], eta[2], tension[1];
    const double points[4] = {0.0, 0.0, 10.0, 5.0};
    int of_x, of_v, here;
    dolfbuoy *s = dolfbuoy_create(argv[1]);
    if (argc > 3)
        CHECK(dolfbuoy_set(s, argv[3]));
    CHECK(dolfbuoy_drive(s, "cable.to"));
    CHECK(dolfbuoy_record(s, argv[2]));
    CHECK(dolfbuoy_init(s));
    CHECK(dolfbuoy_sizes(s, &of_x, &of_v));
    CHECK(dolfbuoy_now(s, &t, x, f));
    printf("%d %d %.17g %.17g %.17g %.17g\n", of_x, of_v, t, x[0], x[1], x[2]);
    for (int k = 1; k <= 20; ++k) {
        memset(v, 0, sizeof v);
        x[2] = -3.5 + 0.125 * k * k / 64;
        v[2] = 0.25 * k / 64 / 0.02;
        if (k == 10)
            CHECK(dolfbuoy_save(s, &here));
        CHECK(dolfbuoy_step(s, x, v, f, &t, 0.02));
        if (k == 10) {  /* once more */
            CHECK(dolfbuoy_restore(s, here));
            CHECK(dolfbuoy_step(s, x, v, f, &t, 0.02));
            CHECK(dolfbuoy_forget(s, here));
        }
        printf("%.17g %.17g %.17g %.17g\n", t, f[0], f[1], f[2]);
    }
    CHECK(dolfbuoy_elevation(s, points, 2, eta));
    CHECK(dolfbuoy_values(s, "tension_top", tension, 1));
    printf("%.17g %.17g %.17g\n", eta[0], eta[1], tension[0]);
    printf("%d\n", dolfbuoy_step(s, x, v, f, &t, NAN));
    printf("%s\n", dolfbuoy_message(s));
    return dolfbuoy_close(s);
}
