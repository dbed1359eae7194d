/* What the sources of c_calls share. */
#ifndef PARTIEMC_C_CALLS_H_
#define PARTIEMC_C_CALLS_H_

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "partiemc/c/partiemc.h"

#define EXPECT(condition)                                                            \
  do {                                                                               \
    if (!(condition)) {                                                              \
      fprintf(stderr, "%s:%d: %s; last error: %s\n", __FILE__, __LINE__, #condition, \
              partiemc_last_error()->message);                                       \
      exit(1);                                                                       \
    }                                                                                \
  } while (0)

/* Calls that return surfaces, with the server at `address` or, if it is NULL, in process. */
void try_surfaces(const char* address);

/* Calls of streams with walls. */
void try_walls(const char* address);

#endif /* PARTIEMC_C_CALLS_H_ */
