/* dolfbuoy for programs in C, C++, Fortran, MATLAB: a scene that its caller steps.  See README.md of dolfbuoy/coupling.

   SI units; world frame with z up and z = 0 at still water; quaternions (q0, q1, q2, q3), q0 first.
   Functions return 0; 2 for what is not possible, 1 when a solve failed, 3 for anything else: dolfbuoy_message says why.
   One thread at a time.  Until dolfbuoy_close every session has its own scene and state. */

#ifndef DOLFBUOY_H
#define DOLFBUOY_H
#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif

/* From here on cffi reads too: no preprocessor. */

typedef struct dolfbuoy dolfbuoy;

/* A session with a scene: a shipped name, or the path of a TOML file.  Nothing is computed before dolfbuoy_init. */
dolfbuoy *dolfbuoy_create(const char *scene);

/* Before dolfbuoy_init: change a key of the scene, "waves.amplitude=1.5"; drive an end of a line, "cable.to", a buoy,
   a vessel that rests in the scene, a free joint, or the length of a line, "cable.winch"; record in a folder, as a run
   does. */
int dolfbuoy_set(dolfbuoy *session, const char *assignment);
int dolfbuoy_drive(dolfbuoy *session, const char *name);
int dolfbuoy_record(dolfbuoy *session, const char *folder);

/* The equilibrium, from which the session starts. */
int dolfbuoy_init(dolfbuoy *session);

/* Of all that is driven, in the order in which it was named:
   x: of an end its position (3) [m], of a buoy position of C and quaternion (7), of a winch the unstretched length (1);
   v: of an end its velocity (3) [m/s], of a buoy velocity of C and angular velocity (6) [m/s, rad/s], of a winch its (1);
   f: of an end the pull of the line on what holds it (3) [N], of a buoy force and moment about C of all its lines (6),
      of a winch the mean tension of what it winds (1) [N].
   Of a vessel as of a buoy, about its reference point; of a joint as of an end.
   How many numbers these are, and what they are now; a pointer may be NULL. */
int dolfbuoy_sizes(dolfbuoy *session, int *of_x, int *of_v);
int dolfbuoy_now(dolfbuoy *session, double *t, double *x, double *f);

/* Go on by dt [s].  x, v: at its end; v may be NULL: parabolas through the last positions then.  f: at its end.
   t is set to the new time. */
int dolfbuoy_step(dolfbuoy *session, const double *x, const double *v, double *f, double *t, double dt);

/* A load on a buoy that is not driven, a free joint or a free end, until another one: force (3) [N], moment (3) [N m]. */
int dolfbuoy_load(dolfbuoy *session, const char *name, const double *force, const double *moment);

/* Motion of a buoy: position of C, quaternion, velocity, angular velocity (13). */
int dolfbuoy_state(dolfbuoy *session, const char *buoy, double *state);

/* `count` numbers of a quantity by its name in a record, such as "tension_top" (one of each cable). */
int dolfbuoy_values(dolfbuoy *session, const char *quantity, double *values, int count);

/* Elevation of the undisturbed water over `count` points (x, y) [m]. */
int dolfbuoy_elevation(dolfbuoy *session, const double *points, int count, double *elevation);

/* Keep the present instant in memory under a new number; be there again, bit for bit, as often as needed; forget it. */
int dolfbuoy_save(dolfbuoy *session, int *number);
int dolfbuoy_restore(dolfbuoy *session, int number);
int dolfbuoy_forget(dolfbuoy *session, int number);

/* A kept instant as bytes, which another session of the same scene, in any process, makes an instant of its own of:
   pack with bytes NULL sets their count only, else they must have room for it. */
int dolfbuoy_pack(dolfbuoy *session, int number, unsigned char *bytes, size_t *count);
int dolfbuoy_unpack(dolfbuoy *session, const unsigned char *bytes, size_t count, int *number);

/* What the latest function that failed has to say; one sentence, which stays until the next call. */
const char *dolfbuoy_message(dolfbuoy *session);

/* Bring the record to the disk and give everything back, the session too unless this fails. */
int dolfbuoy_close(dolfbuoy *session);

/* To here. */

#ifdef __cplusplus
}
#endif
#endif
