//! Line to the host: UART 0, driven by interrupts.
//!
//! If the receive buffer is full, a byte stays in the UART, and its interrupt is pended after the next read. The emulator's
//! line then waits; a real one would lose the byte, and with it one frame.

use core::future::poll_fn;
use core::task::Poll;

use cortex_m::peripheral::NVIC;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_sync::waitqueue::AtomicWaker;
use firmware::board::Line;

use super::interrupts::Interrupt;
use super::registers::{CLOCK_HZ, UART_0_CONTROL, UART_0_DATA, UART_0_DIVIDER, UART_0_INTERRUPT, UART_0_STATE};

const BAUD: u32 = 115_200;

const IS_FULL_TO_SEND: u32 = 1;
const HAS_RECEIVED: u32 = 1 << 1;
const SENT: u32 = 1;
const RECEIVED: u32 = 1 << 1;

static INCOMING: Pipe<CriticalSectionRawMutex, 256> = Pipe::new();
static ROOM: AtomicWaker = AtomicWaker::new();

/// The line to the host.
#[derive(Debug)]
pub struct Uart(());

impl Uart {
    /// Initialises the line. Call it once.
    pub fn init() -> Self {
        UART_0_DIVIDER.write(CLOCK_HZ / BAUD);
        UART_0_CONTROL.write(0b1111);
        // SAFETY: the vector table contains the handlers.
        unsafe { NVIC::unmask(Interrupt::Received) };
        // SAFETY: as above.
        unsafe { NVIC::unmask(Interrupt::Sent) };
        Self(())
    }
}

impl Line for Uart {
    async fn read(&mut self, buffer: &mut [u8]) -> usize {
        let count = INCOMING.read(buffer).await;
        NVIC::pend(Interrupt::Received);
        count
    }

    async fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            poll_fn(|context| {
                ROOM.register(context.waker());
                if UART_0_STATE.read() & IS_FULL_TO_SEND == 0 { Poll::Ready(()) } else { Poll::Pending }
            })
            .await;
            UART_0_DATA.write(u32::from(*byte));
        }
    }
}

/// Handles a received byte, or new space in the receive buffer.
pub(super) fn on_received() {
    UART_0_INTERRUPT.write(RECEIVED);
    while UART_0_STATE.read() & HAS_RECEIVED != 0 && !INCOMING.is_full() {
        let byte = UART_0_DATA.read() as u8;
        // Cannot fail: there is space, and nothing else writes to the buffer.
        let _ = INCOMING.try_write(&[byte]);
    }
}

/// Handles a sent byte.
pub(super) fn on_sent() {
    UART_0_INTERRUPT.write(SENT);
    ROOM.wake();
}
