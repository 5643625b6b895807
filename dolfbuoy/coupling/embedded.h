/* First in the glue of libdolfbuoy: extension modules look for Python's functions among those of all libraries, where a
   host that loads this one later does not put them.  A host that is Python has its own. */
#ifndef DOLFBUOY_EMBEDDED_H
#define DOLFBUOY_EMBEDDED_H
#define _GNU_SOURCE
#include <dlfcn.h>

__attribute__((constructor)) static void share_python(void)
{
    if (!dlsym(RTLD_DEFAULT, "Py_IsInitialized"))
        dlopen(PYTHON_LIBRARY, RTLD_LAZY | RTLD_GLOBAL);
}

#include "dolfbuoy.h"
#endif
