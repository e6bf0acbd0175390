/* Start-up code for the MPS2 board with image AN386, a Cortex-M4 that QEMU emulates. */
#include "semihosting.h"

extern uint32_t data_start, data_end, data_stored, bss_start, bss_end, stack_top;

int main(void);
void reset(void);

static void fault(void) { leave(2); }

void reset(void) {
    /* The floating-point unit, in which doubles are passed. */
    *(volatile uint32_t *)0xe000ed88 |= 0xfu << 20;
    __asm__ volatile("dsb\nisb");
    for (uint32_t *to = &data_start, *from = &data_stored; to < &data_end;) {
        *to++ = *from++;
    }
    for (uint32_t *to = &bss_start; to < &bss_end;) {
        *to++ = 0;
    }
    leave((uint32_t)main());
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    &stack_top,          (const void *)reset, (const void *)fault, (const void *)fault, (const void *)fault,
    (const void *)fault, (const void *)fault, 0,                   0,                   0,
    0,                   (const void *)fault, (const void *)fault, 0,                   (const void *)fault,
    (const void *)fault,
};
