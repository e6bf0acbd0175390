/* Ten seconds of the controller, on a host or a microcontroller. Prints a digest of every DAC code and every estimate, which is the
 * same on each. */
#include "vsj_settings.h"
#include "vsj_tick.h"

#if __STDC_HOSTED__
#include <stdio.h>
static void print(const char *line) { puts(line); }
#else
#include "semihosting.h"
#endif

enum { TICKS = 10000, TICKS_A_TARGET = 50 };

/* FNV-1a, over bytes in little-endian order. */
static void add(uint64_t *digest, uint32_t value, int bytes) {
    for (int byte = 0; byte < bytes; ++byte) {
        *digest = (*digest ^ (value >> (8 * byte) & 0xff)) * UINT64_C(0x100000001b3);
    }
}

int main(void) {
    static vsj_config config;
    static vsj_state state;
    vsj_error error;
    vsj_input input = {0};
    vsj_output output;
    uint64_t digest = UINT64_C(0xcbf29ce484222325);
    uint32_t random = 1;

    if (vsj_configure(&config, &VSJ_SETTINGS, &error) != VSJ_OK) {
        print("a setting is refused:");
        print(error.field);
        return 1;
    }
    vsj_start(&config, &state);
    for (int tick = 0; tick < TICKS; ++tick) {
        if (tick % TICKS_A_TARGET == 0) {
            /* Marsaglia's xorshift: targets of 0 to 511 V. */
            random ^= random << 13;
            random ^= random >> 17;
            random ^= random << 5;
            input.target = (int32_t)(random >> 3);
        }
        if (vsj_tick(&config, &state, &input, &output) != VSJ_OK) {
            print("a tick has failed");
            return 1;
        }
        add(&digest, output.code, 2);
        add(&digest, (uint32_t)output.stiffness, 4);
    }

    char line[] = "digest 0000000000000000";
    for (int digit = 0; digit < 16; ++digit) {
        line[7 + digit] = "0123456789abcdef"[digest >> (60 - 4 * digit) & 0xf];
    }
    print(line);
    return 0;
}
