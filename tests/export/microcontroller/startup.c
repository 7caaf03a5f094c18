/* Starts a Cortex-M of QEMU: the vector table, and the unit for floats where there is one. */
#include <stdint.h>

extern uint32_t ec_stack_top;
void _start(void);

static void reset(void) {
#if defined(__ARM_FP)
  *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* CPACR */
#endif
  _start();
}

static void stop(void) {
  for (;;) {
  }
}

__attribute__((section(".vectors"), used)) static const struct {
  uint32_t *stack;
  void (*handlers[3])(void);
} vectors = {&ec_stack_top, {reset, stop, stop}};
