/* A Cortex-M7 with double precision, QEMU's mps2-an500: vectors, start-up, text, and the three functions that
 * a compiler calls by itself. Compile it with -fno-tree-loop-distribute-patterns: a loop that copies is no call
 * of memcpy in memcpy itself. */
#include "board.h"
#include <stddef.h>
#include <stdint.h>

extern unsigned char stack_top[], data_start[], data_end[], bss_start[], bss_end[];
extern const unsigned char data_load[];

/* Coprocessor access, and the first serial line. */
#define CPACR (*(volatile uint32_t *)0xe000ed88u)
#define UART_DATA (*(volatile uint32_t *)0x40004000u)
#define UART_CONTROL (*(volatile uint32_t *)0x40004008u)
#define UART_DIVIDER (*(volatile uint32_t *)0x40004010u)

void *memcpy(void *to, const void *from, size_t bytes);
void *memmove(void *to, const void *from, size_t bytes);
void *memset(void *to, int value, size_t bytes);
void reset(void);

void *memcpy(void *to, const void *from, size_t bytes) {
    unsigned char *t = to;
    const unsigned char *f = from;
    while (bytes-- > 0) {
        *t++ = *f++;
    }
    return to;
}

void *memmove(void *to, const void *from, size_t bytes) {
    unsigned char *t = (unsigned char *)to + bytes;
    const unsigned char *f = (const unsigned char *)from + bytes;
    if ((uintptr_t)to <= (uintptr_t)from) {
        return memcpy(to, from, bytes);
    }
    while (bytes-- > 0) {
        *--t = *--f;
    }
    return to;
}

void *memset(void *to, int value, size_t bytes) {
    unsigned char *t = to;
    while (bytes-- > 0) {
        *t++ = (unsigned char)value;
    }
    return to;
}

void board_write(const char *text) {
    for (; *text != '\0'; text++) {
        UART_DATA = (unsigned char)*text; /* the emulated line is never busy */
    }
}

/* Ends the emulation: semihosting's SYS_EXIT_EXTENDED, ADP_Stopped_ApplicationExit. */
static void leave(uint32_t status) {
    const uint32_t block[2] = {0x20026, status};
    for (;;) {
        register uint32_t operation __asm__("r0") = 0x20;
        register const uint32_t *argument __asm__("r1") = block;
        __asm__ volatile("bkpt #0xab" : "+r"(operation) : "r"(argument) : "memory");
    }
}

/* Every exception of the processor, an overflow of the stack among them: nothing lies below it. */
static void fault(void) { leave(102); }

static const struct {
    void *stack;
    void (*handlers[15])(void);
} vectors __attribute__((section(".vectors"), used)) = {
    stack_top,
    {reset, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault},
};

void reset(void) {
    CPACR |= 0xf00000; /* floating point on, rounding to nearest, no flush to zero */
    __asm__ volatile("dsb\n\tisb\n\tvmsr fpscr, %0" : : "r"(0) : "memory");
    memcpy(data_start, data_load, (size_t)(data_end - data_start));
    memset(bss_start, 0, (size_t)(bss_end - bss_start));
    UART_DIVIDER = 16;
    UART_CONTROL = 1;
    leave((uint32_t)image());
}
