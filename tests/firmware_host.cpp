// The firmware's protocol on this machine: over stdin and stdout, or as a dump of its registers.
#include <stdio.h>
#include <initializer_list>
#include <unistd.h>

#include "protocol.h"

#ifndef AXIS_COUNT
#define AXIS_COUNT 1
#endif
constexpr uint16_t kTaxels = 100;
taxels::Registers<kTaxels, WIDTH, AXIS_COUNT> registers;
taxels::Link<kTaxels, WIDTH, AXIS_COUNT> serial_link(registers);

static void sample() {
  static uint16_t n = 0, values[registers.kValues];
  for (uint16_t i = 0; i < registers.kValues; i++) values[i] = (i * 41 + n) & ((1u << WIDTH) - 1);
  n++;
  registers.publish(values);
}

int main(int argc, char **) {
  if (argc > 1) {
    for (int n = 0; n < 3; n++) {
      for (uint8_t pointer : {0x00, 0x10, 0x77}) {
        uint8_t out[registers.kFrame];
        const size_t length = registers.read(pointer, out);
        for (size_t i = 0; i < length; i++) printf("%02x", out[i]);
        printf("\n");
      }
      sample();
    }
    return 0;
  }
  uint8_t byte;
  while (read(0, &byte, 1) == 1) {
    if (byte == 0) sample();
    serial_link.feed(byte, [](uint8_t out) {
      if (write(1, &out, 1) != 1) _exit(1);
    });
  }
}
