/* Requests of a program on a Cortex-M to its emulator. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

/* Prints a line of text. */
void print(const char *line);

/* Ends the emulator with this exit code; does not return. */
void leave(uint32_t code);

#endif
