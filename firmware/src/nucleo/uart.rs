//! The host's line: LPUART1, every byte by interrupt, through a buffer in each direction.

// The two macros', which take a buffer once and connect an interrupt.
#![allow(unsafe_code)]

use cortex_m::singleton;
use embassy_stm32::peripherals::{LPUART1, PA2, PA3};
use embassy_stm32::usart::{self, BufferedUart, Config};
use embassy_stm32::{Peri, bind_interrupts};
use embassy_time::{Duration, with_timeout};
use embedded_io_async::{Read, Write};
use link::frame::MAX_FRAME;

use crate::host::Line;

bind_interrupts!(struct Interrupts {
    LPUART1 => usart::BufferedInterruptHandler<LPUART1>;
});

/// Bytes that may wait for this task: it may be waiting itself until a frame has left.
const RECEIVED: usize = 2 * MAX_FRAME;
/// How often to look whether there is room to send: the driver's `write` does not wake who waits for it.
const LOOK: Duration = Duration::from_millis(1);

/// The line.
pub struct Uart(BufferedUart<'static>);

impl Uart {
    /// Sets it up, 115 200 bit/s; `None` if it is in use already.
    pub fn new(uart: Peri<'static, LPUART1>, rx: Peri<'static, PA3>, tx: Peri<'static, PA2>) -> Option<Self> {
        let to_send = singleton!(: [u8; MAX_FRAME] = [0; MAX_FRAME])?;
        let received = singleton!(: [u8; RECEIVED] = [0; RECEIVED])?;
        BufferedUart::new(uart, rx, tx, to_send, received, Interrupts, Config::default()).ok().map(Self)
    }
}

impl Line for Uart {
    async fn read(&mut self, buffer: &mut [u8]) -> usize {
        // An error costs bytes, and the frame that they were in is dropped by its CRC.
        self.0.read(buffer).await.unwrap_or(0)
    }

    async fn write(&mut self, bytes: &[u8]) {
        // All of it goes into the buffer at once, or nothing.
        while with_timeout(LOOK, self.0.write(bytes)).await.is_err() {}
    }
}
