"""Boots an image, injects faults: boot.py IMAGE CASE prints the events as JSON.

CASE is a file with a JSON object. `tick` and `panic` are the addresses of the control tick and of `core::panicking::panic`, `rtt` is
the log's, `main` that of the program's first function after start-up, `taken` that of `cortex_m::peripheral::TAKEN`, `stack` the top of
the stack. `volts` is the full scale of its amplifier. `hosts` is what a host sends in the runs, [time in us, bytes in hex] each, later by
`later_us`: the start takes that time longer than in other images. `random` is what the random number generator delivers. `settings` and
`model` are stored pages, in hex. `cuts` numbers for both, for each start, the operation of the flash that is cut. `runs` names the runs
that are wanted.
"""

import json
import math
import struct
import sys

from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_PRIMASK, UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_SP

from board import BUTTON, FLASH, FMAC_IRQ, HZ, LSI, MONITOR_SCALE, POWER_ON, RAM, Board

FAULT_TICK = 300
GUARD = 256  # Bytes at the end of the stack.
STORE = [FLASH + 0x7E000 + page * 0x800 for page in range(4)]  # First word of each page, the settings first.
UNDEFINED, HANG = b"\x00\xde", b"\xfe\xe7"


def panic(board):
    """Calls `panic("injected")` at `injected.rs:7`, its arguments in memory that the program does not use."""
    text, place = RAM + 0x1_0000, RAM + 0x1_0020
    board.uc.mem_write(text, b"injected.rs\0injected")
    board.uc.mem_write(place, struct.pack("<4I", text, 11, 7, 1))
    for reg, value in ((UC_ARM_REG_R0, text + 12), (UC_ARM_REG_R1, 8), (UC_ARM_REG_R2, place)):
        board.uc.reg_write(reg, value)
    board.pc = PANIC


def broken(code):
    """Replaces the tick's first instruction, which is no trap any more."""

    def inject(board):
        board.traps.clear()
        board.uc.mem_write(TICK, code)
        board.uc.ctl_remove_cache(TICK, TICK + 4)

    return inject


def rotten(board):
    """A word of code or constants has two wrong bits."""
    board.two_wrong_bits()


def overflowing(board):
    """The stack is used up but for a few words above the guard."""
    board.uc.reg_write(UC_ARM_REG_SP, RAM + GUARD + 16)


def dip(board):
    """The supply dips, for too short a time to clear the memory."""
    board.cut_at(board.now, POWER_ON)


def pressed_armed(board):
    """The reset button is pressed while armed."""
    board.cut_at(board.now, BUTTON)


