"""Boots an image, injects faults: boot.py IMAGE TICK PANIC RTT MAIN TAKEN VOLTS HOST RECORDED RANDOM prints the events as JSON.

TICK and PANIC are the addresses of the control tick and of `core::panicking::panic`, RTT is the log's, MAIN that of the
program's first function after start-up, TAKEN that of `cortex_m::peripheral::TAKEN`. VOLTS is the full scale of its
amplifier. HOST is what a host sends, as JSON: [time in us, bytes in hex] each, and RECORDED the same of another chip. RANDOM
is what the random number generator delivers.
"""

import json
import struct
import sys

from unicorn.arm_const import UC_ARM_REG_PRIMASK, UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2

from board import BUTTON, FLASH, HZ, POWER_ON, RAM, Board

MISHAP_TICK = 300
STORE = [FLASH + 0x7F000 + page * 0x800 for page in range(2)]  # First word of each page, half written at a power cut.
UNDEFINED, HANG = b"\x00\xde", b"\xfe\xe7"


def panic(board):
    """Calls `panic("injected")` at `injected.rs:7`, its arguments at the end of the stack."""
    text = b"injected.rs\0injected"
    board.uc.mem_write(RAM + 0x40, text)
    board.uc.mem_write(RAM + 0x20, struct.pack("<4I", RAM + 0x40, 11, 7, 1))
    for reg, value in ((UC_ARM_REG_R0, RAM + 0x4C), (UC_ARM_REG_R1, 8), (UC_ARM_REG_R2, RAM + 0x20)):
        board.uc.reg_write(reg, value)
    board.pc = PANIC


def broken(code):
    """Replaces the tick's first instruction."""

    def mishap(board):
        board.uc.mem_write(TICK, code)
        board.uc.ctl_remove_cache(TICK, TICK + 4)

    return mishap


def rotten(board):
    """A word of code or constants has two wrong bits."""
    board.two_wrong_bits()


def dip(board):
    """The supply dips, for too short a time to clear the memory."""
    board.cut = board.now, POWER_ON


def pressed(board):
    """The reset button is pressed after a fault."""
    opened(board)
    board.cut = board.now + 20 * HZ // 1000, BUTTON


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


def taken(board):
    """Another owner has the core's peripherals, so that the guards of stack and control task cannot be set up."""
    board.traps.clear()
    board.uc.mem_write(TAKEN, b"\x01")


def flipped(board):
    """The last byte of the image has a wrong bit."""
    board.traps.clear()
    board.uc.mem_write(FLASH + len(IMAGE) - 1, bytes([IMAGE[-1] ^ 0x10]))


def play(host, mishap, until_us, torn=(), first=None, random_number=None):
    """Injects `first` where the program begins. After the reset the flash is correct again; the memory keeps its content."""
    board = Board(IMAGE, RTT, host, FULL_SCALE, RANDOM if random_number is None else random_number)
    for at in torn:
        board.tear(at)
    ticks = 0

    def tick(board):
        nonlocal ticks
        ticks += 1
        if mishap and ticks == MISHAP_TICK:
            board.traps.clear()
            board.note("mishap", ticks)
            mishap(board)

    board.traps[TICK] = tick
    if first:
        board.traps[MAIN] = first
    board.reset(POWER_ON)
    while (cause := board.run(until_us)) is not None:
        board.uc.mem_write(FLASH, IMAGE)
        board.uc.ctl_remove_cache(FLASH, FLASH + len(IMAGE))
        board.reset(cause)
    return board.log


if __name__ == "__main__":
    with open(sys.argv[1], "rb") as file:
        IMAGE = file.read()
    TICK, PANIC, RTT, MAIN, TAKEN = (int(word, 0) for word in sys.argv[2:7])
    FULL_SCALE = float(sys.argv[7])
    HOST, RECORDED = ([(us, bytes.fromhex(frame)) for us, frame in json.loads(arg)] for arg in sys.argv[8:10])
    RANDOM = int(sys.argv[10], 0)
    print(json.dumps({
        "quiet": play([], None, 1_200_000),
        "host": play(HOST, stalled, 1_700_000),
        "panic": play(HOST, panic, 400_000),
        "hard fault": play(HOST, broken(UNDEFINED), 400_000),
        "two wrong bits": play(HOST, rotten, 400_000),
        "torn": play([], None, 200_000, STORE),
        "dip": play(HOST, dip, 400_000),
        "button": play(HOST, pressed, 400_000),
        "interlock": play(HOST, opened, 480_000),
        "no voltage": play(HOST, shorted, 480_000),
        "other amplifier": play(HOST, mistaken, 480_000) if FULL_SCALE < 1000 else None,
        "supply of 3.6 V": play(HOST, oversupplied, 480_000),
        "current": play(HOST, arcing, 480_000),
        "replayed": play(RECORDED, None, 1_000_000),
        "no random number": play(HOST, None, 200_000, random_number=0),
        "hang": play(HOST, broken(HANG), 500_000),
        "deaf": play(HOST, deaf, 500_000),
        "unguarded": play(HOST, None, 400_000, first=taken),
        "wrong image": play(HOST, None, 400_000, first=flipped),
    }))
