#ifndef SELFLOCK_PYTHON_H
#define SELFLOCK_PYTHON_H

#include <stddef.h>

/* Make sure that a Python interpreter runs in this process and that its symbols are there for all.
   Returns 1, or 0 with a sentence for people in `why`. */
int python_ready(char *why, size_t size);

#endif
