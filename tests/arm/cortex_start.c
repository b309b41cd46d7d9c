/*
 * Start of a program on a Cortex-M4 in QEMU: its table of interrupts, the floating-point unit, main. QEMU
 * loads all sections to their places and clears the others. Input and output are those of newlib's librdimon,
 * by semihosting.
 */
#include <stdint.h>
#include <stdlib.h>

extern int main(void);
extern void initialise_monitor_handles(void);
extern char stack_top[];
void reset(void);

/* The unit is off after a reset: coprocessors 10 and 11 in the register CPACR. */
void reset(void) {
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm volatile("dsb\n isb");
    initialise_monitor_handles();
    exit(main());
}

static void fault(void) {
    exit(9);
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {stack_top,
                                                                             (void *)reset,
                                                                             (void *)fault,
                                                                             (void *)fault,
                                                                             (void *)fault,
                                                                             (void *)fault,
                                                                             (void *)fault,
                                                                             0,
                                                                             0,
                                                                             0,
                                                                             0,
                                                                             (void *)fault,
                                                                             (void *)fault,
                                                                             0,
                                                                             (void *)fault,
                                                                             (void *)fault};
