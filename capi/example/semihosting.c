#include "semihosting.h"

static void request(uint32_t number, const void *argument) {
    register uint32_t r0 __asm__("r0") = number;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

void print(const char *line) {
    request(0x04, line);
    request(0x04, "\n");
}

void leave(uint32_t code) {
    const uint32_t block[2] = {0x20026, code};
    request(0x20, block);
    for (;;) {
    }
}
