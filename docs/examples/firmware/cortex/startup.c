/* Starts a Cortex-M: the vector table, constants that change, and the unit for floats where there is
   one. The rest is newlib's. */
#include <stdint.h>

extern uint32_t ec_stack_top;
extern const uint32_t ec_data_load[];
extern uint32_t ec_data[];
extern uint32_t ec_data_end[];
void _start(void);

static void reset(void) {
  const uint32_t *from = ec_data_load;
  for (uint32_t *to = ec_data; to < ec_data_end;) *to++ = *from++;
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
