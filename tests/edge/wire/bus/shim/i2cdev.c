/* Stands in for /dev/i2c-1 to /dev/i2c-9 under an unmodified smbus2 (LD_PRELOAD).
 *
 * Each bus carries one TCA9548A at 0x70 with an AD7147 at 0x2C to 0x2F on each channel. The chips
 * serve 1000 * bus + 100 * channel + 12 * (address - 0x2C) + stage once they are set up. The
 * adapter is as strict as real ones: a read anywhere but last gives EOPNOTSUPP, a second address
 * in one call EINVAL, an address that nobody has EREMOTEIO; a channel connects after the call.
 *
 * I2CDEV_LOG names a file that gets a line for each ioctl but I2C_RDWR; I2CDEV_MUTE=bus:address
 * takes one address of channel 0 away, I2CDEV_SHORT=address lets the calls to an address complete
 * only the first of their messages. With I2CDEV_LOCKED another program holds the lock of every
 * bus, and I2CDEV_OWNED=address is an address that a driver of the kernel owns.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

enum { BUSES = 10, CHANNELS = 8, CHIPS = 4, REGISTERS = 0x400, HANDLES = 1024 };

struct chip { uint16_t registers[REGISTERS]; uint16_t pointer; };
struct bus { uint8_t control, connected; struct chip chips[CHANNELS][CHIPS]; };

static struct bus buses[BUSES];
static int bus_of[HANDLES];
static long timeout_of[HANDLES];
static pthread_once_t once = PTHREAD_ONCE_INIT;

static void start(void)
{
    for (int b = 0; b < BUSES; b++)
        for (int n = 0; n < CHANNELS; n++)
            for (int c = 0; c < CHIPS; c++)
                buses[b].chips[n][c].registers[0x17] = 0x1473;
}

static void note(const char *text, long value)
{
    const char *path = getenv("I2CDEV_LOG");
    FILE *file = path ? fopen(path, "a") : NULL;
    if (file) {
        fprintf(file, "%s %ld\n", text, value);
        fclose(file);
    }
}

static uint16_t load(int b, int n, int c, struct chip *chip, uint16_t r)
{
    int set_up = chip->registers[0x00] == 0x02B0 && chip->registers[0x01] == 0x0FFF;
    if (r >= 0x0B && r < 0x17)
        return set_up ? 1000 * b + 100 * n + 12 * c + (r - 0x0B) : 0;
    return chip->registers[r % REGISTERS];
}

static int carry(int b, struct i2c_msg *m)
{
    struct bus *bus = &buses[b];
    int muted_bus = -1, muted = -1, c = m->addr - 0x2C, n;
    if (m->addr == 0x70) {
        if (m->flags & I2C_M_RD)
            memset(m->buf, bus->control, m->len);
        else if (m->len)
            bus->control = m->buf[m->len - 1];
        return 0;
    }
    const char *mute = getenv("I2CDEV_MUTE");
    if (mute)
        sscanf(mute, "%d:%i", &muted_bus, &muted);
    if (c < 0 || c >= CHIPS || !bus->connected || (muted_bus == b && muted == m->addr && bus->connected == 1))
        return EREMOTEIO;
    for (n = 0; !(bus->connected >> n & 1); n++)
        ;
    struct chip *chip = &bus->chips[n][c];
    if (m->flags & I2C_M_RD) {
        for (int i = 0; i < m->len; i++) {
            uint16_t word = load(b, n, c, chip, chip->pointer + i / 2);
            m->buf[i] = i % 2 ? word & 0xFF : word >> 8;
        }
        return 0;
    }
    if (m->len >= 2)
        chip->pointer = (m->buf[0] << 8 | m->buf[1]) % REGISTERS;
    for (int i = 2; i + 1 < m->len; i += 2)
        chip->registers[(chip->pointer + i / 2 - 1) % REGISTERS] = m->buf[i] << 8 | m->buf[i + 1];
    return 0;
}

static int transfer(int b, struct i2c_rdwr_ioctl_data *call)
{
    if (call->nmsgs > I2C_RDWR_IOCTL_MAX_MSGS)
        return EINVAL;
    for (unsigned i = 0; i < call->nmsgs; i++) {
        if (call->msgs[i].len > 8192 || call->msgs[i].addr != call->msgs[0].addr)
            return EINVAL;
        if (i + 1 < call->nmsgs && call->msgs[i].flags & I2C_M_RD)
            return EOPNOTSUPP;
    }
    for (unsigned i = 0; i < call->nmsgs; i++) {
        int error = carry(b, &call->msgs[i]);
        if (error)
            return error;
    }
    buses[b].connected = buses[b].control;
    return 0;
}

static int bus_from(const char *path)
{
    int b = 0;
    return path && sscanf(path, "/dev/i2c-%d", &b) == 1 && b > 0 && b < BUSES ? b : 0;
}

static int opened(int b)
{
    int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, "open64");
    int fd = real("/dev/null", O_RDWR | O_CLOEXEC);
    pthread_once(&once, start);
    if (fd >= 0 && fd < HANDLES) {
        bus_of[fd] = b;
        timeout_of[fd] = 100;
    }
    return fd;
}

#define OPEN(name)                                                   \
    int name(const char *path, int flags, ...)                       \
    {                                                                \
        int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, #name); \
        va_list rest;                                                \
        va_start(rest, flags);                                       \
        int mode = va_arg(rest, int);                                \
        va_end(rest);                                                \
        int b = bus_from(path);                                      \
        return b ? opened(b) : real(path, flags, mode);              \
    }
OPEN(open)
OPEN(open64)

int close(int fd)
{
    int (*real)(int) = dlsym(RTLD_NEXT, "close");
    if (fd >= 0 && fd < HANDLES)
        bus_of[fd] = 0;
    return real(fd);
}

int flock(int fd, int operation)
{
    int (*real)(int, int) = dlsym(RTLD_NEXT, "flock");
    if (fd < 0 || fd >= HANDLES || !bus_of[fd])
        return real(fd, operation);
    if (!getenv("I2CDEV_LOCKED"))
        return 0;
    errno = EWOULDBLOCK;
    return -1;
}

int ioctl(int fd, unsigned long request, ...)
{
    static int (*real)(int, unsigned long, ...);
    va_list rest;
    va_start(rest, request);
    void *argument = va_arg(rest, void *);
    va_end(rest);
    if (!real)
        real = dlsym(RTLD_NEXT, "ioctl");
    int b = fd >= 0 && fd < HANDLES ? bus_of[fd] : 0;
    if (!b)
        return real(fd, request, argument);
    if (request == I2C_FUNCS) {
        *(unsigned long *)argument = I2C_FUNC_I2C;
        return 0;
    }
    if (request == I2C_TIMEOUT) {
        timeout_of[fd] = (long)argument;
        note("timeout", timeout_of[fd]);
        return 0;
    }
    if (request == I2C_SLAVE) {
        const char *owned = getenv("I2CDEV_OWNED");
        if (!owned || (long)argument != strtol(owned, NULL, 0))
            return 0;
        errno = EBUSY;
        return -1;
    }
    if (request != I2C_RDWR) {
        note("unexpected", (long)request);
        errno = ENOTTY;
        return -1;
    }
    struct i2c_rdwr_ioctl_data *call = argument;
    const char *address = getenv("I2CDEV_SHORT");
    if (address && call->nmsgs > 1 && call->msgs[0].addr == strtol(address, NULL, 0))
        return 1; /* the pointer was written, nothing was read */
    int error = transfer(b, call);
    if (error) {
        errno = error;
        return -1;
    }
    return call->nmsgs;
}