def pressed(board):
    """The reset button is pressed after a fault."""
    opened(board)
    board.cut_at(board.now + 20 * HZ // 1000, BUTTON)


def opened(board):
    """The interlock's wire breaks."""
    board.closed = False


def shorted(board):
    """The voltage monitor measures 0 V."""
    board.monitors[1] = 0


def mistaken(board):
    """The amplifier reaches 1000 V."""
    board.full_scale = 1000


def oversupplied(board):
    """DAC and ADC are supplied with 3.6 V."""
    board.supply = 3.6


def low(board):
    """The amplifier stops at 60 V."""
    board.monitors[1] = round(60 * 4096 / MONITOR_SCALE)


def bridged(board):
    """The output is short-circuited: no voltage, and 3 mA."""
    shorted(board)
    arcing(board)


def slow_amplifier(board):
    """The amplifier begins again from 0 V and approaches its command with a time constant of 0.1 s."""
    at, volts = board.now, 0.0

    def reading():
        nonlocal at, volts
        volts += (board.commanded() - volts) * -math.expm1(-(board.now - at) / HZ / 0.1)
        at = board.now
        return round(volts * 4096 / MONITOR_SCALE)

    board.monitors[1] = reading


def arcing(board):
    """The current monitor measures 3 mA; half its range is 5 mA."""
    board.monitors[2] = 2048 + 3 * 2048 // 5


def stalled(board):
    """A debugger that switched the log to blocking mode and stopped reading: the ring stays full."""
    write, = struct.unpack("<I", board.uc.mem_read(RTT + 36, 4))
    length, = struct.unpack("<I", board.uc.mem_read(RTT + 32, 4))
    board.uc.mem_write(RTT + 40, struct.pack("<2I", (write + 1) % length, 2))


def deaf(board):
    """Hangs with interrupts disabled."""
    board.uc.reg_write(UC_ARM_REG_PRIMASK, 1)
    broken(HANG)(board)


def late(us):
    """The tick begins in time and takes `us` microseconds longer; what may interrupt it does."""

    def inject(board):
        tick = bytes(board.uc.mem_read(TICK, 2))
        broken(HANG)(board)
        board.call_at(board.now + us * HZ // 1_000_000, broken(tick))

    return inject


def idle(board):
    """The tasks below the control task do not run any more."""
    board.enabled.discard(FMAC_IRQ)


def timeless(board):
    """The timer of all tasks stops."""
    board.timer.write(0x00, 0)


def halted(board):
    """The processor executes nothing until something resets it."""
    board.now = board.watchdog or board.end


def taken(board):
    """Another owner has the core's peripherals, so that the guards of stack and control task cannot be set up."""
    board.traps.clear()
    board.uc.mem_write(TAKEN, b"\x01")


def stuck(board):
    """A bit in a word of the stack that nobody has used yet is stuck."""
    board.stick(RAM + 0x400, 17)


def coupled(board):
    """A bit in such a word is set by a word elsewhere."""
    board.couple(RAM + 0x800, RAM + 0x400, 3)


def slow(board):
    """The processor runs at half its speed, so that it sees a faster LSI."""
    board.lsi = 2 * LSI


def silent(board):
    """The LSI does not start."""
    board.lsi = 0


def delivered(board):
    """The brown-out level is that of a new chip."""
    board.brown_out = 0


def charged(board):
    """The voltage monitor reads 100 V from the start."""
    board.monitors[1] = 410


def flipped(board):
    """The last byte of the image has a wrong bit."""
    board.traps.clear()
    board.uc.mem_write(FLASH + len(IMAGE) - 1, bytes([IMAGE[-1] ^ 0x10]))


def stored(board):
    """Settings are stored."""
    board.uc.mem_write(STORE[0], SETTINGS)


def faded(board):
    """A bit of the stored settings is wrong."""
    stored(board)
    board.uc.mem_write(STORE[0] + 40, bytes([SETTINGS[40] ^ 4]))


def cut(store, page, operations):
    """A block is stored, and after each start the chip is reset in the middle of one operation of the flash, as long as there are any."""

    def before(board):
        board.uc.mem_write(store, page)
        cuts = list(operations)

        def begun(number, begin, end):
            if cuts and number == cuts[0]:
                board.note("cut", cuts.pop(0))
                board.cut_at((begin + end) // 2, BUTTON)

        board.flash.begun = begun

    return before


def protected(board):
    """A model is stored, and the page for the next one is write-protected."""
    board.uc.mem_write(STORE[2], MODEL)
    board.flash.protected = STORE[3] - FLASH


def play(host, fault, until_us, torn=(), before=None, first=None, random_number=None):
    """Injects `before` before power-on, `first` where the program begins, `fault` in tick FAULT_TICK. After the reset the flash is correct
    again; the memory keeps its content. Notes the instructions of every tick that no interrupt interrupts, and the stack's depth."""
    board = Board(IMAGE, RTT, host, FULL_SCALE, RANDOM if random_number is None else random_number)
    for word in torn:
        board.tear(word)
    if before:
        before(board)
    board.watch(STORE[0], FLASH + 0x80000, "store read")
    ticks = 0

    def tick(board):
        nonlocal ticks
        ticks += 1
        if fault and ticks == FAULT_TICK:
            board.note("injected", ticks)
            return fault(board)
        begin, entries, back = board.now, board.entries, board.uc.reg_read(UC_ARM_REG_LR) & ~1

        def ticked(board):
            del board.traps[back]
            if board.entries == entries:
                board.note("ticked", board.now - begin)

        board.traps[back] = ticked

    board.traps[TICK] = tick
    if first:
        board.traps[MAIN] = first
    board.reset(POWER_ON)
    # Most runs have a second start.
    while (cause := board.run(until_us + 2 * CASE["later_us"])) is not None:
        board.uc.mem_write(FLASH, IMAGE)
        board.uc.ctl_remove_cache(FLASH, FLASH + len(IMAGE))
        board.reset(cause)
    board.note("stack", board.depth(RAM + GUARD, STACK))
    return board.log


def answered(host):
    """Time in us when what a host has sent is answered."""
    return host[-1][0] + 100_000


if __name__ == "__main__":
    with open(sys.argv[1], "rb") as file:
        IMAGE = file.read()
    with open(sys.argv[2], encoding="utf-8") as file:
        CASE = json.load(file)
    TICK, PANIC, RTT, MAIN, TAKEN, STACK = (CASE[name] for name in ("tick", "panic", "rtt", "main", "taken", "stack"))
    FULL_SCALE, RANDOM, CUTS = CASE["volts"], CASE["random"], CASE["cuts"]
    SETTINGS, MODEL = bytes.fromhex(CASE["settings"]), bytes.fromhex(CASE["model"])
    HOSTS = {name: [(us + CASE["later_us"], bytes.fromhex(frames)) for us, frames in sent] for name, sent in CASE["hosts"].items()}
    HOST, SETTINGS_HOST, MODEL_HOST = HOSTS["host"], HOSTS["cut settings"], HOSTS["cut model"]
    RUNS = {
        "quiet": lambda: play([], None, 1_200_000),
        "host": lambda: play(HOST, stalled, 1_700_000),
        "panic": lambda: play(HOST, panic, 400_000),
        "hard fault": lambda: play(HOST, broken(UNDEFINED), 400_000),
        "two wrong bits": lambda: play(HOST, rotten, 400_000),
        "stack overflow": lambda: play(HOST, overflowing, 400_000),
        "torn": lambda: play([], None, 200_000, STORE),
        "stored settings": lambda: play(HOST, None, 200_000, before=stored),
        "damaged settings": lambda: play(HOST, None, 400_000, before=faded),
        "dip": lambda: play(HOST, dip, 400_000),
        "button": lambda: play(HOST, pressed, 400_000),
        "button while armed": lambda: play(HOST, pressed_armed, 400_000),
        "interlock": lambda: play(HOST, opened, 480_000),
        "no voltage": lambda: play(HOST, shorted, 480_000),
        "other amplifier": lambda: play(HOST, mistaken, 480_000),
        "supply of 3.6 V": lambda: play(HOST, oversupplied, 480_000),
        "too low": lambda: play(HOST, low, 480_000),
        "short circuit": lambda: play(HOST, bridged, 480_000),
        "slow amplifier": lambda: play(HOST, slow_amplifier, 480_000),
        "current": lambda: play(HOST, arcing, 480_000),
        "replayed": lambda: play(HOSTS["recorded"], None, 1_000_000),
        "no random number": lambda: play(HOST, None, 200_000, random_number=0),
        "hang": lambda: play(HOST, broken(HANG), 500_000),
        "deaf": lambda: play(HOST, deaf, 500_000),
        "unguarded": lambda: play(HOST, None, 400_000, first=taken),
        "wrong image": lambda: play(HOST, None, 400_000, first=flipped),
        "stuck bit": lambda: play(HOST, None, 400_000, before=stuck),
        "coupled bits": lambda: play(HOST, None, 400_000, before=coupled),
        "slow processor": lambda: play(HOST, None, 400_000, before=slow),
        "no low-speed clock": lambda: play(HOST, None, 400_000, before=silent),
        "brown-out level": lambda: play(HOSTS["level"], None, 100_000, before=delivered),
        "voltage at the start": lambda: play(HOST, None, 1_200_000, before=charged),
        "late tick": lambda: play(HOST, late(6_400), 440_000),
        "overrun": lambda: play(HOST, late(7_400), 480_000),
        "stalled tasks": lambda: play(HOST, idle, 600_000),
        "stopped timer": lambda: play(HOST, timeless, 400_000),
        "halted": lambda: play(HOST, halted, 500_000),
        "flood": lambda: play(HOSTS["flood"], opened, 440_000),
        "sent": lambda: play(HOSTS["sent"], None, answered(HOSTS["sent"])),
        "cut settings": lambda: play(SETTINGS_HOST, None, answered(SETTINGS_HOST), before=cut(STORE[0], SETTINGS, CUTS["settings"])),
        "cut model": lambda: play(MODEL_HOST, None, answered(MODEL_HOST), before=cut(STORE[2], MODEL, CUTS["model"])),
        "protected page": lambda: play(HOSTS["protected"], None, answered(HOSTS["protected"]), before=protected),
    }
    print(json.dumps({name: RUNS[name]() for name in CASE["runs"]}))
