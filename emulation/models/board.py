"""Model of the STM32G474: executes the image's instructions on models of the registers that it uses.

Registers and bits are those that the hardware library uses, as far as the image does; exceptions are ARMv7-M's. Every
instruction takes one cycle of 170 MHz, a sleeping core skips to the next interrupt; a started clock, a calibration and
a conversion are ready immediately. The MPU has one region, without access. No flash wait states, no analogue; the core
itself stays in thread mode. An operation of the flash that a reset interrupts leaves words with two wrong bits.
"""

import random
import struct

from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn import UC_HOOK_BLOCK, UC_HOOK_CODE, UC_HOOK_INTR, UC_HOOK_MEM_READ, UC_HOOK_MEM_WRITE, UC_HOOK_MEM_WRITE_PROT
from unicorn import UC_PROT_EXEC, UC_PROT_READ
from unicorn.arm_const import *

from peripherals import Capture, Flash, SysTick, Timer, Uart

HZ = 170_000_000
FLASH, RAM, RAM_SIZE = 0x0800_0000, 0x2000_0000, 128 * 1024
POWER_ON, BUTTON = 1 << 27 | 1 << 26, 1 << 26  # Flags of RCC_CSR.
IDLE = 0x100  # Priority of a core without an active exception: below every other.
HARD_FAULT = 3
FRAME = (UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3, UC_ARM_REG_R12, UC_ARM_REG_LR)
FLOATS = tuple(UC_ARM_REG_S0 + i for i in range(16))

FLASH_REGS = 0x4002_2000
FLASH_KEYR, FLASH_SR, FLASH_CR, FLASH_ECCR, FLASH_OPTR = (FLASH_REGS + offset for offset in (0x08, 0x10, 0x14, 0x18, 0x20))
RNG, VREFINT_CAL = 0x5006_0800, 0x1FFF_75AA
RCC, IWDG, LPUART1, DAC1, ADC1 = 0x4002_1000, 0x4000_3000, 0x4000_8000, 0x5000_0800, 0x5000_0000
GPIO = 0x4800_0000
TIM15, TIM15_IRQ = 0x4001_4000, 24  # Used by the time driver.
TIM16 = 0x4001_4400
LPUART1_IRQ, FMAC_IRQ = 91, 101
SCS = 0xE000_E000
SYSTICK_IRQ = -1  # Exception 15.
NMI_IRQ = -14  # Exception 2.
BAUD = 115_200  # Baud rate of the host.
VREFINT = 1.212  # Volts of the internal reference.
LSI = 32_000  # Hz.
BROWN_OUT = 4  # Level of the brown-out reset, FLASH_OPTR.BOR_LEV.
MONITOR_SCALE = 1000  # Volts of the amplifier at the ADC's full range.
MPU = 0xE000_ED90
ENABLE, INTERLOCK = (1, 5), (1, 10)  # Port and pin.


