/* Decides on the vectors of input.bin by the header that MODEL names, and writes the labels, and then
   the instructions that they took, to output.bin. With -icount shift=0 QEMU takes a nanosecond for an
   instruction; the timer of its boards counts at 25 MHz. */
#include <stdint.h>
#include <stdio.h>

#include MODEL

#define CONTROL (*(volatile uint32_t *)0xE000E010u) /* SysTick's registers */
#define RELOAD (*(volatile uint32_t *)0xE000E014u)
#define CURRENT (*(volatile uint32_t *)0xE000E018u)
#define LARGEST 0xFFFFFFu
#define INSTRUCTIONS_OF_TICK 40.0

int main(void) {
  static feature x[WIDTH];
  FILE *input = fopen("input.bin", "rb");
  FILE *output = fopen("output.bin", "wb");
  double instructions = 0.0;
  RELOAD = LARGEST;
  CURRENT = 0;
  CONTROL = 5; /* count the processor's clock */
  while (fread(x, sizeof x, 1, input) == 1) {
    uint32_t begin = CURRENT;
    __asm__ volatile("" ::: "memory"); /* decided between both readings */
    volatile double label = decide(x);
    instructions += INSTRUCTIONS_OF_TICK * ((begin - CURRENT) & LARGEST);
    fwrite((const void *)&label, sizeof label, 1, output);
  }
  fwrite(&instructions, sizeof instructions, 1, output);
  fclose(output);
  return 0;
}
