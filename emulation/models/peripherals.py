"""Models of the peripherals that raise interrupts. Times are in cycles of the core."""


class Timer:
    """Counts up at the core's clock over PSC + 1; update and compare 1 to 4 set flags."""

    def __init__(self):
        self.regs, self.at, self.fraction = {}, 0, 0

    def get(self, offset):
        return self.regs.get(offset, 0xFFFF if offset == 0x2C else 0)

    def run(self, now):
        """Advances the counter to `now` and sets the flags of the events on the way."""
        ticks, self.fraction = divmod(now - self.at + self.fraction, self.get(0x28) + 1)
        self.at = now
        if not self.get(0x00) & 1 or ticks == 0:
            return
        count, span = self.get(0x24), self.get(0x2C) + 1
        flags = int(count + ticks >= span)
        for i in range(4):
            if 0 < (self.get(0x34 + 4 * i) - count - 1) % span + 1 <= ticks:
                flags |= 2 << i
        self.regs[0x10] = self.get(0x10) | flags
        self.regs[0x24] = (count + ticks) % span

    def next(self):
        """Cycles from the last `run` to the next flag that raises an interrupt."""
        if not self.get(0x00) & 1:
            return None
        count, span, enabled = self.get(0x24), self.get(0x2C) + 1, self.get(0x0C)
        goals = [0] if enabled & 1 else []
        goals += [self.get(0x34 + 4 * i) for i in range(4) if enabled & 2 << i]
        ticks = [(goal - count - 1) % span + 1 for goal in goals]
        return min(ticks) * (self.get(0x28) + 1) - self.fraction if ticks else None

    def write(self, offset, value):
        if offset == 0x10:
            self.regs[0x10] = self.get(0x10) & value  # Written zeros clear.
        elif offset != 0x14:
            self.regs[offset] = value
            if offset == 0x24:
                self.fraction = 0


class Capture:
    """TIM16 as the test of the clock uses it: captures of the LSI, whose period is `period` cycles, every PSC-th edge.
    `running()` is whether the LSI is on."""

    LSI = 6  # TIM16_TISEL.

    def __init__(self, period, running):
        self.period, self.running = period, running
        self.regs, self.started, self.taken = {}, None, 0

    def _captures(self, now):
        """Number of captures since the start."""
        regs = self.regs
        captures = regs.get(0x00, 0) & 1 and regs.get(0x20, 0) & 1 and regs.get(0x18, 0) & 3 == 1
        if not captures or regs.get(0x5C, 0) != self.LSI or not self.period or not self.running():
            return 0
        return int((now - self.started) / self._spacing())

    def _spacing(self):
        return self.period * (1 << (self.regs.get(0x18, 0) >> 2 & 3))

    def get(self, offset, now):
        captures = self._captures(now)
        if offset == 0x10:
            return 2 * (captures > self.taken)
        if offset == 0x34:
            self.taken = captures
            return round(captures * self._spacing()) % 0x10000
        return self.regs.get(offset, 0)

    def write(self, offset, value, now):
        self.regs[offset] = value
        if offset == 0x00:
            self.started, self.taken = now, 0