class Board:
    """One chip with the image in its flash. `log` receives (time in us, name, value) of every event outside."""

    def __init__(self, image, rtt, host, full_scale, random_number):
        """`host` lists (time of the first bit in us, frame). `full_scale` is the voltage at the highest code.
        `random_number` is what the random number generator delivers; it never delivers 0."""
        self.image, self.rtt, self.log = image, rtt, []
        byte = self.byte_of_host = 10 * HZ // BAUD
        self.incoming = [
            (us * HZ // 1_000_000 + byte * (i + 1), value) for us, frame in host for i, value in enumerate(frame)
        ]
        self.traps, self.trapped, self.sprung = {}, False, False
        self.closed, self.monitors, self.full_scale = True, {}, full_scale
        self.random_number, self.supply = random_number, 3.3
        self.lsi, self.brown_out = LSI, BROWN_OUT
        self.now, self.end, self.deadline = 0, 0, 0
        self.guard, self.entries = None, 0
        uc = self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M4)
        uc.mem_map(FLASH, Flash.SIZE, UC_PROT_READ | UC_PROT_EXEC)
        uc.mem_write(FLASH, image.ljust(Flash.SIZE, b"\xff"))
        self.flash = Flash(HZ // 1_000_000, lambda offset, size: bytes(uc.mem_read(FLASH + offset, size)), self._stored)
        self.torn, self.stale = {}, False
        uc.mem_map(RAM, RAM_SIZE)
        uc.mem_write(RAM, random.Random(1).randbytes(RAM_SIZE))
        uc.mem_map(0x1FFF_7000, 0x1000)
        uc.mem_write(VREFINT_CAL, struct.pack("<H", round(VREFINT / 3.0 * 4096)))
        for base, size in ((0x4000_0000, 0x0400_0000), (0x4800_0000, 0x0100_0000), (0x5000_0000, 0x0100_0000),
                           (0xE000_0000, 0x0010_0000)):
            uc.mmio_map(base, size, self._read, base, self._write, base)
        uc.hook_add(UC_HOOK_BLOCK, self._block)
        uc.hook_add(UC_HOOK_INTR, self._interrupt)
        uc.hook_add(UC_HOOK_MEM_WRITE, self._logged, begin=rtt + 36, end=rtt + 39)
        uc.hook_add(UC_HOOK_MEM_WRITE_PROT, self._store, begin=FLASH, end=FLASH + Flash.SIZE - 1)
        self.counts = {}
        for at in range(0, len(image) - 1, 2):
            if image[at:at + 2] == b"\x30\xbf":
                uc.hook_add(UC_HOOK_CODE, self._wfi, begin=FLASH + at, end=FLASH + at)
            elif image[at:at + 4] == b"\xbf\xf3\x4f\x8f":
                uc.hook_add(UC_HOOK_CODE, self._dsb, begin=FLASH + at, end=FLASH + at)

    # --- Reset and run ---

    def reset(self, cause):
        """Resets the chip. `cause` is the flag in RCC_CSR. The memory keeps its content."""
        # Two banks of flash, as the chip is delivered: FLASH_OPTR.DBANK.
        options = 1 << 22 | self.brown_out << 8
        self.regs = {RCC + 0x94: cause, GPIO: 0xABFF_FFFF, GPIO + 0x400: 0xFFFF_FEBF, FLASH_OPTR: options}
        is_clocked = lambda: self.regs.get(RCC + 0x94, 0) & 1 and self.regs.get(RCC + 0x60, 0) >> 17 & 1
        self.capture = Capture(self.lsi and HZ / self.lsi, is_clocked)
        self.timer = Timer()
        self.timer.at = self.now
        self.systick = SysTick()
        self.uart = Uart(self.incoming, self.byte_of_host, lambda byte: self.note("sent", byte))
        self.enabled, self.pending, self.priority, self.active = {NMI_IRQ, SYSTICK_IRQ}, set(), {NMI_IRQ: -2}, []
        self.candidate = None
        self.watchdog = None
        self.outside, self.output, self.read_to = None, None, 0
        self.wants_reset = self.sleeping = self.trapped = self.sprung = False
        self.cut = self.later = None
        self.fault = None
        self._interrupt_flash()
        self.note("reset", cause)
        self._look_outside()
        stack, entry = struct.unpack_from("<2I", self.image)
        uc = self.uc
        for reg in (UC_ARM_REG_PRIMASK, UC_ARM_REG_CONTROL):
            uc.reg_write(reg, 0)
        uc.reg_write(UC_ARM_REG_SP, stack)
        uc.reg_write(UC_ARM_REG_LR, 0xFFFF_FFFF)
        self.pc = entry & ~1
        self._settle()

    def run(self, until_us):
        """Runs until the given time or a reset. Returns the cause of the reset, flags of RCC_CSR."""
        self.end = until_us * HZ // 1_000_000
        while self.now < self.end:
            self.stopped = self.fault = None
            try:
                self.uc.emu_start(self.pc | 1, 0xFFFF_FFFE)
                self.pc = self.uc.reg_read(UC_ARM_REG_PC) & ~1
            except UcError as error:
                self.pc = self.uc.reg_read(UC_ARM_REG_PC) & ~1
                self.fault = str(error)
            if self.stopped is not None:
                self.pc = self.stopped
                if self.stale:
                    # Unicorn takes the code after an IT block with a hooked load for a part of that block, and would do so again.
                    self.stale = False
                    self.uc.ctl_remove_cache(self.pc, self.pc + 2)
                    self.uc.reg_write(UC_ARM_REG_XPSR, self.uc.reg_read(UC_ARM_REG_XPSR) & ~0x0600_FC00)
            elif self.pc >= 0xFFFF_FF00:
                self._exception_return()
            elif self.fault is not None:
                self._hard_fault(self.fault)
            self._advance()
            trapped, self.trapped = self.trapped, False
            if trapped:
                self.sprung = True
                self.traps[self.pc](self)
            while self.sleeping and not self._ready() and self.now < min(self.end, self.watchdog or self.end):
                self.now = self.deadline
                self._advance()
            self.sleeping = False
            if self.wants_reset:
                return 1 << 28 | 1 << 26
            if self.watchdog is not None and self.now >= self.watchdog:
                return 1 << 29 | 1 << 26
            if self.cut and self.now >= self.cut[0]:
                return self.cut[1]
            if trapped:
                continue
            if self._ready():
                self._exception_entry(16 + self.candidate[1], self.candidate[0])
        return None

    def cut_at(self, at, cause):
        """A reset from outside."""
        self.cut = at, cause
        self.end, self.deadline = min(self.end, at), min(self.deadline, at)

    def call_at(self, at, what):
        """Calls `what` with the board, unless a reset comes before."""
        self.later = at, what
        self._settle()

    def tear(self, at):
        """From now on a double word of the flash has two wrong bits, until it is erased."""

        def read(*_):
            self.two_wrong_bits()
            self.stale = True

        if at not in self.torn:
            self.torn[at] = self.uc.hook_add(UC_HOOK_MEM_READ, read, begin=at, end=at + 7)

    def _interrupt_flash(self):
        """A reset interrupts the operation of the flash: a double word is half written and torn; of a page some words are erased and the
        others torn."""
        if self.flash.running:
            begin, end, offset, content = self.flash.running
            if len(content) == 8:
                self._fill(offset, content[:4])
                self.tear(FLASH + offset)
            else:
                chance, done = random.Random(offset), (self.now - begin) / (end - begin)
                for at in range(offset, offset + len(content), 8):
                    self._fill(at, content[:8]) if chance.random() < done else self.tear(FLASH + at)
        self.flash.reset()

    def watch(self, begin, end, what):
        """Notes the first read from `begin` on, before `end`. Unicorn takes an IT block with a hooked load for longer than it is and
        skips what follows, so that the hook goes with that read."""

        def read(*_):
            self.note(what, begin)
            self.uc.hook_del(hook)

        hook = self.uc.hook_add(UC_HOOK_MEM_READ, read, begin=begin, end=end - 1)

    def stick(self, at, bit):
        """From now on a bit of the RAM's word at `at` reads as zero."""

        def read(uc, *_):
            word, = struct.unpack("<I", uc.mem_read(at, 4))
            uc.mem_write(at, struct.pack("<I", word & ~(1 << bit)))

        self.uc.hook_add(UC_HOOK_MEM_READ, read, begin=at, end=at + 3)

    def couple(self, at, victim, bit):
        """From now on a bit of the RAM's word at `at` that changes from 0 to 1 sets the same bit of the word `victim`."""

        def write(uc, access, address, size, value, _):
            before, = struct.unpack("<I", uc.mem_read(at, 4))
            if value & ~before & 1 << bit:
                word, = struct.unpack("<I", uc.mem_read(victim, 4))
                uc.mem_write(victim, struct.pack("<I", word | 1 << bit))

        self.uc.hook_add(UC_HOOK_MEM_WRITE, write, begin=at, end=at + 3)

    def commanded(self):
        """The voltage that the amplifier is commanded to put out, in V."""
        return self.regs.get(DAC1 + 0x08, 0) * self.full_scale / 4095

    def depth(self, end, start):
        """Bytes from the top of the stack, `start`, to its lowest word above `end` that is not zero."""
        words = struct.unpack(f"<{(start - end) // 4}I", self.uc.mem_read(end, start - end))
        return start - end - 4 * next((i for i, word in enumerate(words) if word), len(words))

    def two_wrong_bits(self):
        """Called when such a word is read: sets FLASH_ECCR.ECCD and raises the non-maskable interrupt."""
        self.regs[FLASH_ECCR] = 1 << 31
        self.pending.add(NMI_IRQ)
        self._choose()

    def note(self, what, value):
        self.log.append((self.now * 1_000_000 / HZ, what, value))

    # --- Hooks ---

    def _store(self, uc, access, at, size, value, _):
        """A write of the core to the flash, which by itself changes nothing there."""
        self.flash.run(self.now)
        self.flash.store(at - FLASH, size, value & (1 << 8 * size) - 1, self.now)
        return True

    def _stored(self, offset, content):
        """The end of an operation of the flash."""
        self._fill(offset, content)
        self.note("programmed" if len(content) == 8 else "erased", FLASH + offset)

    def _fill(self, offset, content):
        for at in range(FLASH + offset, FLASH + offset + len(content), 8):
            if at in self.torn:
                self.uc.hook_del(self.torn.pop(at))
        self.uc.mem_write(FLASH + offset, content)

    def _instructions(self, at, size):
        code = self.uc.mem_read(at, size)
        count = i = 0
        while i < size:
            i += 4 if code[i + 1] >> 3 in (0b11101, 0b11110, 0b11111) else 2
            count += 1
        return count

    def _block(self, uc, at, size, _):
        if at in self.traps and not self.sprung:
            self.trapped = True
            return self._stop(at)
        self.sprung = False
        if self.stale:
            return self._stop(at)
        if self.now >= self.deadline:
            self._advance()
        # A call is dear here: the self-test of each start passes ten million blocks.
        if self.wants_reset or self.now >= self.end or self.candidate is not None and self._ready():
            return self._stop(at)
        key = at << 16 | size
        count = self.counts.get(key)
        if count is None:
            # A branch to itself counts as minus its one instruction: only an interrupt or a reset ends it.
            waits = size == 2 and uc.mem_read(at, 2) == b"\xfe\xe7"
            count = self.counts[key] = -1 if waits else self._instructions(at, size)
        if count < 0:
            self.now += 1
            self.sleeping = True
            return self._stop(at)
        self.now += count

    def _wfi(self, uc, at, size, _):
        self.sleeping = True
        self._stop(at + size)

    def _dsb(self, uc, at, *_):
        """A barrier ends every read before it, so that what a torn word raises is taken first."""
        if self.stale:
            self._stop(at)

    def _interrupt(self, uc, number, _):
        self.fault = f"exception {number} of the core"
        uc.emu_stop()

    def _stop(self, at):
        self.stopped = at
        self.uc.emu_stop()

    # --- Exceptions ---

    def _ready(self):
        """Whether an interrupt can be taken now. Within an IT block it is taken after the block."""
        if self.candidate is None:
            return False
        masked = self.uc.reg_read(UC_ARM_REG_PRIMASK) & 1 and self.candidate[0] >= 0
        return not masked and not self.uc.reg_read(UC_ARM_REG_XPSR) & 0x0600_FC00

    def _choose(self):
        """The pending interrupt of highest priority that may preempt the active exception."""
        ready = [(self.priority.get(irq, 0), irq) for irq in self.pending & self.enabled]
        best = min(ready, default=None)
        running = min((priority for _, priority in self.active), default=IDLE)
        self.candidate = best if best and best[0] < running else None

    def _exception_entry(self, number, priority):
        uc = self.uc
        sp, xpsr = uc.reg_read(UC_ARM_REG_SP), uc.reg_read(UC_ARM_REG_XPSR) & 0xFF00_FC00
        floats = uc.reg_read(UC_ARM_REG_CONTROL) & 4  # Saved immediately, not lazily.
        free = sp - (104 if floats else 32)
        sp = free & ~7
        xpsr |= 1 << 24 | (0 if free == sp else 1 << 9) | (self.active[-1][0] if self.active else 0)
        words = [uc.reg_read(reg) for reg in FRAME] + [self.pc, xpsr]
        if floats:
            words += [uc.reg_read(reg) for reg in FLOATS] + [uc.reg_read(UC_ARM_REG_FPSCR), 0]
            uc.reg_write(UC_ARM_REG_CONTROL, uc.reg_read(UC_ARM_REG_CONTROL) & ~4)
        uc.mem_write(sp, struct.pack(f"<{len(words)}I", *words))
        uc.reg_write(UC_ARM_REG_SP, sp)
        uc.reg_write(UC_ARM_REG_LR, (0xFFFF_FFF1 if self.active else 0xFFFF_FFF9) & ~(0x10 if floats else 0))
        table = self.regs.get(0xE000_ED08, 0) or FLASH
        self.pc = struct.unpack("<I", uc.mem_read(table + 4 * number, 4))[0] & ~1
        self.active.append((number, priority))
        self.entries += 1
        self.pending.discard(number - 16)
        self._choose()

    def _exception_return(self):
        uc = self.uc
        floats = not self.pc & 0x10
        sp = uc.reg_read(UC_ARM_REG_SP)
        *words, self.pc, xpsr = struct.unpack("<8I", uc.mem_read(sp, 32))
        for reg, word in zip(FRAME, words):
            uc.reg_write(reg, word)
        if floats:
            saved = struct.unpack("<17I", uc.mem_read(sp + 32, 68))
            for reg, word in zip(FLOATS + (UC_ARM_REG_FPSCR,), saved):
                uc.reg_write(reg, word)
        control = uc.reg_read(UC_ARM_REG_CONTROL) & ~4
        uc.reg_write(UC_ARM_REG_CONTROL, control | 4 if floats else control)
        uc.reg_write(UC_ARM_REG_SP, sp + (104 if floats else 32) + (4 if xpsr & 1 << 9 else 0))
        uc.reg_write(UC_ARM_REG_APSR_NZCVQ, xpsr & 0xF800_0000)
        self.pc &= ~1
        self.active.pop()
        self._settle()

    def _protect(self):
        """Applies the region of the MPU, if it has no access rights, while the MPU is enabled."""
        base, rasr = (self.regs.get(MPU + offset, 0) for offset in (0x0C, 0x10))
        if self.guard is None and self.regs.get(MPU + 4, 0) & 1 and rasr & 1 and rasr >> 24 & 7 == 0:
            base, size = base & ~0x1F, 2 << (rasr >> 1 & 0x1F)
            self.guard = self.uc.hook_add(UC_HOOK_MEM_READ | UC_HOOK_MEM_WRITE, self._guarded, begin=base, end=base + size - 1)

    def _guarded(self, uc, access, at, *_):
        # Without HFNMIENA the hard fault and the NMI run without it.
        if self.regs.get(MPU + 4, 0) & 1 and all(priority >= 0 for _, priority in self.active):
            self.fault = f"access to {at:#x}, which the MPU guards"
            uc.emu_stop()

    def _hard_fault(self, why):
        self.note("fault", why)
        if any(number == HARD_FAULT for number, _ in self.active):
            raise SystemExit(f"a fault in the hard fault's handler at {self.pc:#x}: {why}")
        self._exception_entry(HARD_FAULT, -1)

    # --- Time ---

    def _advance(self):
        """Advances timers and interrupts to `now`."""
        self.timer.run(self.now)
        self.uart.run(self.now)
        self.flash.run(self.now)
        if self.systick.run(self.now):
            self.pending.add(SYSTICK_IRQ)
        if self.later and self.now >= self.later[0]:
            (_, what), self.later = self.later, None
            what(self)
            self.sleeping = False
        self._settle()

    def _settle(self):
        timer = self.timer.get(0x10) & self.timer.get(0x0C) & 0x1F
        for irq, level in (TIM15_IRQ, timer), (LPUART1_IRQ, self.uart.interrupts()):
            if level and all(number != 16 + irq for number, _ in self.active):
                self.pending.add(irq)
        self._choose()
        wait = self.timer.next()
        later = self.later and self.later[0]
        times = self.timer.at + wait if wait else None, self.uart.next(), self.systick.zero_at, self.watchdog, later
        self.deadline = min(at for at in (self.end, *times) if at is not None)

    # --- Registers ---

    def _read(self, uc, offset, size, base):
        at = base + offset
        word, shift = at & ~3, 8 * (at & 3)
        value = self._read_word(word) >> shift
        return value & (1 << 8 * size) - 1

    def _read_word(self, at):
        value = self.regs.get(at, 0)
        if at & ~0x3FF == TIM15:
            self._advance()
            return self.timer.get(at - TIM15)
        if at & ~0x3FF == LPUART1:
            self._advance()
            value = self.uart.get(at - LPUART1)
            self._settle()
            return value
        if at & ~0x3FF == TIM16:
            return self.capture.get(at - TIM16, self.now)
        if at in (FLASH_SR, FLASH_CR):
            self.flash.run(self.now)
            if self.flash.running and self.candidate is None:
                # A core that waits for the flash skips to the next interrupt.
                self.now = max(self.now, min(self.flash.running[1], self.deadline))
                self.flash.run(self.now)
            return self.flash.get(at - FLASH_REGS)
        if at == RCC:  # HSI, HSE and PLL are ready as soon as they are enabled.
            return value | (value & 1 << 8) << 2 | (value & (1 << 16 | 1 << 24)) << 1
        if at == RCC + 0x08:
            return value | (value & 3) << 2
        if at in (RCC + 0x90, RCC + 0x94, RCC + 0x98):
            return value | (value & 1) << 1
        if at == RNG + 4:
            return int(self.regs.get(RNG, 0) & 4 and self.random_number != 0)
        if at == RNG + 8:
            return self.random_number
        if at == DAC1 + 0x34:
            return value | 1 << 11
        if at == DAC1 + 0x2C:
            return self.regs.get(DAC1 + 0x08, 0)
        if at == ADC1:
            return 0xF
        if at == ADC1 + 0x40:
            # Channel 1 measures the amplifier's voltage, channel 2 no current, channel 18 the internal reference if
            # ADC12_CCR.VREFEN is set; `monitors` overrides them with a code, or with a function that returns one.
            channel = self.regs.get(ADC1 + 0x30, 0) >> 6 & 0x1F
            voltage = min(round(self.commanded() * 4096 / MONITOR_SCALE), 4095)
            # DAC and ADC share their supply, so that an error of it cancels out; the current's zero is ignored.
            reference = round(VREFINT / self.supply * 4096) if self.regs.get(ADC1 + 0x308, 0) & 1 << 22 else 0
            reading = self.monitors.get(channel, {1: voltage, 18: reference}.get(channel, 2048))
            return reading() if callable(reading) else reading
        if at & ~0x1FFF == GPIO and at & 0x3FF == 0x10:
            port, pin = INTERLOCK
            # A broken wire reads as the pin's pull resistor sets it: low with the pull-down only.
            pull = self.regs.get((at & ~0x3FF) + 0x0C, 0) >> 2 * pin & 3
            high = at - GPIO >> 10 == port and (self.closed or pull != 2)
            return self.regs.get(at + 4, 0) | high << pin
        if at in (SCS + 0x10, SCS + 0x14):
            return self.systick.regs.get(at - SCS, 0)
        if 0xE000_E100 <= at < 0xE000_E300:
            of = self.enabled if at < 0xE000_E200 else self.pending
            first = (at & 0x7F) * 8
            return sum(1 << i for i in range(32) if first + i in of)
        if 0xE000_E400 <= at < 0xE000_E500:
            return sum(self.priority.get(at - 0xE000_E400 + i, 0) << 8 * i for i in range(4))
        return value

    def _write(self, uc, offset, size, value, base):
        at = base + offset
        word, shift = at & ~3, 8 * (at & 3)
        if 0xE000_E400 <= at < 0xE000_E500:
            for i in range(size):
                self.priority[at - 0xE000_E400 + i] = value >> 8 * i & 0xF0
            return
        if size < 4 and not (word == GPIO or word & 0x3FF in (0x18, 0x28)):
            mask = (1 << 8 * size) - 1 << shift
            value = self._read_word(word) & ~mask | value << shift
        self._write_word(word, value)

    def _write_word(self, at, value):
        if at & ~0x3FF == TIM15:
            self.timer.run(self.now)
            self.timer.write(at - TIM15, value)
            return self._settle()
        if at & ~0x3FF == LPUART1:
            self.uart.run(self.now)
            self.uart.write(at - LPUART1, value, self.now)
            return self._settle()
        if at & ~0x3FF == TIM16:
            return self.capture.write(at - TIM16, value, self.now)
        if at in (FLASH_KEYR, FLASH_SR, FLASH_CR):
            self.flash.run(self.now)
            return self.flash.set(at - FLASH_REGS, value, self.now)
        if at in (SCS + 0x10, SCS + 0x14, SCS + 0x18):
            self.systick.write(at - SCS, value, self.now)
            return self._settle()
        if 0xE000_E100 <= at < 0xE000_E300:
            of = self.enabled if at < 0xE000_E200 else self.pending
            bits = {(at & 0x7F) * 8 + i for i in range(32) if value >> i & 1}
            of.difference_update(bits) if at & 0x80 else of.update(bits)
            return self._settle()
        if at == 0xE000_EF00:
            self.pending.add(value & 0x1FF)
            return self._settle()
        if at == 0xE000_ED0C:
            self.wants_reset = value >> 16 == 0x05FA and bool(value & 4)
            return
        clock = 16 if at & ~0x3FF == DAC1 & ~0x3FF else at - GPIO >> 10 if GPIO <= at < GPIO + 0x1C00 else None
        if clock is not None and not self.regs.get(RCC + 0x4C, 0) >> clock & 1:
            return  # The write is lost: the peripheral's clock is not enabled yet.
        if at == RCC + 0x94 and value & 1 << 23:
            value &= 0xFF
        elif at == FLASH_ECCR:
            value = self.regs.get(at, 0) & ~(value & 0xC000_0000)  # Written ones clear.
        elif at == ADC1 + 0x08:
            value &= ~(1 << 31 | 0x1E)  # Calibration and conversion end immediately.
        elif at == IWDG:
            return self._watchdog(value)
        elif GPIO <= at < GPIO + 0x2000 and at & 0x3FF in (0x18, 0x28):
            odr = (at & ~0x3FF) + 0x14
            on, off = (value & 0xFFFF, value >> 16) if at & 0x3FF == 0x18 else (0, value & 0xFFFF)
            at, value = odr, self.regs.get(odr, 0) & ~off | on
        self.regs[at] = value
        if at == MPU + 4:
            self._protect()
        if at == DAC1 + 0x08:
            self.note("dac", value & 0xFFF)
        self._look_outside()

    def _watchdog(self, key):
        """Time-out of the watchdog: RLR + 1 counts of LSI (32 kHz) divided by 4 << PR."""
        if key == 0xCCCC or key == 0xAAAA and self.watchdog is not None:
            counts = (self.regs.get(IWDG + 8, 0xFFF) + 1) * (4 << self.regs.get(IWDG + 4, 0))
            self.watchdog = self.now + counts * HZ // 32_000
            self.note("watchdog started" if key == 0xCCCC else "fed", counts * 1_000_000 // 32_000)
            self._settle()

    def _look_outside(self):
        """Logs changes of the enable pin, high only if it is an output whose bit is set, and of the DAC's mode."""
        port = GPIO + 0x400 * ENABLE[0]
        driven = self.regs.get(port, 0) >> 2 * ENABLE[1] & 3 == 1
        high = driven and bool(self.regs.get(port + 0x14, 0) >> ENABLE[1] & 1)
        if self.outside != (driven, high):
            self.outside = (driven, high)
            self.note("enable", "floats" if not driven else "on" if high else "off")
        on, mode = self.regs.get(DAC1, 0) & 1, self.regs.get(DAC1 + 0x3C, 0) & 7
        output = "off" if not on else {0: "buffered", 2: "unbuffered"}.get(mode, mode)
        if self.output != output:
            self.output = output
            self.note("output", output)

    # --- Log ---

    def _logged(self, uc, access, at, size, write, _):
        """Called before the ring's write index moves: reads the new bytes as a debugger would. The RAM's test overwrites the
        mark by which a debugger finds the ring."""
        if uc.mem_read(self.rtt, 10) != b"SEGGER RTT":
            return
        _, buffer, length = struct.unpack("<3I", uc.mem_read(self.rtt + 24, 12))
        start, self.read_to = self.read_to, write
        if start != write:
            ring = bytes(uc.mem_read(buffer, length))
            new = ring[start:write] if start < write else ring[start:] + ring[:write]
            self.note("log", new.hex())
