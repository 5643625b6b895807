#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Notes in the file LOOKS_TO every name below the folder LOOKS_AT that is opened or asked about. */
static void look(const char *what, int at, const char *path)
{
    const char *below = getenv("LOOKS_AT"), *to = getenv("LOOKS_TO");
    char whole[2 * PATH_MAX], line[3 * PATH_MAX];
    if (!below || !to || !path || !*path) return;
    if (path[0] == '/') snprintf(whole, sizeof whole, "%s", path);
    else if (at == AT_FDCWD && getcwd(line, PATH_MAX)) snprintf(whole, sizeof whole, "%s/%s", line, path);
    else return;
    size_t size = strlen(below);
    if (strncmp(whole, below, size) || whole[size] != '/') return;
    int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, "open");
    int log = real(to, O_WRONLY | O_APPEND | O_CREAT, 0666);
    int length = snprintf(line, sizeof line, "%s %s\n", what, whole + size + 1);
    if (log >= 0) { if (write(log, line, length) < 0) abort(); close(log); }
}
#define REAL(type, name, ...) type (*real)(__VA_ARGS__) = dlsym(RTLD_NEXT, #name)
#define OPEN(name) int name(const char *path, int flags, ...) { REAL(int, name, const char *, int, ...); \
    va_list more; va_start(more, flags); mode_t mode = va_arg(more, mode_t); va_end(more); \
    look("open", AT_FDCWD, path); return real(path, flags, mode); }
OPEN(open) OPEN(open64)
#define OPENAT(name) int name(int at, const char *path, int flags, ...) { REAL(int, name, int, const char *, int, ...); \
    va_list more; va_start(more, flags); mode_t mode = va_arg(more, mode_t); va_end(more); \
    look("open", at, path); return real(at, path, flags, mode); }
OPENAT(openat) OPENAT(openat64)
#define FOPEN(name) FILE *name(const char *path, const char *mode) { REAL(FILE *, name, const char *, const char *); \
    look("open", AT_FDCWD, path); return real(path, mode); }
FOPEN(fopen) FOPEN(fopen64)
int access(const char *path, int mode) { REAL(int, access, const char *, int); look("look", AT_FDCWD, path); return real(path, mode); }
#define STAT(name, kind) int name(const char *path, struct kind *found) { REAL(int, name, const char *, struct kind *); \
    look("look", AT_FDCWD, path); return real(path, found); }
STAT(stat, stat) STAT(stat64, stat64) STAT(lstat, stat) STAT(lstat64, stat64)
#define FSTATAT(name, kind) int name(int at, const char *path, struct kind *found, int flags) { \
    REAL(int, name, int, const char *, struct kind *, int); look("look", at, path); return real(at, path, found, flags); }
FSTATAT(fstatat, stat) FSTATAT(fstatat64, stat64)