class SysTick:
    """Counts down at the core's clock and interrupts at zero."""

    def __init__(self):
        self.regs, self.zero_at = {}, None

    def run(self, now):
        """Whether it passed zero with its interrupt enabled."""
        if self.zero_at is None or now < self.zero_at:
            return False
        period = self.regs.get(0x14, 0) + 1
        self.zero_at += ((now - self.zero_at) // period + 1) * period
        return bool(self.regs[0x10] & 2)

    def write(self, offset, value, now):
        self.regs[offset] = value
        running = self.regs.get(0x10, 0) & 1
        if offset in (0x10, 0x18):
            self.zero_at = now + self.regs.get(0x14, 0) + 1 if running else None


class Uart:
    """LPUART1 as the driver uses it: eight bytes of FIFO each way, ten bits a byte.

    `incoming` are (cycle, byte) that the host sends, `host` the cycles that a byte of its takes; `sent(byte)` hears of
    every byte that has left.
    """

    FIFO = 8
    ORE, IDLE, RXNE, TC, TXE, READY = 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7, 3 << 21

    def __init__(self, incoming, host, sent):
        self.incoming, self.host, self.sent = incoming, host, sent
        self.regs, self.flags = {}, self.TC
        self.received, self.to_send = [], []
        self.idle_at = self.left_at = None

    def byte_time(self):
        """Cycles per bit. BRR counts 256ths of a cycle."""
        return 10 * self.regs.get(0x0C, 0) // 256

    def status(self):
        flags = self.flags | self.READY
        flags |= self.RXNE if self.received else 0
        return flags | (self.TXE if len(self.to_send) <= self.FIFO else 0)

    def interrupts(self):
        """Whether an interrupt is pending. An enable bit in CR1 has the same position as its flag."""
        return bool(self.status() & self.regs.get(0x00, 0) & 0xF0)

    def run(self, now):
        while self.incoming and self.incoming[0][0] <= now:
            at, byte = self.incoming.pop(0)
            if self.regs.get(0x00, 0) & 0b101 != 0b101 or abs(self.byte_time() / self.host - 1) > 0.02:
                continue  # Not enabled, or at another speed.
            if len(self.received) < self.FIFO:
                self.received.append(byte)
            else:
                self.flags |= self.ORE
            self.idle_at = at + self.byte_time()
        if self.idle_at and self.idle_at <= now:
            self.flags |= self.IDLE
            self.idle_at = None
        while self.left_at and self.left_at <= now:
            self.sent(self.to_send.pop(0))
            self.left_at = self.left_at + self.byte_time() if self.to_send else None
            self.flags |= 0 if self.to_send else self.TC

    def next(self):
        """Time of the next event that no register access causes."""
        times = [self.incoming[0][0]] if self.incoming else []
        return min(times + [at for at in (self.idle_at, self.left_at) if at], default=None)

    def get(self, offset):
        if offset == 0x1C:
            return self.status()
        if offset == 0x24:
            return self.received.pop(0) if self.received else 0
        return self.regs.get(offset, 0)

    def write(self, offset, value, now):
        if offset == 0x20:
            self.flags &= ~value
        elif offset == 0x28:
            self.flags &= ~self.TC
            self.to_send.append(value & 0xFF)
            self.left_at = self.left_at or now + self.byte_time()
        else:
            self.regs[offset] = value


class Flash:
    """The flash controller with two banks, as delivered: keys, programming of double words, erasing of pages, errors. `read(offset,
    size)` and `write(offset, bytes)` reach its memory, whose content changes at the end of an operation."""

    PAGE, BANK, SIZE = 0x800, 0x4_0000, 0x8_0000
    KEYS = [0x4567_0123, 0xCDEF_89AB]
    PG, PER, BKER, STRT, LOCK = 1, 1 << 1, 1 << 11, 1 << 16, 1 << 31
    PROGERR, WRPERR, PGAERR, SIZERR, PGSERR, BSY = 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7, 1 << 16
    PROGRAM_US, ERASE_US = 91, 24_500  # The longest of the data sheet.

    def __init__(self, cycles_per_us, read, write):
        self.cycles_per_us, self.read, self.write = cycles_per_us, read, write
        self.protected = None  # Offset of a page that is write-protected.
        self.begun = lambda number, begin, end: None  # Hears of every operation since the reset.
        self.reset()

    def reset(self):
        self.control, self.errors, self.keys = self.LOCK, 0, []
        self.first = self.running = None
        self.operations = 0

    def run(self, now):
        """Ends the operation whose time is over by `now`."""
        if self.running and now >= self.running[1]:
            _, _, offset, content = self.running
            self.running = None
            self.control &= ~self.STRT
            self.write(offset, content)

    def get(self, register):
        return {0x10: self.errors | (self.BSY if self.running else 0), 0x14: self.control}.get(register, 0)

    def set(self, register, value, now):
        """A write to KEYR, SR or CR."""
        if register == 0x08:
            self.keys.append(value)
            if self.keys == self.KEYS:
                self.control &= ~self.LOCK
            elif self.keys != self.KEYS[:len(self.keys)]:
                raise SystemExit(f"wrong keys of the flash, {self.keys}: it stays locked until the next reset")
        elif register == 0x10:
            self.errors &= ~value
        elif not self.control & self.LOCK:
            self.control = value & ~self.STRT
            self.keys = [] if value & self.LOCK else self.keys
            if value & self.STRT and value & self.PER:
                page = value >> 3 & 0x7F
                offset = page * self.PAGE + (self.BANK if value & self.BKER else 0)
                self._begin(now, self.ERASE_US, offset, b"\xff" * self.PAGE)

    def store(self, offset, size, value, now):
        """A write of the core to the memory: two words, the lower one first, are a double word."""
        if self.control & (self.LOCK | self.PG) != self.PG or self.errors or self.running:
            self.errors |= self.PGSERR
        elif size != 4:
            self.errors |= self.SIZERR
        elif self.first is None and offset % 8 == 0:
            self.first = offset, value
        elif self.first is None or offset != self.first[0] + 4:
            self.errors |= self.PGAERR
        else:
            (offset, low), self.first = self.first, None
            content = low.to_bytes(4, "little") + value.to_bytes(4, "little")
            if self.read(offset, 8) != b"\xff" * 8 and any(content):
                self.errors |= self.PROGERR
            else:
                self._begin(now, self.PROGRAM_US, offset, content)

    def _begin(self, now, us, offset, content):
        if self.protected == offset - offset % self.PAGE:
            self.errors |= self.WRPERR
            return
        self.control |= self.STRT if self.control & self.PER else 0
        self.running = now, now + us * self.cycles_per_us, offset, content
        self.begun(self.operations, *self.running[:2])
        self.operations += 1
